//! The comparison of structures by an information criterion.
//!
//! A candidate of p estimated parameters leaves a residual of root mean square e over N output values. BIC for a white
//! residual is `N ln e^2 + p ln N`. An autocorrelated residual holds less information: a parameter then takes the part of
//! c samples of white noise from it, with `c = tr(H^-1 M) / (p sigma^2)`, H the Gram matrix of the sensitivities, M the
//! score's covariance and sigma^2 the residual's variance (K. Takeuchi, 1976; c = 1 for white noise). The criterion is
//!
//! ```text
//! N ln e^2 + c p ln N
//! ```
//!
//! with one c for all candidates, that of the smallest residual, which is closest to the noise itself.
//!
//! One c is too much for parameters of fast dynamics in slow noise, which hardly hides them. Of the candidates with the same
//! hysteresis as the best one and no larger residual, the one is therefore taken with the least `N ln w^2 + p ln N`, w the
//! root mean square innovation of the residual's own autoregression ([`NoiseModel`]). The numbers of plays are not chosen
//! so: an autoregression follows the slow residual that a coarse hysteresis leaves.

use crate::Error;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::longest_lag;
use crate::fit::RefineOptions;
use crate::fit::joint::{Refined, joint};
use crate::fit::line_modes::{is_same, line_modes};
use crate::fit::memory::Memory;
use crate::fit::minimize::Fitted;
use crate::fit::preparation::Prepared;
use crate::fit::smooth::determined_by_prior;
use crate::identify::identification::Candidate;
use crate::identify::settings::StructurePolicy;
use crate::progress::{Progress, as_trial, reached};
use crate::uncertainty::noise_model::NoiseModel;
use nalgebra::Complex;
use std::f64::consts::PI;

/// What a candidate became.
struct Tried {
    refined: Refined,
    /// Samples of white noise that a parameter takes from its residual.
    samples: f64,
    /// `N ln e^2 + c p ln N`, whether it is usable or not.
    criterion: f64,
    /// `N ln w^2 + p ln N`, w the innovations of its residual.
    whitened: f64,
    /// Poles that rule it out: they follow creep, a disturbance or a line of the mains instead of the input.
    unwanted: Vec<Complex<f64>>,
}

impl Tried {
    fn is_usable(&self) -> bool {
        self.unwanted.is_empty()
    }

    fn point(&self) -> &Point {
        &self.refined.fitted.point
    }
}

/// `N ln e^2 + c p ln N` of a candidate over so many values N, c the samples that a parameter takes.
pub(super) fn criterion(candidate: &Candidate, samples: f64, values: f64) -> f64 {
    let deviance = 2.0 * values * candidate.rms.max(f64::MIN_POSITIVE).ln();
    deviance + samples * candidate.parameters as f64 * values.ln()
}

