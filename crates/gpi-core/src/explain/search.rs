//! The closed loop: score candidates, fit the best few jointly, keep what the held-out data confirm.

use super::grid::enriched;
use super::lags::Before;
use super::score::{Base, Score, scores};
use crate::effects::{CATALOGUE, Candidate, Entry, Stage};
use crate::identify::NoiseFloor;
use crate::identify::levenberg_marquardt::{FitOptions, Fitted, fit};
use crate::identify::outliers;
use crate::identify::point::Point;
use crate::identify::preparation::{Prepared, rescale};
use crate::identify::refine::{RefineOptions, Refined, settings};
use crate::identify::{Progress, report};
use crate::{Error, Matrix, Record};

/// What a fit with one more effect brought.
#[derive(Clone)]
pub(crate) struct Trial {
    pub entry: &'static Entry,
    pub point: Point,
    pub cost: f64,
    /// `N ln(cost before / cost after)`.
    pub deviance: f64,
    /// What chance alone would give at most, with the colour of the residual that is left.
    pub chance: f64,
    /// Sum of squares of what is held out, block by block.
    pub held_out: Vec<f64>,
    /// The part of the residual that the score test promised.
    pub promised: f64,
}

/// An effect that was tried and not taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Rejected {
    /// The effect.
    pub effect: &'static str,
    /// Root mean square error with it on the held-out blocks.
    pub holdout_rms: f64,
    /// Why it was not taken.
    pub why: String,
    /// Effects that explain the same.
    pub confounded_with: Vec<&'static str>,
}

/// A round of the search.
#[derive(Clone)]
pub(crate) struct Round {
    pub trial: Trial,
    pub others: Vec<Rejected>,
    /// Effects that an earlier round had taken and that this one made superfluous.
    pub dropped: Vec<&'static str>,
}

/// An effect that takes a smaller part of the residual's squares is of no use to anyone.
const LEAST: f64 = 0.04;

pub(crate) struct Search<'a> {
    pub prepared: Prepared<'a>,
    /// The prepared record as it was measured, wrong samples included.
    pub measured: Record,
    /// Where what the training holds out is scored.
    pub test: Record,
    pub options: FitOptions,
    pub allowed: Vec<&'static Entry>,
    /// Whether a mode that G lacks is an effect; else it is an order that G was not given.
    pub order_is_given: bool,
    /// Which grids may move and become finer.
    pub moving: RefineOptions,
    /// Whether the grids were placed anew since the latest effect.
    pub is_rich: bool,
    /// What was found before slow lags were taken out of G.
    pub before: Option<Before>,
    pub point: Point,
    pub cost: f64,
    pub rounds: Vec<Round>,
    /// Isolated wrong samples, `[experiment][output]`.
    pub wrong: Vec<Vec<Vec<usize>>>,
    /// What was tried in the last round and not taken.
    pub last: Vec<Rejected>,
}

impl<'a> Search<'a> {
    /// Goes on from a refined base model.
    pub(crate) fn new(
        prepared: Prepared<'a>,
        refined: &Refined,
        allowed: Vec<&'static Entry>,
        order_is_given: bool,
        measured: Record,
        moving: RefineOptions,
    ) -> Result<Self, Error> {
        /// Levenberg-Marquardt steps of a trial.
        const STEPS: usize = 12;
        let mut options = settings(&prepared, &RefineOptions::default(), STEPS);
        options.weighting.outputs.clone_from(&refined.options.weighting.outputs);
        options.gain = 1e-5;
        Ok(Self {
            test: super::blocks::complement(&prepared.record)?,
            prepared,
            options,
            allowed,
            order_is_given,
            moving,
            is_rich: false,
            before: None,
            point: refined.fitted.point.clone(),
            cost: refined.fitted.linearization.cost,
            rounds: Vec::new(),
            wrong: Vec::new(),
            measured,
            last: Vec::new(),
        })
    }

    /// Adds effects until nothing more is confirmed.
    pub(crate) fn run(&mut self, progress: Progress) -> Result<(), Error> {
        const ROUNDS: usize = 12;
        for _ in 0..ROUNDS {
            let known = self.rounds.len();
            self.round(progress)?;
            if self.rounds.len() == known && !self.shed_lags(progress)? {
                break;
            }
        }
        Ok(())
    }

