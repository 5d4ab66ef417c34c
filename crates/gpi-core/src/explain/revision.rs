//! What was found is looked at again once more is known.

use super::ranking::{Ranked, SLOW};
use super::search::{Round, Search};
use super::trial::Trial;
use crate::Progress;
use crate::effects::Entry;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::rescale;
use crate::uncertainty::outliers;
use crate::{Error, Matrix, Record};

impl Search<'_> {
    /// Puts what is added to the other side of the output stage where that explains more.
    pub(super) fn rearrange(&mut self, progress: Progress) -> Result<(), Error> {
        /// The part by which the residual's squares must fall.
        const LEAST: f64 = 0.01;
        if !self.point.senses() {
            return Ok(());
        }
        let record = &self.prepared.record;
        for place in 0..self.point.effects.len() {
            let Some(other) = self.point.effects[place].elsewhere() else { continue };
            let moved = self.point.without_effect(place).with_effect(other);
            let fitted = fit(moved, record, &self.options, "rearrangement", progress)?;
            if fitted.linearization.cost < (1.0 - LEAST) * self.cost {
                (self.point, self.cost) = (fitted.point, fitted.linearization.cost);
            }
        }
        Ok(())
    }

    /// Drops effects that a later one has made superfluous.
    pub(super) fn backward(&mut self, progress: Progress) -> Result<(), Error> {
        /// How much larger the squares of what is held out may be.
        const WORSE: f64 = 1.5;
        let mut place = 0;
        while self.point.effects.len() > 1 && place < self.point.effects.len() {
            let entry = self.point.effects[place].entry();
            let newest = self.rounds.last().map(|round| round.trial.entry.name);
            if Some(entry.name) == newest {
                place += 1;
                continue;
            }
            let fitted = self.without(place, progress)?;
            let lost = self.prepared.values() * (fitted.linearization.cost / self.cost).ln();
            let chance = self.rounds.last().map_or(0.0, |round| round.trial.chance);
            let then = self.held_out(&fitted.point)?;
            if lost < chance && self.holds_up(&then, WORSE)? {
                (self.point, self.cost) = (fitted.point, fitted.linearization.cost);
                if let Some(round) = self.rounds.last_mut() {
                    round.dropped.push(entry.name);
                }
            } else {
                place += 1;
            }
        }
        Ok(())
    }

    /// Puts what the input drives in the place of a slow function of time, which fits much, where it explains
    /// as much.
    pub(super) fn prefer_driven(&mut self, progress: Progress) -> Result<(), Error> {
        /// How much larger the squares of what is held out may be.
        const WORSE: f64 = 1.05;
        let driven: Vec<&'static Entry> = self
            .allowed
            .iter()
            .copied()
            .filter(|entry| entry.driven && !SLOW.contains(&entry.name))
            .collect();
        for name in SLOW {
            let Some(place) = self.point.effects.iter().position(|effect| effect.name() == name)
            else {
                continue;
            };
            let without = self.point.without_effect(place);
            let best = self.scored_beside(&without, &driven, progress)?.into_iter().next();
            let Some(Ranked { entry, score, .. }) = best else { continue };
            let record = &self.prepared.record;
            let options = FitOptions { steps: 2 * self.options.steps, ..self.options.clone() };
            let gain = score.gain;
            let start = self.start(&without, score)?;
            let fitted = fit(start, record, &options, entry.name, progress)?;
            let lost = self.prepared.values() * (fitted.linearization.cost / self.cost).ln();
            let round = self.rounds.iter().find(|round| round.trial.entry.name == name);
            let Some(Trial { deviance, chance, .. }) = round.map(|round| &round.trial) else {
                continue;
            };
            // what the slow function had gained, less what is lost with it
            let (deviance, is_as_good) = (deviance - lost, lost < *chance);
            let judged =
                self.judged(&without, entry, fitted, self.options.clone(), gain, progress)?;
            let trial = Trial { deviance, ..judged };
            let is_sound = trial.is_driven && self.is_plausible(&trial.point);
            if is_as_good && is_sound && self.holds_up(&trial.held_out, WORSE)? {
                (self.point, self.cost) = (trial.point.clone(), trial.cost);
                self.rounds.push(Round { trial, others: Vec::new(), dropped: vec![name] });
                self.repair()?;
            }
        }
        Ok(())
    }

    /// Whether the squares of what is held out have grown by less than this factor.
    fn holds_up(&self, held_out: &[f64], factor: f64) -> Result<bool, Error> {
        let sum = |squares: &[f64]| squares.iter().sum::<f64>();
        Ok(sum(held_out) < factor * sum(&self.held_out(&self.point)?))
    }

    /// The best fit without one of the effects. The newest starts from the score test anew too: beside the
    /// one that goes it may have become what no fit leads back from.
    fn without(&self, place: usize, progress: Progress) -> Result<Fitted, Error> {
        let record = &self.prepared.record;
        let without = self.point.without_effect(place);
        let Some(newest) = self.rounds.last().map(|round| round.trial.entry) else {
            return fit(without, record, &self.options, "backward step", progress);
        };
        let (fitted, _) = self.fitted(without.clone(), newest, progress)?;
        let own = without.effects.iter().rposition(|effect| effect.name() == newest.name);
        let Some(own) = own.filter(|_| newest.driven) else { return Ok(fitted) };
        let point = without.without_effect(own);
        let best = self.scored_beside(&point, &[newest], progress)?.into_iter().next();
        let Some(best) = best else { return Ok(fitted) };
        let start = self.start(&point, best.score)?;
        let (anew, _) = self.fitted(start, newest, progress)?;
        let is_better = anew.linearization.cost < fitted.linearization.cost;
        Ok(if is_better { anew } else { fitted })
    }

    /// Makes modes that were found parts of G.
    pub(super) fn absorb_modes(&mut self) {
        while let Some(place) =
            self.point.effects.iter().position(|effect| effect.name() == "linear-dynamics")
        {
            for section in &mut self.point.dynamics.sections {
                section.beside = match section.beside {
                    Some(own) if own == place => None,
                    Some(own) if own > place => Some(own - 1),
                    other => other,
                };
            }
            self.point.effects.remove(place);
        }
        rescale(&mut self.point);
    }

    /// Replaces isolated outliers of the residual by what their neighbours say, also where the record is
    /// held out: a wrong sample says nothing about a model.
    ///
    /// Each time from what was measured: samples that an effect makes stand apart are wrong only until it
    /// is known.
    pub(crate) fn repair(&mut self) -> Result<(), Error> {
        let residuals = self.point.residuals(&self.measured)?;
        self.wrong = outliers::places(&residuals, &everything(&self.measured)?, 0);
        self.prepared.record = repaired(&self.measured, &residuals, &self.wrong)?;
        // what the next fits are compared with
        self.cost = self.training_squares(&self.point)?;
        Ok(())
    }
}

/// The record with nothing held out.
pub(crate) fn everything(record: &Record) -> Result<Record, Error> {
    let mut experiments = record.experiments().to_vec();
    experiments.iter_mut().for_each(|experiment| experiment.held_out.clear());
    record.with_experiments(experiments)
}

/// The record with samples at `places` set to what makes their residual that of their neighbours.
pub(crate) fn repaired(
    record: &Record,
    residuals: &[Matrix],
    places: &[Vec<Vec<usize>>],
) -> Result<Record, Error> {
    let mut experiments = record.experiments().to_vec();
    for ((experiment, residual), places) in experiments.iter_mut().zip(residuals).zip(places) {
        for (output, places) in places.iter().enumerate() {
            for &k in places {
                let beside = 0.5 * (residual[(k - 1, output)] + residual[(k + 1, output)]);
                experiment.output[(k, output)] += beside - residual[(k, output)];
            }
        }
    }
    record.with_experiments(experiments)
}
