//! The state of a search: the model so far, its squares, and what was added to it.
//!
//! Squares are weighted sums over the scored samples k of residuals e (samples, outputs), with the weights w_o that
//! bring outputs of different units to one scale:
//!
//! ```text
//! J = sum_o w_o^2 sum_k e_o(k)^2
//! ```
//!
//! Where the noise has a memory that the search knows, e_o(k) is what its past does not predict (see
//! [`coloured`](super::coloured)).
//!
//! The training squares score what is not held out, with the initial states that were fitted there. The held-out
//! squares come from the same free run over the whole record, block by block, so that no initial state has to be found
//! for a block. The squares that noise alone would leave are `K sum_o w_o^2 s_o^2`, with K scored samples and the noise
//! floor s_o of each output.

use super::outside::integrates;
use super::repair::{everything, repaired};
use super::score::Score;
use super::setup::SearchSetup;
use super::surpassing::Surpassing;
use crate::chain::point::Point;
use crate::effects::{Effect, Entry};
use crate::fit::joint::Refined;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::problem::scored;
use crate::identify::NoiseFloor;
use crate::progress::Progress;
use crate::uncertainty::outliers;
use crate::{Error, Record};
use nalgebra::Complex;
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// What a fit with one more effect brought.
#[derive(Clone)]
pub(super) struct Trial {
    /// The effect.
    pub entry: &'static Entry,
    /// The model with it.
    pub point: Point,
    /// Its training squares.
    pub cost: f64,
    /// `N ln(squares before / squares after)`, less what the same fit gains without the effect where more is free
    /// than in the fit before.
    pub deviance: f64,
    /// The significance threshold of the deviance.
    pub threshold: f64,
    /// Squares of what is held out, block by block.
    pub held_out: Vec<f64>,
    /// Root mean square errors on the training data and on what is held out.
    pub rms: [f64; 2],
    /// The part of the residual's squares that the score test promised.
    pub promised: f64,
    /// Whether the input makes it explain what it does, where it is an effect that the input drives.
    pub is_driven: bool,
    /// Whether its fit began far from the present model.
    pub is_far: bool,
    /// Other candidates of the effect that the fit may begin at.
    pub others: Vec<Score>,
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
    /// How probable it is that it predicts better than the others of its round that would be accepted; `None` where it would
    /// not be accepted, or nothing else was.
    pub probability: Option<f64>,
}

/// An effect that was added.
#[derive(Clone)]
pub(super) struct Addition {
    /// What its fit brought.
    pub trial: Trial,
    /// What was tried in the same round.
    pub others: Vec<Rejected>,
    /// How probable it is that it predicts better than those of the others that would be accepted; `None` where there are none.
    pub probability: Option<f64>,
    /// Earlier effects that this one made superfluous.
    pub dropped: Vec<&'static str>,
}

impl Addition {
    /// A trial that is added whatever else was tried.
    pub(super) fn alone(trial: Trial) -> Self {
        Self { trial, others: Vec::new(), probability: None, dropped: Vec::new() }
    }
}

/// The model before slow poles were taken out of its G.
#[derive(Clone)]
pub(super) struct WithLags {
    pub point: Point,
    /// These poles.
    pub lags: Vec<Complex<f64>>,
}

/// The state of a search.
#[derive(Clone)]
pub(super) struct SearchState<'a> {
    /// What never changes.
    pub setup: &'a SearchSetup,
    /// What fits start from; wrong samples of its record are replaced.
    pub prepared: Prepared<'a>,
    /// The model so far.
    pub point: Point,
    /// Its training squares.
    pub cost: f64,
    /// Whether the grids were refined since the latest effect.
    pub is_rich: bool,
    /// The model before slow poles were taken out, while it is asked which effect does what they did.
    pub with_lags: Option<WithLags>,
    /// Names of the effects beside which that was asked last, and the number of the poles.
    pub lags_asked: Option<(Vec<&'static str>, usize)>,
    /// What was added.
    pub additions: Vec<Addition>,
    /// The models before each addition. Emptied when poles are taken out of G, because these models still have them.
    pub left: Vec<Point>,
    /// Isolated wrong samples, `[experiment][output]`.
    pub wrong: Vec<Vec<Vec<usize>>>,
    /// What was tried in the last round and not taken.
    pub last: Vec<Rejected>,
    /// The trial of the last round that takes a large part of the training squares, where nothing was taken and the held-out blocks did
    /// not confirm it.
    pub unconfirmed: Option<Trial>,
    /// What was taken and did not pass the last examination.
    pub refused: Vec<Rejected>,
    /// The errors with effects that were refused for what they follow.
    pub surpassing: Surpassing,
    /// Names of the effects beside which the balance of forces was asked last.
    pub balanced_beside: Option<Vec<&'static str>>,
    /// Names of the effects beside which a sliding mass was asked for last.
    pub slid_beside: Option<Vec<&'static str>>,
    /// Effects whose fits from the balance of forces ended far above the model.
    pub out_of_reach: BTreeSet<&'static str>,
    /// Whether the output integrates the input, once that was asked.
    integrates: OnceLock<bool>,
}