    /// One round: takes the best effect, if any is confirmed.
    fn round(&mut self, progress: Progress) -> Result<(), Error> {
        /// Families that are fitted; the score test's best are rarely wrong.
        const FITTED: usize = 4;
        /// Part of the residual's squares.
        const STRONG: f64 = 0.6;
        /// Where no family promises this much, no fit would reach what an effect has to gain.
        const HOPELESS: f64 = 0.5 * LEAST;
        /// Far from the noise, what a misfit leaves looks like many effects a little: there an effect must
        /// take this part of the squares, on what is held out too.
        const SUBSTANTIAL: f64 = 0.3;
        /// Squares over those of the noise.
        const NEAR: f64 = 2.25;
        /// Effects with a signature that no misfit has.
        const SIGNED: [&str; 2] = ["periodic-disturbance", "covariate"];
        let mut ranked = self.ranked(progress)?;
        // A strong candidate is looked at first: the grid would bend to what it explains.
        let most = ranked.iter().map(|(_, score)| score.gain).fold(0.0, f64::max);
        if most < STRONG && !self.is_rich && self.enrich(progress)? {
            ranked = self.ranked(progress)?;
        }
        if ranked.iter().all(|(_, score)| score.gain < HOPELESS) {
            self.last.clear();
            return Ok(());
        }
        let before = self.held_out(&self.point)?;
        let mut trials = Vec::new();
        for (entry, score) in ranked.into_iter().take(FITTED) {
            report(progress, entry.name, 0.0)?;
            trials.push(self.trial(entry, score, progress)?);
        }
        // what is explained, less what so many parameters would by chance
        trials.sort_by(|a, b| (b.deviance - b.chance).total_cmp(&(a.deviance - a.chance)));
        let floor = self.floor()?;
        let sum = |squares: &[f64]| squares.iter().sum::<f64>();
        let taken = trials.iter().position(|trial| {
            let left = (trial.cost / self.cost).max(sum(&trial.held_out) / sum(&before));
            let weighty = left < 1.0 - SUBSTANTIAL
                || trial.cost < NEAR * floor
                || SIGNED.contains(&trial.entry.name);
            trial.deviance > trial.chance && weighty && is_confirmed(&before, &trial.held_out)
        });
        let Some(taken) = taken else {
            self.last = trials.iter().map(|trial| self.reject(trial, None, &before)).collect();
            return Ok(());
        };
        let taken = trials.remove(taken);
        let others = trials.iter().map(|trial| self.reject(trial, Some(&taken), &before)).collect();
        self.point = taken.point.clone();
        self.cost = taken.cost;
        if taken.entry.name == "linear-dynamics" && !self.order_is_given {
            self.absorb_modes();
        }
        self.rounds.push(Round { trial: taken, others, dropped: Vec::new() });
        self.repair()?;
        // the grids were placed before this effect was known
        self.is_rich = false;
        self.rearrange(progress)?;
        self.backward(progress)?;
        Ok(())
    }

    /// Moves half-widths and thresholds, and takes finer grids as long as they pay: what the declared model
    /// itself can explain is no effect. Says whether the model became better.
    fn enrich(&mut self, progress: Progress) -> Result<bool, Error> {
        /// Times that plays and deadzones are added.
        const ROUNDS: usize = 6;
        /// The part of the residual's squares below which a round is the last.
        const SMALL: f64 = 0.02;
        let values = self.prepared.values();
        let mut gained = false;
        self.is_rich = true;
        for round in 0..ROUNDS {
            report(progress, "finer grid", round as f64 / ROUNDS as f64)?;
            let (point, added) = enriched(&self.base()?, &self.prepared, &self.moving)?;
            if added == 0 && round > 0 {
                break;
            }
            let (point, cost) = self.on_moving_grids(point, progress)?;
            let deviance = values * (self.cost / cost.max(f64::MIN_POSITIVE)).ln();
            if deviance < 2.0 * added as f64 * values.ln() {
                break;
            }
            (self.point, self.cost) = (point, cost);
            gained = true;
            if deviance < SMALL * values {
                break;
            }
        }
        Ok(gained)
    }

    /// The squares that noise alone would leave.
    fn floor(&self) -> Result<f64, Error> {
        let record = &self.prepared.record;
        let noise = NoiseFloor::estimate(record, &self.point.residuals(record)?);
        let weights = &self.options.weighting.outputs;
        let squares = noise.rms.iter().zip(weights).map(|(rms, weight)| (rms * weight).powi(2));
        Ok(squares.sum::<f64>() * record.scored() as f64)
    }

