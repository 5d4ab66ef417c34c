//! What was found is looked at again once more is known.

use super::search::Search;
use crate::effects::Stage;
use crate::identify::levenberg_marquardt::fit;
use crate::identify::preparation::rescale;
use crate::identify::{Progress, outliers};
use crate::{Error, Matrix, Record};

impl Search<'_> {
    /// Whether the model has an output stage.
    pub(super) fn senses(&self) -> bool {
        self.point.at_stage(Stage::Output).next().is_some()
    }

    /// Puts what is added to the other side of the output stage where that explains more.
    pub(super) fn rearrange(&mut self, progress: Progress) -> Result<(), Error> {
        /// The part by which the residual's squares must fall.
        const LEAST: f64 = 0.01;
        if !self.senses() {
            return Ok(());
        }
        let record = &self.prepared.record;
        for place in 0..self.point.effects.len() {
            let Some(other) = self.point.effects[place].block().elsewhere() else { continue };
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
        let mut place = 0;
        while self.point.effects.len() > 1 && place < self.point.effects.len() {
            let entry = self.point.effects[place].entry();
            let newest = self.rounds.last().map(|round| round.trial.entry.name);
            if Some(entry.name) == newest {
                place += 1;
                continue;
            }
            let without = self.point.without_effect(place);
            let record = &self.prepared.record;
            let fitted = fit(without, record, &self.options, "backward step", progress)?;
            let lost = self.prepared.values() * (fitted.linearization.cost / self.cost).ln();
            let chance = self.rounds.last().map_or(0.0, |round| round.trial.chance);
            if lost < chance {
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
        self.cost = self.squares(&self.point, &self.prepared.record)?.iter().sum();
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