impl<'a> SearchState<'a> {
    /// From a refined base model.
    pub(super) fn new(setup: &'a SearchSetup, prepared: Prepared<'a>, refined: &Refined) -> Self {
        Self {
            setup,
            prepared,
            point: refined.fitted.point.clone(),
            cost: refined.fitted.linearization.cost,
            is_rich: false,
            with_lags: None,
            lags_asked: None,
            additions: Vec::new(),
            left: Vec::new(),
            wrong: Vec::new(),
            last: Vec::new(),
            unconfirmed: None,
            refused: Vec::new(),
            surpassing: Surpassing::default(),
            balanced_beside: None,
            slid_beside: None,
            out_of_reach: BTreeSet::new(),
            integrates: OnceLock::new(),
        }
    }

    /// The same state under another setup of the same record.
    pub(super) fn under(&self, setup: &'a SearchSetup) -> Result<Self, Error> {
        let mut same = Self {
            setup,
            prepared: self.prepared.clone(),
            point: self.point.clone(),
            cost: self.cost,
            is_rich: false,
            with_lags: None,
            lags_asked: None,
            additions: self.additions.clone(),
            left: self.left.clone(),
            wrong: self.wrong.clone(),
            last: self.last.clone(),
            unconfirmed: None,
            refused: self.refused.clone(),
            // errors under another loss are not comparable
            surpassing: Surpassing::default(),
            balanced_beside: None,
            slid_beside: None,
            out_of_reach: self.out_of_reach.clone(),
            integrates: self.integrates.clone(),
        };
        same.cost = same.training_squares(&same.point)?;
        Ok(same)
    }

    /// Fits a point to the training data.
    pub(super) fn fit(
        &self,
        point: Point,
        options: &FitOptions,
        stage: &str,
        progress: Progress,
    ) -> Result<Fitted, Error> {
        fit(point, &self.prepared.record, options, stage, progress)
    }

    /// Whether the model has an effect.
    pub(super) fn has(&self, entry: &Entry) -> bool {
        self.point.effects.iter().any(|effect| effect.name() == entry.name)
    }

    /// Whether it is more of an effect that the input drives and that the model has already: no new name.
    pub(super) fn is_more(&self, entry: &Entry) -> bool {
        entry.driven && self.has(entry)
    }

    /// Whether every effect of a point has parameters that a machine can have.
    pub(super) fn is_plausible(&self, point: &Point) -> bool {
        let (blocks, duration) = (point.blocks(), self.duration());
        blocks.iter().filter_map(Effect::block).all(|block| block.is_plausible(duration))
    }

    /// The longest experiment in seconds.
    pub(super) fn duration(&self) -> f64 {
        let record = &self.prepared.record;
        record.longest() as f64 / record.rate()
    }

    /// Training squares of a point.
    pub(super) fn training_squares(&self, point: &Point) -> Result<f64, Error> {
        Ok(self.squares(point, &self.prepared.record)?.iter().sum())
    }

    /// Squares of every held-out block.
    pub(super) fn held_out(&self, point: &Point) -> Result<Vec<f64>, Error> {
        self.squares(point, &self.setup.test)
    }

    /// Squares of the difference of two models' outputs in the held-out blocks.
    pub(super) fn held_out_change(&self, one: &Point, other: &Point) -> Result<f64, Error> {
        let record = &self.prepared.record;
        let mut difference = one.residuals(record)?;
        difference.iter_mut().zip(other.residuals(record)?).for_each(|(own, other)| *own -= other);
        Ok(self.setup.options.loss.cost(scored(&difference, &self.setup.test)))
    }

    /// Squares of every run that `record` scores.
    fn squares(&self, point: &Point, record: &Record) -> Result<Vec<f64>, Error> {
        // run over the training record, whose initial states were fitted
        let residuals = point.residuals(&self.prepared.record)?;
        let loss = &self.setup.options.loss;
        Ok(scored(&residuals, record).map(|run| loss.cost(std::iter::once(run))).collect())
    }

    /// Root mean square errors of a point on the training data and on what is held out, with the weights of the outputs
    /// and whatever memory the noise has.
    pub(super) fn rms(&self, point: &Point) -> Result<[f64; 2], Error> {
        let residuals = point.residuals(&self.prepared.record)?;
        let loss = self.setup.options.loss.of_white_noise();
        let mean = |record: &Record| {
            let values = record.scored() * record.outputs().len();
            loss.cost(scored(&residuals, record)) / values.max(1) as f64
        };
        Ok([&self.prepared.record, &self.setup.test].map(|record| mean(record).sqrt()))
    }

