//! Which structures are compared: how many plays and deadzones, which order and delay.

use crate::Error;
use crate::chain::bounds::range;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::dense::dense;
use crate::fit::joint::{Refined, fit_options};
use crate::fit::minimize::{FitOptions, fit};
use crate::fit::preparation::{Prepared, rescale};
use crate::fit::problem::residual_rms;
use crate::fit::smooth::smooth;
use crate::fit::{Grid, RefineOptions};
use crate::identify::alternation::{DynamicsEstimate, Taps};
use crate::identify::criterion::Comparison;
use crate::identify::dead_band::dead_bands;
use crate::identify::identification::{Candidate, IdentifyOptions, Quick};
use crate::identify::settings::{IdentifySettings, StructurePolicy};
use crate::linear::Sections;
use crate::progress::{Progress, Report};
use crate::uncertainty::noise_floor::NoiseFloor;

/// How a structure is refined: what the user gives by value is not moved.
pub(super) fn refine_options(options: &IdentifyOptions) -> RefineOptions {
    let given = |grid: &Option<Grid>| matches!(grid, Some(Grid::Values(_)));
    RefineOptions {
        thresholds: !given(&options.thresholds),
        half_widths: !given(&options.half_widths),
        robust: options.robust,
        offset_knots: options.offset_knots,
    }
}

/// A short fit of the hysteresis and the zeros of G, on new grids.
pub(super) fn short_fit(prepared: &Prepared, policy: &StructurePolicy) -> FitOptions {
    let mut options = fit_options(prepared, &RefineOptions::default(), policy.steps);
    options.freedom.dynamics = DynamicsFreedom::Numerator;
    options.freedom.identity = false;
    options.gain = policy.gain;
    options
}

/// Tries structures in series that end where nothing is gained.
pub(super) struct StructureSearch<'a> {
    comparison: Comparison<'a>,
    half_widths: Option<Grid>,
    thresholds: Option<Grid>,
    quick: Option<Quick>,
}

impl<'a> StructureSearch<'a> {
    pub(super) fn new(
        prepared: &'a Prepared<'a>,
        policy: &'a StructurePolicy,
        options: &IdentifyOptions,
        quick: Option<Quick>,
    ) -> Self {
        Self {
            comparison: Comparison::new(prepared, policy, refine_options(options), quick.is_some()),
            half_widths: options.half_widths.clone(),
            thresholds: options.thresholds.clone(),
            quick,
        }
    }

    /// Whether slow poles rule out all candidates, and G of the best one is flat beyond them.
    pub(super) fn shows_nothing_fast(&self) -> bool {
        self.comparison.shows_nothing_fast()
    }

    /// The refined point of the best candidate.
    pub(super) fn best(&self) -> Option<Point> {
        self.comparison.best().cloned()
    }

    /// Whether the samples are few for the parameters of the best candidate.
    pub(super) fn is_crowded(&self) -> bool {
        self.comparison.is_crowded()
    }

    /// Why the first candidate was dropped whose computation failed.
    pub(super) fn failure(&self) -> Option<Error> {
        self.comparison.failure().cloned()
    }

    /// The best candidate's place and what it became, and all candidates.
    pub(super) fn finish(self) -> Option<(usize, Refined, Vec<Candidate>)> {
        self.comparison.finish()
    }

    /// Numbers of plays and deadzones, from many to few, as far as they are not given. A quick comparison begins with those that
    /// are asked for.
    fn ladder(&self) -> Vec<(Grid, Grid)> {
        let StructurePolicy { plays, deadzones, .. } = *self.comparison.policy;
        let given = [&self.half_widths, &self.thresholds];
        let fewer = self.quick.map_or([false; 2], |quick| quick.fewer);
        let rung = |(n, m): (usize, usize)| {
            let choose = |place: usize, count: usize| match (given[place], fewer[place]) {
                (Some(Grid::Count(most)), true) => Grid::Count(count.min(*most)),
                (Some(given), _) => given.clone(),
                (None, _) => Grid::Count(count),
            };
            (choose(0, n), choose(1, m))
        };
        let mut ladder: Vec<_> = plays.into_iter().zip(deadzones).map(rung).collect();
        ladder.dedup();
        ladder
    }

