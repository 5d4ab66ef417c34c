//! The structure from the data: how many plays and deadzones, which order and delay.

use crate::Progress;
use crate::chain::bounds::range;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::effects::longest_lag;
use crate::fit::Grid;
use crate::fit::memory::Memory;
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::fit::refine::{RefineOptions, Refined, joint, settings};
use crate::identify::identification::IdentifyOptions;
use crate::linear::Sections;
use crate::{Error, Record};
use std::f64::consts::PI;

/// One structure that was refined and compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Dead time of the linear part, in samples.
    pub delay: usize,
    /// Order of the linear part without its dead time.
    pub order: usize,
    /// Plays of each input, the linear term included.
    pub plays: usize,
    /// Deadzones of each input besides the identity.
    pub deadzones: usize,
    /// Root mean square residual on the training data.
    pub rms: f64,
    /// Parameters that were estimated.
    pub parameters: usize,
    /// The same counted in samples of white noise: the slower the residual of the best fit, the more
    /// each parameter takes from it (Takeuchi's `tr(H^-1 M) / variance` per parameter).
    pub used: f64,
    /// `N ln(rms^2) + used ln N` over N output values: Schwarz's criterion for a coloured residual. The
    /// least is chosen.
    pub criterion: f64,
}

/// Compares structures by the information criterion.
pub(crate) struct Search<'a> {
    prepared: &'a Prepared<'a>,
    half_widths: Option<Grid>,
    thresholds: Option<Grid>,
    options: RefineOptions,
    pub candidates: Vec<Candidate>,
    /// What each candidate became, and how coloured its residual is.
    refined: Vec<(Refined, f64)>,
    /// Whether poles that are slower than a mechanical stage's dynamics rule a candidate out: they follow
    /// creep and disturbances.
    pub fast: bool,
}

impl<'a> Search<'a> {
    /// What the user gives by value is not moved.
    pub(crate) fn new(prepared: &'a Prepared<'a>, options: &IdentifyOptions) -> Self {
        let given = |grid: &Option<Grid>| matches!(grid, Some(Grid::Values(_)));
        Self {
            prepared,
            half_widths: options.half_widths.clone(),
            thresholds: options.thresholds.clone(),
            options: RefineOptions {
                thresholds: !given(&options.thresholds),
                half_widths: !given(&options.half_widths),
                robust: options.robust,
                offset_knots: options.offset_knots,
            },
            candidates: Vec::new(),
            refined: Vec::new(),
            fast: false,
        }
    }

    /// Numbers of plays and deadzones, from many to few, as far as they are not given.
    fn ladder(&self) -> Vec<(Grid, Grid)> {
        /// The first is what the rounds before used; the last is the linear model.
        const LADDER: [(usize, usize); 6] = [(24, 10), (16, 7), (12, 5), (8, 4), (6, 2), (1, 0)];
        let choose = |given: &Option<Grid>, count| given.clone().unwrap_or(Grid::Count(count));
        let mut ladder: Vec<_> = LADDER
            .iter()
            .map(|&(n, m)| (choose(&self.half_widths, n), choose(&self.thresholds, m)))
            .collect();
        ladder.dedup();
        ladder
    }

    /// Climbs down the ladder before the dynamics of `seed` until two steps have gained nothing.
    pub(crate) fn climb(&mut self, seed: &Point, progress: Progress) -> Result<(), Error> {
        let (mut worse, mut least) = (0, f64::INFINITY);
        for (half_widths, thresholds) in self.ladder() {
            let point = self.placed(seed, &half_widths, &thresholds, progress)?;
            self.offer(point, progress)?;
            let criterion = self.candidates[self.candidates.len() - 1].criterion;
            worse = if criterion < least { 0 } else { worse + 1 };
            least = least.min(criterion);
            if worse == 2 {
                break;
            }
        }
        Ok(())
    }

    /// Tries orders below the best one, then above, until they gain nothing. `dynamics` realizes G of
    /// an order from a record whose input is v.
    pub(crate) fn orders(
        &mut self,
        dynamics: &mut dyn FnMut(&Record, usize) -> Result<Sections, Error>,
        progress: Progress,
    ) -> Result<(), Error> {
        /// Beyond, one state more or less says nothing.
        const LARGEST: usize = 8;
        let Some(point) = self.best().cloned() else { return Ok(()) };
        let order = point.dynamics.order();
        if order > LARGEST {
            return Ok(());
        }
        // Where fewer states do, more will not.
        if !self.walk(&point, (1..order).rev(), dynamics, progress)? {
            self.walk(&point, order + 1..=order + 1, dynamics, progress)?;
        }
        Ok(())
    }