/// Refines structures and compares them.
pub(super) struct Comparison<'a> {
    pub prepared: &'a Prepared<'a>,
    pub policy: &'a StructurePolicy,
    options: RefineOptions,
    /// Whether poles that are slower than a mechanical stage's dynamics rule a candidate out: they follow
    /// creep and disturbances.
    fast: bool,
    candidates: Vec<Candidate>,
    /// What each candidate became.
    refined: Vec<Tried>,
    /// Why candidates were dropped whose computation failed, and whether the last one was.
    failures: Vec<Error>,
    has_failed: bool,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(
        prepared: &'a Prepared<'a>,
        policy: &'a StructurePolicy,
        options: RefineOptions,
        fast: bool,
    ) -> Self {
        Self {
            prepared,
            policy,
            options,
            fast,
            candidates: Vec::new(),
            refined: Vec::new(),
            failures: Vec::new(),
            has_failed: false,
        }
    }

    /// Refines a point; says whether it is better than all before. A point whose computation fails is dropped.
    pub(super) fn offer(&mut self, point: Point, progress: Progress) -> Result<bool, Error> {
        self.has_failed = false;
        let trial = described(&point);
        let offered = as_trial(progress, ("structures", &trial), (0, 1), |progress| {
            self.refine(point, progress)
        });
        Ok(Error::unless_interrupted(offered)?.unwrap_or_else(|error| {
            self.drop_failed(error);
            false
        }))
    }

    /// Refines a point that is no candidate.
    pub(super) fn refined(&self, point: Point, progress: Progress) -> Result<Point, Error> {
        let Self { prepared, options, fast, .. } = self;
        let refined = joint(point, prepared, options, f64::INFINITY, *fast, progress)?;
        Ok(refined.fitted.point)
    }

    /// Refines a point that is no candidate yet as long as it gains, for starts that are far from where they lead.
    pub(super) fn settled(&self, point: Point, progress: Progress) -> Result<Point, Error> {
        let Self { prepared, options, fast, policy, .. } = self;
        let (mut settled, mut last) = (point, f64::INFINITY);
        for _ in 0..policy.repeats {
            let fitted = joint(settled, prepared, options, f64::INFINITY, *fast, progress)?.fitted;
            settled = fitted.point;
            let gains = fitted.linearization.cost < (1.0 - policy.settled) * last;
            if !gains {
                break;
            }
            last = fitted.linearization.cost;
        }
        Ok(settled)
    }

    /// Drops a candidate because of its error.
    pub(super) fn drop_failed(&mut self, error: Error) {
        self.failures.push(error);
        self.has_failed = true;
    }

    /// Whether the last candidate was dropped because its computation failed.
    pub(super) fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// The first failure of a candidate.
    pub(super) fn failure(&self) -> Option<&Error> {
        self.failures.first()
    }

    fn refine(&mut self, point: Point, progress: Progress) -> Result<bool, Error> {
        let hopeless = self.hopeless(&point);
        let refined = joint(point, self.prepared, &self.options, hopeless, self.fast, progress)?;
        // a model of it must exist
        refined.fitted.point.dynamics.to_state_space()?;
        let uncertainty = refined.uncertainty(&self.prepared.record, progress)?;
        let Fitted { point, table, linearization, .. } = &refined.fitted;
        let bounds = point.bounds(table, &self.prepared.record, refined.options.freedom);
        let of_prior = determined_by_prior(&refined.fitted, &bounds).round() as usize;
        let parameters = uncertainty.estimated - of_prior.min(uncertainty.estimated);
        let cost = linearization.cost - point.penalty(table);
        let rms = (cost / self.prepared.values()).sqrt();
        reached(progress, "uncertainty", rms)?;
        let point = &refined.fitted.point;
        self.candidates.push(Candidate {
            delay: point.dynamics.delay,
            order: point.dynamics.order(),
            plays: point.channels[0].half_widths.len(),
            deadzones: point.channels[0].thresholds.len() - 1,
            rms,
            parameters,
            used: 0.0,
            criterion: 0.0,
        });
        let samples = (uncertainty.used / parameters.max(1) as f64).max(1.0);
        let unwanted = self.unwanted(point)?;
        let whitened = self.whitened(point, parameters)?;
        self.refined.push(Tried { refined, samples, criterion: 0.0, whitened, unwanted });
        self.compare();
        let last = self.candidates.len() - 1;
        Ok(self.chosen() == Some(last) && self.refined[last].is_usable())
    }

    /// The cost with which a point is given up after a few steps: where fewer parameters do not make up for it.
    fn hopeless(&self, point: &Point) -> f64 {
        let Some(best) = self.chosen().filter(|&place| self.refined[place].is_usable()) else {
            return f64::INFINITY;
        };
        let count = |point: &Point| {
            Table::new(point, self.refined[best].refined.options.freedom).len as f64
        };
        let fewer = (count(self.refined[best].point()) - count(point)).max(0.0);
        let values = self.prepared.values();
        let saved = self.samples() * fewer * values.ln() / values;
        self.policy.hopeless * saved.exp() * self.refined[best].refined.fitted.linearization.cost
    }

    /// Samples of white noise that a parameter takes from the smallest residual.
    fn samples(&self) -> f64 {
        self.closest().map_or(1.0, |place| self.refined[place].samples)
    }

    /// Whether the best candidate has so many parameters that much simpler ones may be better.
    pub(super) fn is_crowded(&self) -> bool {
        let parameters = self.chosen().map(|place| self.candidates[place].parameters as f64);
        parameters.is_some_and(|count| self.policy.crowded * count > self.prepared.values())
    }

    /// Works the criteria out, with the autocorrelation of the smallest residual.
    fn compare(&mut self) {
        let values = self.prepared.values();
        let samples = self.samples();
        for (candidate, tried) in self.candidates.iter_mut().zip(&mut self.refined) {
            candidate.used = samples * candidate.parameters as f64;
            tried.criterion = criterion(candidate, samples, values);
            candidate.criterion = if tried.is_usable() { tried.criterion } else { f64::INFINITY };
        }
    }

    /// Whether slow poles rule out all candidates, and G of the best one is flat beyond them; or none could be computed.
    pub(super) fn shows_nothing_fast(&self) -> bool {
        let StructurePolicy { frequencies, flat, .. } = *self.policy;
        if self.has_usable() {
            return false;
        }
        let Some(best) = self.closest() else { return !self.failures.is_empty() };
        let dynamics = &self.refined[best].point().dynamics;
        // twice the corner of the longest lag that is dynamics
        let lowest = (2.0 / longest_lag(self.prepared.record.rate())).min(1.0);
        let frequency = |i: usize| lowest * (PI / lowest).powf(i as f64 / frequencies as f64);
        let gains = (0..frequencies).map(|i| dynamics.response(frequency(i)).norm());
        let (low, high) = gains
            .fold((f64::INFINITY, 0.0_f64), |(low, high), gain| (low.min(gain), high.max(gain)));
        high < flat * low
    }

    /// The criterion of the last candidate.
    pub(super) fn last_criterion(&self) -> f64 {
        self.candidates.last().map_or(f64::INFINITY, |candidate| candidate.criterion)
    }

    /// Whether any candidate is usable.
    pub(super) fn has_usable(&self) -> bool {
        self.refined.iter().any(Tried::is_usable)
    }

    /// Withdraws the last candidate where a pole of it is slower than `slowest`.
    pub(super) fn withdraw_slow(&mut self, slowest: f64) {
        let is_slow =
            |tried: &Tried| tried.point().dynamics.poles().iter().any(|pole| pole.norm() > slowest);
        if self.refined.last().is_some_and(is_slow) {
            self.refined.pop();
            self.candidates.pop();
            self.compare();
        }
    }

    /// The best fit of all without the poles that rule it out, where there is one.
    pub(super) fn without_unwanted_poles(&self) -> Result<Option<Point>, Error> {
        let Some(place) = self.closest() else { return Ok(None) };
        let Tried { unwanted, .. } = &self.refined[place];
        self.refined[place].point().without(|pole| unwanted.iter().any(|own| is_same(own, pole)))
    }

    /// `N ln w^2 + p ln N` over all outputs.
    fn whitened(&self, point: &Point, parameters: usize) -> Result<f64, Error> {
        let record = &self.prepared.record;
        let innovations = NoiseModel::of(&point.residuals(record)?, record).innovations;
        let logarithms = innovations.diagonal().map(|square| square.max(f64::MIN_POSITIVE).ln());
        let penalty = parameters as f64 * self.prepared.values().ln();
        Ok(record.scored() as f64 * logarithms.sum() + penalty)
    }

    /// The poles that rule a point out.
    fn unwanted(&self, point: &Point) -> Result<Vec<Complex<f64>>, Error> {
        let mut unwanted = line_modes(point, &self.prepared.record)?;
        if self.fast {
            let memory = Memory::of(&self.prepared.record);
            unwanted.extend(memory.exceeded_by(point, self.prepared)?);
        }
        Ok(unwanted)
    }

    /// The place of the candidate with the least residual, usable or not.
    fn closest(&self) -> Option<usize> {
        let rms = |i: usize| self.candidates[i].rms;
        (0..self.candidates.len()).min_by(|&i, &j| rms(i).total_cmp(&rms(j)))
    }

    /// The place of the best candidate, usable if any is.
    fn chosen(&self) -> Option<usize> {
        let places = 0..self.candidates.len();
        let has_usable = self.has_usable();
        let competes = |&place: &usize| !has_usable || self.refined[place].is_usable();
        let criterion = |i: usize| self.refined[i].criterion;
        let best = places
            .clone()
            .filter(competes)
            .min_by(|&i, &j| criterion(i).total_cmp(&criterion(j)))?;
        let own = &self.candidates[best];
        let is_rival = |&place: &usize| {
            let other = &self.candidates[place];
            let is_alike = (other.plays, other.deadzones) == (own.plays, own.deadzones);
            self.refined[place].is_usable() && is_alike && other.rms <= own.rms
        };
        let whitened = |place: usize| self.refined[place].whitened;
        places.filter(is_rival).min_by(|&i, &j| whitened(i).total_cmp(&whitened(j))).or(Some(best))
    }

    /// The refined point of the best candidate.
    pub(super) fn best(&self) -> Option<&Point> {
        self.chosen().map(|place| self.refined[place].point())
    }

    /// The best candidate's place and what it became, and all candidates.
    pub(super) fn finish(mut self) -> Option<(usize, Refined, Vec<Candidate>)> {
        let chosen = self.chosen()?;
        Some((chosen, self.refined.swap_remove(chosen).refined, self.candidates))
    }
}

/// A structure in words, for the progress.
fn described(point: &Point) -> String {
    let (dynamics, channel) = (&point.dynamics, &point.channels[0]);
    let (plays, zones) = (channel.half_widths.len(), channel.thresholds.len() - 1);
    let delay =
        if dynamics.delay > 0 { format!(", delay {}", dynamics.delay) } else { String::new() };
    format!("order {}{delay}, {plays} plays, {zones} deadzones", dynamics.order())
}
