//! One more effect, fitted jointly with the whole model and judged.

use super::ranking::Ranked;
use super::score::Score;
use super::search::Search;
use crate::Progress;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::{ClosedLoops, Effect, Entry, Stage};
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::refine::Refined;
use crate::fit::representatives::representatives;
use crate::linear::Section;
use crate::optimize::Status;
use crate::{Error, Record};

/// An effect that takes a smaller part of the residual's squares is of no use to anyone.
pub(super) const LEAST: f64 = 0.04;

/// What a fit with one more effect brought.
#[derive(Clone)]
pub(crate) struct Trial {
    pub entry: &'static Entry,
    pub point: Point,
    pub cost: f64,
    /// `N ln(cost before / cost after)`, less what the same fit gains without the effect where that moves
    /// more than the base model's did.
    pub deviance: f64,
    /// What chance alone would give at most, with the colour of the residual that is left.
    pub chance: f64,
    /// Sum of squares of what is held out, block by block.
    pub held_out: Vec<f64>,
    /// The part of the residual that the score test promised.
    pub promised: f64,
    /// Whether the input makes it explain what it does, where it is an effect that the input drives.
    pub is_driven: bool,
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

impl Search<'_> {
    /// Fits the whole model with one more effect.
    pub(super) fn trial(
        &self,
        Ranked { entry, score, .. }: Ranked,
        progress: Progress,
    ) -> Result<Trial, Error> {
        let gain = score.gain;
        let start = self.start(&self.point, score)?;
        let (fitted, options) = self.fitted(start, entry, progress)?;
        let trial = self.judged(&self.point, entry, fitted, options, gain, progress)?;
        if entry.stage != Stage::Plays || trial.deviance <= trial.chance {
            return Ok(trial);
        }
        // what the same fit gains without the effect is not the effect's
        let (without, _) = self.fitted(self.point.clone(), entry, progress)?;
        let gained = self.cost / without.linearization.cost.max(f64::MIN_POSITIVE);
        let deviance = trial.deviance - self.prepared.values() * gained.ln().max(0.0);
        Ok(Trial { deviance, ..trial })
    }

    /// A point with `entry` as its newest effect, fitted jointly, and what was free at last.
    pub(super) fn fitted(
        &self,
        start: Point,
        entry: &Entry,
        progress: Progress,
    ) -> Result<(Fitted, FitOptions), Error> {
        /// Times that a fit goes on which is still on its way.
        const MORE: usize = 3;
        let record = &self.prepared.record;
        let mut options = self.options.clone();
        let mut fitted = fit(start, record, &options, entry.name, progress)?;
        if entry.stage == Stage::Plays {
            // the grid has bent to what the plays lacked
            options = self.moving_grids();
            fitted = fit(fitted.point, record, &options, entry.name, progress)?;
        }
        for _ in 0..MORE {
            if !is_on_its_way(&fitted) {
                break;
            }
            fitted = fit(fitted.point, record, &options, entry.name, progress)?;
        }
        Ok((fitted, options))
    }

    /// Whether it is the input that makes the lags beside G explain what they do: those that begin in motion
    /// also decay from wherever they began, and that is a function of time.
    fn is_driven(&self, without: &Point, with: &Point) -> Result<bool, Error> {
        /// Part of the squares without the lags that must come back when nothing drives them.
        const STILL: f64 = 0.5;
        let is_beside = |own: &Section| own.beside.is_some();
        let moves = with.pasts.iter().any(|past| past.moving);
        if !moves || !with.dynamics.sections.iter().any(is_beside) {
            return Ok(true);
        }
        let mut undriven = with.clone();
        let beside = undriven.dynamics.sections.iter_mut().filter(|own| is_beside(own));
        beside.for_each(|own| own.b.fill(0.0));
        Ok(self.training_squares(&undriven)? > STILL * self.training_squares(without)?)
    }

    /// A point with one more effect: as the score test suggests it, or without effect yet where that is
    /// beyond what is linear or sensible.
    pub(super) fn start(&self, base: &Point, score: Score) -> Result<Point, Error> {
        /// The start is worse than `base` by this factor of the squares.
        const BEYOND: f64 = 10.0;
        /// The same where plays go around with the output: a start that is worse than none leads elsewhere.
        const BEYOND_PLAYS: f64 = 1.0;
        let start = base.with_effect(score.start.clone());
        let Some(zero) = score.zero else { return Ok(start) };
        let is_sensible = score.start.block().is_none_or(|block| {
            let mut limits = block.values().into_iter().zip(block.bounds());
            limits.all(|(value, (low, high))| low <= value && value <= high)
        });
        let loops = score.start.place().closed_loops().map_or(&[][..], ClosedLoops::loops);
        let has_plays = loops.iter().any(|inner| inner.law.stops() > 0);
        let beyond = if has_plays { BEYOND_PLAYS } else { BEYOND };
        let is_near = self.training_squares(&start)? <= beyond * self.training_squares(base)?;
        Ok(if is_sensible && is_near { start } else { base.with_effect(zero) })
    }