    /// Tries orders behind the hysteresis of `point` until two have gained nothing; says whether any gained.
    fn walk(
        &mut self,
        point: &Point,
        orders: impl Iterator<Item = usize>,
        dynamics: &mut dyn FnMut(&Record, usize) -> Result<Sections, Error>,
        progress: Progress,
    ) -> Result<bool, Error> {
        let driven = self.prepared.driven(point)?;
        let (mut gained, mut missed) = (false, 0);
        for order in orders {
            let mut other = point.clone();
            match dynamics(&driven, order) {
                Ok(sections) => other.replace_dynamics(sections),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                // no such realization
                Err(_) => break,
            }
            rescale(&mut other);
            let better = self.offer(other, progress)?;
            gained |= better;
            // with more states than the actuator has, all may ring on with a hum
            let any = self.refined.iter().any(|(refined, _)| self.is_usable(refined));
            missed = if better || !any { 0 } else { missed + 1 };
            // An odd order may be a bad one between two good ones.
            if missed == 2 {
                break;
            }
        }
        Ok(gained)
    }

    /// Tries a first-order lag behind the best hysteresis, with the same dead time and with less.
    pub(crate) fn lag(&mut self, progress: Progress) -> Result<(), Error> {
        /// A pole in the middle of where lags of a few samples have theirs.
        const POLE: f64 = 0.5;
        /// exp(-1/7): no longer memory than the longest delay. A slower lag follows drift and creep,
        /// which so few frequencies do not tell from dynamics, and fails on other records.
        const SLOWEST: f64 = 0.867;
        let Some(point) = self.best().cloned() else { return Ok(()) };
        let longest = point.dynamics.delay;
        for delay in longest.saturating_sub(2)..=longest {
            let mut lagged = point.clone();
            let mut dynamics = point.dynamics.with_lag(POLE);
            dynamics.delay = delay;
            lagged.replace_dynamics(dynamics);
            self.offer(lagged, progress)?;
            let slow = |(refined, _): &(Refined, f64)| {
                let poles = refined.fitted.point.dynamics.poles();
                poles.iter().any(|pole| pole.norm() > SLOWEST)
            };
            if self.refined.last().is_some_and(slow) {
                self.refined.pop();
                self.candidates.pop();
                self.compare();
            }
        }
        Ok(())
    }

    /// Refines a point; says whether it is better than all before.
    pub(crate) fn offer(&mut self, point: Point, progress: Progress) -> Result<bool, Error> {
        /// A candidate whose rms is a fifth larger after a few steps is given up.
        const HOPELESS: f64 = 1.44;
        let usable = self.refined.iter().filter(|(refined, _)| self.is_usable(refined));
        let costs = usable.map(|(refined, _)| refined.fitted.linearization.cost);
        let hopeless = HOPELESS * costs.fold(f64::INFINITY, f64::min);
        let refined = joint(point, self.prepared, &self.options, hopeless, self.fast, progress)?;
        let uncertainty = refined.uncertainty(&self.prepared.record, progress)?;
        let parameters = uncertainty.estimated;
        let point = &refined.fitted.point;
        self.candidates.push(Candidate {
            delay: point.dynamics.delay,
            order: point.dynamics.order(),
            plays: point.channels[0].half_widths.len(),
            deadzones: point.channels[0].thresholds.len() - 1,
            rms: (refined.fitted.linearization.cost / self.prepared.values()).sqrt(),
            parameters,
            used: 0.0,
            criterion: 0.0,
        });
        let colour = (uncertainty.used / parameters.max(1) as f64).max(1.0);
        self.refined.push((refined, colour));
        self.compare();
        Ok(self.chosen() == Some(self.candidates.len() - 1))
    }

    /// Works the criteria out, with the colour of the residual that is smallest.
    fn compare(&mut self) {
        let values = self.prepared.values();
        let colour = self.closest().map_or(1.0, |place| self.refined[place].1);
        let usable: Vec<bool> = self.refined.iter().map(|(r, _)| self.is_usable(r)).collect();
        for (candidate, usable) in self.candidates.iter_mut().zip(usable) {
            let deviance = 2.0 * values * candidate.rms.max(f64::MIN_POSITIVE).ln();
            candidate.used = colour * candidate.parameters as f64;
            let penalty = if usable { candidate.used * values.ln() } else { f64::INFINITY };
            candidate.criterion = deviance + penalty;
        }
    }