    fn base(&self) -> Result<Base<'_>, Error> {
        let Self { point, prepared, options, .. } = self;
        Base::new(point, &prepared.record, options.freedom, &options.weighting)
    }

    /// A point fitted with grids that move, plays and deadzones without use left out; and its cost.
    fn on_moving_grids(&self, point: Point, progress: Progress) -> Result<(Point, f64), Error> {
        const STEPS: usize = 15;
        let mut options = settings(&self.prepared, &self.moving, STEPS);
        options.weighting = self.options.weighting.clone();
        options.gain = 1e-3;
        let record = &self.prepared.record;
        let mut fitted = fit(point, record, &options, "refinement", progress)?;
        if fitted.point.drop_unused() {
            options.steps = STEPS / 3;
            fitted = fit(fitted.point, record, &options, "refinement", progress)?;
        }
        Ok((fitted.point, fitted.linearization.cost))
    }

    /// Adds an effect that the user asks for, whatever it gains.
    pub(crate) fn force(&mut self, entry: &'static Entry, progress: Progress) -> Result<(), Error> {
        if self.point.effects.iter().any(|effect| effect.name() == entry.name) {
            return Ok(());
        }
        let Some((_, score, _)) = self.scored(&[entry], progress)?.into_iter().next() else {
            let requirement = "the record shows nothing to place it by; leave it out";
            return Err(Error::parameter("require", entry.name, requirement));
        };
        let trial = self.trial(entry, score, progress)?;
        (self.point, self.cost) = (trial.point.clone(), trial.cost);
        self.rounds.push(Round { trial, others: Vec::new(), dropped: Vec::new() });
        self.repair()
    }

    /// The best candidate of each family that promises something, the most promising first.
    fn ranked(&self, progress: Progress) -> Result<Vec<(&'static Entry, Score)>, Error> {
        let mut best = self.scored(&self.allowed, progress)?;
        /// A family that promises less than this part of the best one's need not be fitted.
        const FAR_BEHIND: f64 = 0.2;
        let most = best.first().map_or(0.0, |first| first.2);
        best.retain(|(_, _, worth)| *worth > 0.0 && *worth > FAR_BEHIND * most);
        Ok(best.into_iter().map(|(entry, score, _)| (entry, score)).collect())
    }

    /// The best candidate of each family, and by how much its deviance exceeds what its parameters cost.
    fn scored(
        &self,
        families: &[&'static Entry],
        progress: Progress,
    ) -> Result<Vec<(&'static Entry, Score, f64)>, Error> {
        let base = self.base()?;
        let values = self.prepared.values();
        let present = |entry: &Entry| self.point.effects.iter().any(|e| e.name() == entry.name);
        // G of any order takes a delay for itself
        let of_use = |entry: &Entry| entry.name != "delay" || self.order_is_given;
        let usable = |entry: &&&Entry| of_use(entry) && (entry.repeats || !present(entry));
        let (mut entries, mut candidates) = (Vec::new(), Vec::new());
        for &entry in families.iter().filter(usable) {
            let found = base.situation(entry.candidates);
            // before and behind the output stage is the same where there is none
            let elsewhere = found.iter().filter_map(Candidate::elsewhere).filter(|_| self.senses());
            candidates.extend(elsewhere.collect::<Vec<_>>());
            candidates.extend(found);
            entries.resize(candidates.len(), entry);
        }
        let mut check = |done| report(progress, "score test", done);
        let mut best: Vec<(&'static Entry, Score, f64)> = Vec::new();
        for (entry, score) in entries.into_iter().zip(scores(&base, &candidates, &mut check)?) {
            let deviance = -values * (1.0 - score.gain).max(1e-300).ln();
            let worth = deviance - score.columns as f64 * values.ln();
            match best.iter_mut().find(|(known, _, _)| known.name == entry.name) {
                Some(known) if known.2 < worth => *known = (entry, score, worth),
                Some(_) => {}
                None => best.push((entry, score, worth)),
            }
        }
        best.sort_by(|a, b| b.2.total_cmp(&a.2));
        Ok(best)
    }

    /// Fits the whole model with one more effect.
    fn trial(
        &self,
        entry: &'static Entry,
        score: Score,
        progress: Progress,
    ) -> Result<Trial, Error> {
        /// Where the start that the score test suggests is worse than the model without the effect by this
        /// factor of the squares, it is beyond what is linear.
        const BEYOND: f64 = 10.0;
        let mut start = self.point.with_effect(score.start);
        if let Some(zero) = score.zero
            && self.squares(&start, &self.prepared.record)?.iter().sum::<f64>() > BEYOND * self.cost
        {
            start = self.point.with_effect(zero);
        }
        let record = &self.prepared.record;
        let fitted = fit(start, record, &self.options, entry.name, progress)?;
        self.judged(entry, fitted, score.gain, progress)
    }

    fn judged(
        &self,
        entry: &'static Entry,
        fitted: Fitted,
        promised: f64,
        progress: Progress,
    ) -> Result<Trial, Error> {
        let (cost, values) = (fitted.linearization.cost, self.prepared.values());
        let point = fitted.point.clone();
        let added = fitted.linearization.layout.len.saturating_sub(self.layout_len());
        /// Candidates that a round looks at: the best of so many must be better than one.
        const LOOKS: f64 = 150.0;
        let deviance = values * (self.cost / cost.max(f64::MIN_POSITIVE)).ln();
        let white = added.max(1) as f64 * values.ln() + 2.0 * LOOKS.ln();
        let mut chance = white.max(LEAST * values);
        if deviance > chance {
            let refined =
                Refined { fitted, options: self.options.clone(), outliers: 0, robust: false };
            let uncertainty = refined.uncertainty(&self.prepared, progress)?;
            let colour = uncertainty.used / uncertainty.estimated.max(1) as f64;
            chance = chance.max(colour * white);
        }
        let held_out = self.held_out(&point)?;
        Ok(Trial { entry, point, cost, deviance, chance, held_out, promised })
    }

    fn layout_len(&self) -> usize {
        crate::identify::point::Layout::new(&self.point, self.options.freedom).len
    }

    /// Sum of squares of every held-out block.
    fn held_out(&self, point: &Point) -> Result<Vec<f64>, Error> {
        self.squares(point, &self.test)
    }

    /// Sum of squares of every run that `scored` scores.
    fn squares(&self, point: &Point, scored: &Record) -> Result<Vec<f64>, Error> {
        // run over the training record, whose starts were fitted
        let residuals = point.residuals(&self.prepared.record)?;
        let weights = &self.options.weighting.outputs;
        let mut sums = Vec::new();
        for (residual, experiment) in residuals.iter().zip(scored.experiments()) {
            for run in experiment.scored_rows(residual) {
                let columns = run.column_iter().zip(weights);
                sums.push(columns.map(|(c, w)| w * w * c.norm_squared()).sum());
            }
        }
        Ok(sums)
    }

    pub(crate) fn holdout_rms(&self, held_out: &[f64]) -> f64 {
        let values = self.test.scored() * self.test.outputs().len();
        (held_out.iter().sum::<f64>() / values.max(1) as f64).sqrt()
    }

    fn reject(&self, trial: &Trial, taken: Option<&Trial>, before: &[f64]) -> Rejected {
        let holdout_rms = self.holdout_rms(&trial.held_out);
        let (mut why, mut confounded_with) = (String::new(), Vec::new());
        match taken {
            Some(taken) if trial.deviance > taken.deviance - taken.chance => {
                why = format!("explains as much as {}", taken.entry.name);
                confounded_with.push(taken.entry.name);
            }
            Some(taken) => why = format!("{} explains more", taken.entry.name),
            None if trial.deviance <= trial.chance => {
                why.push_str("gains no more than chance would");
            }
            None if is_confirmed(before, &trial.held_out) => {
                why.push_str("takes too little of what is left, which is far above the noise");
            }
            None => why.push_str("is not confirmed by the held-out blocks"),
        }
        Rejected { effect: trial.entry.name, holdout_rms, why, confounded_with }
    }

    /// Whether the model has an output stage.
    fn senses(&self) -> bool {
        self.point.at_stage(Stage::Output).next().is_some()
    }

    /// Puts what is added to the other side of the output stage where that explains more.
    fn rearrange(&mut self, progress: Progress) -> Result<(), Error> {
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
    fn backward(&mut self, progress: Progress) -> Result<(), Error> {
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
    fn absorb_modes(&mut self) {
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

/// Whether what is held out has become smaller by more than chance: in the mean of the blocks, or in
/// some blocks (those in which the effect shows) and hardly worse in any other.
fn is_confirmed(before: &[f64], after: &[f64]) -> bool {
    /// The least part by which the sum must fall.
    const LEAST: f64 = 5e-3;
    /// Standard errors of the mean difference.
    const ERRORS: f64 = 1.7;
    /// How much more the better blocks must gain than the worse ones lose.
    const ONE_SIDED: f64 = 10.0;
    let differences: Vec<f64> = before.iter().zip(after).map(|(a, b)| a - b).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let total: f64 = before.iter().sum();
    let gained: f64 = differences.iter().filter(|d| **d > 0.0).sum();
    let lost: f64 = -differences.iter().filter(|d| **d < 0.0).sum::<f64>();
    let one_sided = gained > ONE_SIDED * lost;
    mean * n > LEAST * total && (one_sided || mean > ERRORS * (variance / n).sqrt())
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

/// The entries that `names` allow, all when there are none.
pub(crate) fn allowed(names: Option<&[String]>) -> Result<Vec<&'static Entry>, Error> {
    let Some(names) = names else { return Ok(CATALOGUE.iter().collect()) };
    let find = |name: &String| {
        CATALOGUE.iter().find(|entry| entry.name == name).ok_or_else(|| {
            let known: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
            Error::parameter("effects", name, format!("one of {}", known.join(", ")))
        })
    };
    names.iter().map(find).collect()
}