    /// Climbs down the ladder before the dynamics of `seed` until two steps have gained nothing, or to its end
    /// where the samples are few for the parameters.
    pub(super) fn climb(&mut self, seed: &Point, progress: Progress) -> Result<(), Error> {
        let (mut worse, mut least) = (0, f64::INFINITY);
        for (place, (half_widths, thresholds)) in self.ladder().into_iter().enumerate() {
            if self.quick.is_some() && place > 0 && !self.comparison.is_crowded() {
                break;
            }
            let placed = self.placed(seed, &half_widths, &thresholds, progress);
            match Error::unless_interrupted(placed)? {
                Ok(point) => drop(self.comparison.offer(point, progress)?),
                Err(error) => self.comparison.drop_failed(error),
            }
            // fewer plays may work where more did not
            if self.comparison.has_failed() {
                continue;
            }
            let criterion = self.comparison.last_criterion();
            worse = if criterion < least { 0 } else { worse + 1 };
            least = least.min(criterion);
            if worse >= self.comparison.policy.missed && !self.comparison.is_crowded() {
                break;
            }
        }
        Ok(())
    }

    /// Tries orders below the best one, then above, until they gain nothing, each behind the hysteresis of the best one.
    pub(super) fn orders(
        &mut self,
        taps: &mut Taps,
        settings: &IdentifySettings,
        progress: Progress,
    ) -> Result<(), Error> {
        let Some(point) = self.comparison.best().cloned() else { return Ok(()) };
        let order = point.dynamics.order();
        if order > self.comparison.policy.largest_order {
            return Ok(());
        }
        let driven = self.comparison.prepared.driven(&point)?;
        // v that allows no impulse response leaves the order as it is
        let Ok(mut estimate) = DynamicsEstimate::new(&driven, taps, settings) else {
            return Ok(());
        };
        let mut quiet = |_: &Report| true;
        let mut dynamics = |order| estimate.of_order(Some(order), taps, &mut quiet)?.sections();
        // Where fewer states do, more will not.
        if !self.walk(&point, (1..order).rev(), &mut dynamics, progress)? {
            self.walk(&point, order + 1..=order + 1, &mut dynamics, progress)?;
        }
        Ok(())
    }

    /// Tries orders behind the hysteresis of `point` until two have gained nothing; says whether any gained.
    /// `dynamics` gives G of an order.
    fn walk(
        &mut self,
        point: &Point,
        orders: impl Iterator<Item = usize>,
        dynamics: &mut dyn FnMut(usize) -> Result<Sections, Error>,
        progress: Progress,
    ) -> Result<bool, Error> {
        let (mut gained, mut missed) = (false, 0);
        for order in orders {
            let mut other = point.clone();
            match dynamics(order) {
                Ok(sections) => other.replace_dynamics(sections),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                // no such realization
                Err(_) => break,
            }
            rescale(&mut other);
            let better = self.comparison.offer(other, progress)?;
            gained |= better;
            // with more states than the actuator has, the poles of all candidates may follow a hum
            missed = if better || !self.comparison.has_usable() { 0 } else { missed + 1 };
            // An odd order may be a bad one between two good ones.
            if missed == self.comparison.policy.missed {
                break;
            }
        }
        Ok(gained)
    }

    /// Tries a first-order lag behind the best hysteresis, with the same dead time and with less.
    pub(super) fn lag(&mut self, progress: Progress) -> Result<(), Error> {
        let StructurePolicy { lag, slowest_lag, shorter, .. } = *self.comparison.policy;
        let Some(point) = self.comparison.best().cloned() else { return Ok(()) };
        let longest = point.dynamics.delay;
        for delay in longest.saturating_sub(shorter)..=longest {
            let mut lagged = point.clone();
            let mut dynamics = point.dynamics.with_lag(lag);
            dynamics.delay = delay;
            lagged.replace_dynamics(dynamics);
            self.comparison.offer(lagged, progress)?;
            if !self.comparison.has_failed() {
                self.comparison.withdraw_slow(slowest_lag);
            }
        }
        Ok(())
    }

    /// Tries a curve without memory, such as that of a valve, behind the dynamics of a point, where no grid is given: the structures of the
    /// ladder with as many deadzones have plays too.
    pub(super) fn without_plays(&mut self, point: &Point, progress: Progress) -> Result<(), Error> {
        if self.half_widths.is_some() || self.thresholds.is_some() {
            return Ok(());
        }
        let deadzones = Grid::Count(self.comparison.policy.deadzones[0]);
        let curve = self.placed(point, &Grid::Count(1), &deadzones, progress);
        if let Ok(curve) = Error::unless_interrupted(curve)? {
            self.comparison.offer(curve, progress)?;
        }
        Ok(())
    }