    /// Whether slow poles rule out all candidates, and G of the best one is flat beyond them.
    pub(crate) fn shows_nothing_fast(&self) -> bool {
        const FREQUENCIES: usize = 32;
        /// Largest over smallest gain.
        const FLAT: f64 = 2.0;
        if self.refined.iter().any(|(refined, _)| self.is_usable(refined)) {
            return false;
        }
        let Some(best) = self.closest() else { return false };
        let dynamics = &self.refined[best].0.fitted.point.dynamics;
        // twice the corner of the longest lag that is dynamics
        let lowest = (2.0 / longest_lag(self.prepared.record.rate())).min(1.0);
        let frequency = |i: usize| lowest * (PI / lowest).powf(i as f64 / FREQUENCIES as f64);
        let gains = (0..FREQUENCIES).map(|i| dynamics.response(frequency(i)).norm());
        let (low, high) = gains
            .fold((f64::INFINITY, 0.0_f64), |(low, high), gain| (low.min(gain), high.max(gain)));
        high < FLAT * low
    }

    /// Tries the best fit of all without the poles that rule it out: a lower order drops the weakest mode
    /// instead, which may be the stage's own resonance.
    pub(crate) fn shed(&mut self, progress: Progress) -> Result<(), Error> {
        let Some(place) = self.closest().filter(|_| self.fast) else { return Ok(()) };
        let memory = Memory::of(&self.prepared.record);
        let point = &self.refined[place].0.fitted.point;
        if let Some(point) = point.without(|pole| memory.is_exceeded_by(pole))? {
            self.offer(point, progress)?;
        }
        Ok(())
    }

    fn is_usable(&self, refined: &Refined) -> bool {
        let memory = Memory::of(&self.prepared.record);
        let poles = refined.fitted.point.dynamics.poles();
        !self.fast || !poles.iter().any(|pole| memory.is_exceeded_by(pole))
    }

    /// The place of the candidate with the least residual, usable or not.
    fn closest(&self) -> Option<usize> {
        let rms = |i: usize| self.candidates[i].rms;
        (0..self.candidates.len()).min_by(|&i, &j| rms(i).total_cmp(&rms(j)))
    }

    /// The place of the candidate with the least criterion.
    pub(crate) fn chosen(&self) -> Option<usize> {
        let criterion = |i: usize| self.candidates[i].criterion;
        (0..self.candidates.len()).min_by(|&i, &j| criterion(i).total_cmp(&criterion(j)))
    }

    /// The refined point of the best candidate.
    fn best(&self) -> Option<&Point> {
        self.chosen().map(|place| &self.refined[place].0.fitted.point)
    }

    /// The best candidate's place and what it became, and all candidates.
    pub(crate) fn finish(mut self) -> Option<(usize, Refined, Vec<Candidate>)> {
        let chosen = self.chosen()?;
        Some((chosen, self.refined.swap_remove(chosen).0, self.candidates))
    }

    /// The seed's dynamics behind a hysteresis on new grids, fitted with the poles kept.
    fn placed(
        &self,
        seed: &Point,
        half_widths: &Grid,
        thresholds: &Grid,
        progress: Progress,
    ) -> Result<Point, Error> {
        let mut point = self.prepared.point(seed.dynamics.clone());
        point.offsets.clone_from(&seed.offsets);
        for (input, channel) in point.channels.iter_mut().enumerate() {
            let (low, high) = range(&self.prepared.record, input);
            let zones = thresholds.thresholds((low, high))?;
            let plays = half_widths.half_widths(high - low)?;
            let gain: f64 = seed.channels[input].weights.iter().sum();
            *channel = Parameters::identity(channel.reading, zones, plays);
            channel.weights[0] = gain;
        }
        let mut options = settings(self.prepared, &RefineOptions::default(), 7);
        options.freedom.dynamics = DynamicsFreedom::Numerator;
        options.freedom.identity = false;
        options.gain = 1e-3;
        for place_again in [true, false] {
            self.prepared.settle(&mut point);
            point = fit(point, &self.prepared.record, &options, "structure", progress)?.point;
            if place_again {
                self.prepared.place(&mut point, half_widths)?;
            }
        }
        Ok(point)
    }
}