    /// Whether it is more of an effect that the input drives and that the model has already: no new name.
    pub(super) fn is_named(&self, entry: &Entry) -> bool {
        entry.driven && self.point.effects.iter().any(|effect| effect.name() == entry.name)
    }

    /// Whether every effect has values that a thing could have.
    pub(super) fn is_plausible(&self, point: &Point) -> bool {
        let record = &self.prepared.record;
        let longest = record.experiments().iter().map(|e| e.input.nrows()).max();
        let duration = longest.unwrap_or(0) as f64 / record.rate();
        let blocks = point.blocks();
        blocks.iter().filter_map(Effect::block).all(|block| block.is_plausible(duration))
    }

    /// What a fit brought over the present model; `without` is what the effect was added to.
    pub(super) fn judged(
        &self,
        without: &Point,
        entry: &'static Entry,
        fitted: Fitted,
        options: FitOptions,
        promised: f64,
        progress: Progress,
    ) -> Result<Trial, Error> {
        let (cost, values) = (fitted.linearization.cost, self.prepared.values());
        let point = fitted.point.clone();
        let length = |point: &Point| Table::new(point, self.options.freedom).len;
        let added = length(&point).saturating_sub(length(&self.point));
        /// Candidates that a round looks at: the best of so many must be better than one.
        const LOOKS: f64 = 150.0;
        let deviance = values * (self.cost / cost.max(f64::MIN_POSITIVE)).ln();
        let white = added.max(1) as f64 * values.ln() + 2.0 * LOOKS.ln();
        /// What no colour makes chance of.
        const BEYOND_COLOUR: f64 = 50.0;
        let is_long = representatives(&point, &self.prepared.record, length(&point)).is_some();
        // more of what a long record has named needs no weight, and its held-out blocks see through colour
        let is_named = is_long && self.is_named(entry);
        let is_certain = is_named || is_long && deviance > BEYOND_COLOUR * white;
        let mut chance = if is_named { white } else { white.max(LEAST * values) };
        if deviance > chance && !is_certain {
            let refined = Refined { fitted, options, outliers: 0, robust: false };
            let uncertainty = refined.uncertainty(&self.prepared.record, progress)?;
            let colour = uncertainty.used / uncertainty.estimated.max(1) as f64;
            chance = chance.max(colour * white);
        }
        let held_out = self.held_out(&point)?;
        let is_driven = self.is_driven(without, &point)?;
        Ok(Trial { entry, point, cost, deviance, chance, held_out, promised, is_driven })
    }

    /// Sum of squares of what the training scores.
    pub(super) fn training_squares(&self, point: &Point) -> Result<f64, Error> {
        Ok(self.squares(point, &self.prepared.record)?.iter().sum())
    }

    /// Sum of squares of every held-out block.
    pub(super) fn held_out(&self, point: &Point) -> Result<Vec<f64>, Error> {
        self.squares(point, &self.test)
    }

    /// Sum of squares of every run that `scored` scores.
    fn squares(&self, point: &Point, scored: &Record) -> Result<Vec<f64>, Error> {
        // run over the training record, whose starts were fitted
        let residuals = point.residuals(&self.prepared.record)?;
        let weights = &self.options.loss.scales;
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

    pub(super) fn reject(&self, trial: &Trial, taken: Option<&Trial>, before: &[f64]) -> Rejected {
        let holdout_rms = self.holdout_rms(&trial.held_out);
        let (mut why, mut confounded_with) = (String::new(), Vec::new());
        match taken {
            _ if !trial.is_driven => {
                why.push_str("is a decay here, which the input does not drive");
            }
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
}

/// Whether the last steps of a fit that had no more were long ones.
fn is_on_its_way(fitted: &Fitted) -> bool {
    const STEPS: usize = 4;
    /// Of the squares, in so many steps.
    const MUCH: f64 = 0.1;
    let history = &fitted.history;
    let before = history.len().checked_sub(STEPS + 1).map(|place| history[place]);
    fitted.status == Status::Limit
        && before.is_some_and(|before| fitted.linearization.cost < (1.0 - MUCH) * before)
}

/// Whether what is held out has become smaller by more than chance: in the mean of the blocks, or in
/// some blocks (those in which the effect shows) and hardly worse in any other.
pub(super) fn is_confirmed(before: &[f64], after: &[f64]) -> bool {
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