    /// Tries lags of a slow plant: refined behind a linear hysteresis first, whose few parameters do not follow what the first
    /// guess of the lags leaves, then behind the others.
    pub(super) fn slow(&mut self, seed: &Point, progress: Progress) -> Result<(), Error> {
        let Some((half_widths, thresholds)) = self.ladder().pop() else { return Ok(()) };
        let placed = self.placed(seed, &half_widths, &thresholds, progress);
        let refined = placed.and_then(|linear| self.comparison.refined(linear, progress));
        match Error::unless_interrupted(refined)? {
            Ok(linear) => {
                self.without_plays(&linear, progress)?;
                self.climb(&linear, progress)
            }
            // no model of this kind: the others stand
            Err(_) => Ok(()),
        }
    }

    /// Tries new grids before the dynamics of a point, dead bands where no grid is given, and the point itself.
    pub(super) fn begin_at(&mut self, point: Point, progress: Progress) -> Result<(), Error> {
        self.climb(&point, progress)?;
        let fewer = self.quick.map_or([false; 2], |quick| quick.fewer);
        let is_free = |(given, fewer): (&Option<Grid>, bool)| given.is_none() || fewer;
        if [&self.half_widths, &self.thresholds].into_iter().zip(fewer).all(is_free) {
            let Comparison { prepared, policy, .. } = &self.comparison;
            for band in dead_bands(prepared, &point, &policy.dead_bands) {
                self.offer_settled(band, progress)?;
            }
        }
        self.offer_settled(point, progress)
    }

    /// Tries a point that is fitted as long as it gains.
    fn offer_settled(&mut self, point: Point, progress: Progress) -> Result<(), Error> {
        let settled = self.comparison.settled(point, progress);
        if let Ok(settled) = Error::unless_interrupted(settled)? {
            self.comparison.offer(settled, progress)?;
        }
        Ok(())
    }

    /// Tries the best fit of all without the poles that rule it out: a lower order drops the weakest mode
    /// instead, which may be the stage's own resonance.
    pub(super) fn shed(&mut self, progress: Progress) -> Result<(), Error> {
        if let Ok(Some(point)) = self.comparison.without_unwanted_poles() {
            self.comparison.offer(point, progress)?;
        }
        Ok(())
    }

    /// Tries the plays that a dense grid asks for, then a smooth density of plays, where the best candidate is above the noise.
    pub(super) fn enrich(&mut self, progress: Progress) -> Result<(), Error> {
        let are_given = self.thresholds.is_some();
        let smooth = |point: &Point, prepared: &Prepared, progress: Progress| {
            smooth(point, prepared, are_given, progress)
        };
        type Richer<'a> = &'a dyn Fn(&Point, &Prepared, Progress) -> Result<Point, Error>;
        for richer in [&dense as Richer, &smooth] {
            let Comparison { prepared, policy, .. } = &self.comparison;
            let Some(point) = self.comparison.best().cloned() else { return Ok(()) };
            let is_given = matches!(self.half_widths, Some(Grid::Values(_)));
            let residuals = point.residuals(&prepared.record)?;
            let noise = NoiseFloor::estimate(&prepared.record, &residuals).rms;
            let left = residual_rms(&residuals, &prepared.record);
            let is_noise =
                left.iter().zip(noise).all(|(left, noise)| *left <= policy.near_noise * noise);
            if is_given || is_noise {
                return Ok(());
            }
            let rich = richer(&point, prepared, progress);
            let Ok(rich) = Error::unless_interrupted(rich)? else { continue };
            match self.comparison.offer(rich, progress) {
                // a record too short for so many plays has its model already
                Err(Error::TooFewSamples { .. }) => {}
                offered => drop(offered?),
            }
        }
        Ok(())
    }

    /// The seed's dynamics behind a hysteresis on new grids, fitted with the poles kept.
    fn placed(
        &self,
        seed: &Point,
        half_widths: &Grid,
        thresholds: &Grid,
        progress: Progress,
    ) -> Result<Point, Error> {
        let Comparison { prepared, policy, .. } = &self.comparison;
        let mut point = prepared.point(seed.dynamics.clone());
        point.offsets.clone_from(&seed.offsets);
        for (input, channel) in point.channels.iter_mut().enumerate() {
            let (low, high) = range(&prepared.record, input);
            let zones = thresholds.thresholds((low, high))?;
            let plays = half_widths.half_widths(high - low)?;
            let gain: f64 = seed.channels[input].weights.iter().sum();
            let elements = channel.elements;
            *channel =
                Parameters { elements, ..Parameters::identity(channel.reading, zones, plays) };
            channel.weights[0] = gain;
        }
        let options = short_fit(prepared, policy);
        for place_again in [true, false] {
            prepared.settle(&mut point);
            point = fit(point, &prepared.record, &options, "grids", progress)?.point;
            if place_again {
                prepared.place(&mut point, half_widths)?;
            }
        }
        Ok(point)
    }
}