    /// Whether the output integrates the input.
    pub(super) fn integrates(&self) -> Result<bool, Error> {
        if let Some(known) = self.integrates.get() {
            return Ok(*known);
        }
        let policy = &self.setup.policy.outside;
        let found = !self.forgets()? && integrates(&self.prepared.record, policy)?;
        Ok(*self.integrates.get_or_init(|| found))
    }

    /// Whether the error of a point is mostly a sum of forces that it lacks: the output integrates the input, and the point is far from
    /// the noise.
    pub(super) fn adds_up_forces(&self, point: &Point) -> Result<bool, Error> {
        Ok(self.integrates()? && !self.is_near(point)?)
    }

    /// Whether the model is near the noise, and its dynamics forget within a part of the record: then the output does not integrate,
    /// even if a hysteresis resembles an integral of the input.
    fn forgets(&self) -> Result<bool, Error> {
        let policy = &self.setup.policy.outside;
        let samples = policy.forgotten * self.prepared.record.longest() as f64;
        let slowest =
            self.point.dynamics.poles().iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        let is_near = self.cost <= policy.near_noise.powi(2) * self.noise_squares()?;
        Ok(is_near && slowest < (-1.0 / samples).exp())
    }

    /// The training squares that noise alone would leave.
    pub(super) fn noise_squares(&self) -> Result<f64, Error> {
        let record = &self.prepared.record;
        let loss = &self.setup.options.loss;
        let errors = loss.all_errors(&self.point.residuals(record)?);
        let noise = NoiseFloor::estimate(record, &errors);
        let squares =
            noise.rms.iter().zip(&loss.scales).map(|(rms, weight)| (rms * weight).powi(2));
        Ok(squares.sum::<f64>() * record.scored() as f64)
    }

    /// Whether a model is near the noise on what is held out.
    pub(super) fn is_near(&self, point: &Point) -> Result<bool, Error> {
        let test = self.setup.test.scored().max(1) as f64;
        let trained = self.prepared.record.scored().max(1) as f64;
        let noise = self.noise_squares()? / trained;
        let most = self.setup.policy.examination.near.powi(2) * noise;
        Ok(self.held_out(point)?.iter().sum::<f64>() / test <= most)
    }

    /// Whether a fit without a part of the model leaves hardly more of the training and of the held-out squares.
    pub(super) fn explains_nearly_as_much(&self, fitted: &Fitted) -> Result<bool, Error> {
        let most = 1.0 + self.setup.policy.revision.negligible;
        let held_out = |point| Ok::<f64, Error>(self.held_out(point)?.iter().sum());
        Ok(fitted.linearization.cost <= most * self.cost
            && held_out(&fitted.point)? <= most * held_out(&self.point)?)
    }

    /// Takes the model of a trial, and remembers what led to it.
    pub(super) fn add(&mut self, addition: Addition) -> Result<(), Error> {
        self.left.push(std::mem::replace(&mut self.point, addition.trial.point.clone()));
        self.additions.push(addition);
        self.repair()
    }

    /// Takes the best model without one of its effects.
    pub(super) fn remove(&mut self, place: usize, progress: Progress) -> Result<(), Error> {
        (self.point, self.cost) = self.best_without(place, progress)?;
        Ok(())
    }

    /// The best model without one of its effects, and its squares: fitted from where the effect left the rest, which may be
    /// far from where the rest is alone, or one that the search had before with the same effects.
    pub(super) fn best_without(
        &self,
        place: usize,
        progress: Progress,
    ) -> Result<(Point, f64), Error> {
        let without = self.point.without_effect(place);
        let names = |point: &Point| point.effects.iter().map(Effect::name).collect::<BTreeSet<_>>();
        let wanted = names(&without);
        let fitted = self.fit(without, &self.setup.options, "without it", progress)?;
        let mut best = (fitted.point, fitted.linearization.cost);
        for known in self.left.iter().filter(|known| names(known) == wanted) {
            let cost = self.training_squares(known)?;
            if cost < best.1 {
                best = (known.clone(), cost);
            }
        }
        Ok(best)
    }

    /// Finds isolated outliers of the residual and replaces them, also where the record is held out: a wrong sample
    /// is no evidence on a model.
    ///
    /// Each time from what was measured: samples that an effect explains are no longer outliers once it is added.
    pub(super) fn repair(&mut self) -> Result<(), Error> {
        let residuals = self.point.residuals(&self.setup.measured)?;
        self.wrong = outliers::places(&residuals, &everything(&self.setup.measured)?, 0);
        self.prepared.record = repaired(&self.setup.measured, &residuals, &self.wrong)?;
        // what the next fits are compared with
        self.cost = self.training_squares(&self.point)?;
        Ok(())
    }
}
