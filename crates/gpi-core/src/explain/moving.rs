//! Which samples of a record move, and what holds the others.
//!
//! While a stage sticks, or stands at an end stop, the force that holds it takes whatever value the balance of forces
//! ([`super::force_balance`]) asks for, and no law gives it. The balance of a stage with dry friction is therefore solved over the
//! samples that move. With the mass m, the stiffness k and the offset o that these have, the other forces
//!
//! ```text
//! p(k) = sign(m) (u(k) - o - k y(k))
//! ```
//!
//! push a sample that stands still upwards (p > 0) or downwards. Dry friction F holds it as long as `|p| <= F`. Where the mean of p
//! over w samples on both sides is beyond that, something else holds it: an end stop.
//!
//! A sample moves if the output differs by more than a part of its rms change over w samples from its value both w samples before and
//! w samples behind, and stands still if it differs by less than that from both. w is the smallest power of two over which the output
//! changes by a part of its standard deviation, so that noise does not count as motion.

use super::force_balance::{Balance, balance};
use super::policy::SlidingPolicy;
use super::state::SearchState;
use crate::effects::InnerLoop;
use crate::{Experiment, Record};
use std::ops::Range;

/// How motion is told from rest in a record of one output.
pub(super) struct Motion {
    /// w.
    reach: usize,
    /// The change over w samples from which on a sample moves.
    least: f64,
}

impl Motion {
    /// `None` where the output changes too little over any w that is small beside an experiment.
    pub(super) fn of(record: &Record, policy: &SlidingPolicy) -> Option<Self> {
        let (mut squares, mut count) = (0.0, 0);
        for run in record.experiments() {
            let y = run.output.column(0);
            squares += y.variance() * y.len() as f64;
            count += y.len();
        }
        let enough = policy.changed * (squares / count as f64).sqrt();
        let most = record.longest() / policy.many_times;
        let powers = std::iter::successors(Some(1), |w| Some(2 * w)).take_while(|w| *w <= most);
        let changes = powers.map(|reach| (reach, change(record, reach)));
        let (reach, change) = changes.into_iter().find(|(_, change)| *change >= enough)?;
        Some(Self { reach, least: policy.moving * change }).filter(|own| own.least > 0.0)
    }

    /// The record without the samples that do not move: they are held out. `None` where an experiment has no others.
    pub(super) fn moving(&self, record: &Record) -> Option<Record> {
        let mut experiments = record.experiments().to_vec();
        for experiment in &mut experiments {
            let rests = |&k: &usize| !self.is(experiment, k, |change| change > self.least);
            let others: Vec<Range<usize>> =
                (0..experiment.output.nrows()).filter(rests).map(|k| k..k + 1).collect();
            experiment.hold_out(others);
        }
        record.with_experiments(experiments).ok()
    }

    /// The places at which the output is held against more than friction, at most one on either side, each with whether it is the lower
    /// one. Hardly any sample is beyond. `balance` is that of the moving samples with these loops.
    pub(super) fn ends(
        &self,
        record: &Record,
        delay: usize,
        (balance, loops): (&Balance, &[InnerLoop]),
        policy: &SlidingPolicy,
    ) -> Vec<(f64, bool)> {
        let [stiffness, _, mass] = balance.mechanics;
        let rubs =
            loops.iter().zip(&balance.forces).filter(|(inner, _)| inner.law.is_dissipative());
        let friction: f64 = rubs.map(|(_, force)| force.abs()).sum();
        let (mut held, mut all) = ([Vec::new(), Vec::new()], Vec::new());
        for experiment in record.experiments() {
            let push = |k: usize| {
                let u = experiment.input[(k.saturating_sub(delay), 0)];
                mass.signum() * (u - balance.offset() - stiffness * experiment.output[(k, 0)])
            };
            let pushes: Vec<f64> = (0..experiment.output.nrows()).map(push).collect();
            for k in experiment.scored_runs().flatten() {
                let y = experiment.output[(k, 0)];
                all.push(y);
                // a mass hardly follows a push that changes its sign within w samples
                let around = k.saturating_sub(self.reach)..(k + self.reach + 1).min(pushes.len());
                let push = pushes[around.clone()].iter().sum::<f64>() / around.len() as f64;
                let stands = self.is(experiment, k, |change| change < self.least);
                if stands && push.abs() > policy.pushed * friction {
                    held[usize::from(push < 0.0)].push(y);
                }
            }
        }
        let highest = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = all.iter().copied().fold(f64::INFINITY, f64::min);
        let near = policy.near * (highest - lowest);
        let end = |(mut held, is_lower): (Vec<f64>, bool)| {
            held.sort_by(f64::total_cmp);
            let place = *held.get(held.len() / 2)?;
            let here = held.iter().filter(|y| (**y - place).abs() <= near).count();
            let is_beyond =
                |y: &&f64| if is_lower { **y < place - near } else { **y > place + near };
            let beyond = all.iter().filter(is_beyond).count() as f64;
            let is_end = here >= policy.samples
                && here as f64 >= policy.one_place * held.len() as f64
                && beyond <= policy.beyond * here as f64;
            is_end.then_some((place, is_lower))
        };
        held.into_iter().zip([false, true]).filter_map(end).collect()
    }

    /// Whether something holds for the change of the output from w samples before, and for that to w samples behind; not at the ends of
    /// an experiment.
    fn is(&self, experiment: &Experiment, k: usize, holds: impl Fn(f64) -> bool) -> bool {
        let y = experiment.output.column(0);
        let Some(before) = k.checked_sub(self.reach) else { return false };
        let behind = k + self.reach;
        behind < y.len() && [before, behind].iter().all(|&other| holds((y[k] - y[other]).abs()))
    }
}

/// Whether the balance of forces of the samples that move shows dry friction: it explains most of the squares, or nearly all where no end
/// stop shows that a mass slides.
pub(super) fn rubs(state: &SearchState, delay: usize, loops: &[InnerLoop], stops: bool) -> bool {
    let policy = &state.setup.policy;
    let record = &state.prepared.record;
    let is_single = record.inputs().len() == 1 && record.outputs().len() == 1;
    let moving = || Motion::of(record, &policy.sliding)?.moving(record);
    let Some(moving) = is_single.then(moving).flatten() else { return false };
    let least = if stops { policy.sliding.explained } else { policy.sliding.alone };
    balance(&moving, delay, loops, &policy.balance).is_some_and(|own| own.explained >= least)
}

/// The rms change of the output over so many samples.
fn change(record: &Record, reach: usize) -> f64 {
    let (mut squares, mut count) = (0.0, 0_usize);
    for run in record.experiments() {
        let y = run.output.column(0);
        squares += y.iter().zip(y.iter().skip(reach)).map(|(a, b)| (b - a).powi(2)).sum::<f64>();
        count += y.len().saturating_sub(reach);
    }
    (squares / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Drives, Law, Sees};
    use crate::explain::policy::BalancePolicy;
    use crate::{Channel, Matrix};

    const SAMPLES: usize = 6000;

    /// A mass with dry friction by `m y'' + c y' + k y + F sign(y') = u` in small steps, between -`stop` and `stop`, with noise of this
    /// span.
    fn stage(friction: f64, stop: f64, noise: f64) -> Record {
        const STEPS: usize = 20;
        let h = 1.0 / STEPS as f64;
        let (mass, damping, stiffness) = (200.0, 8.0, 0.1);
        let (mut y, mut speed) = (0.0_f64, 0.0_f64);
        let (mut input, mut output, mut state) = (Vec::new(), Vec::new(), 1_u32);
        for sample in 0..SAMPLES {
            let t = sample as f64;
            // at last so fast that the mass rests although the push is often beyond friction
            let slow = (0.013 * t).sin() + 0.9 * (0.0031 * t + 1.0).cos();
            let u = if sample < 4500 { slow } else { 0.8 * (2.5 * t).sin() };
            input.push(u);
            // an even distribution of noise
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            output.push(y + noise * (f64::from(state) / f64::from(u32::MAX) - 0.5));
            for _ in 0..STEPS {
                speed += h * (u - stiffness * y - damping * speed) / mass;
                speed = speed.signum() * (speed.abs() - h * friction / mass).max(0.0);
                y += h * speed;
                if y.abs() > stop {
                    (y, speed) = (y.clamp(-stop, stop), 0.0);
                }
            }
        }
        let column = |values| Matrix::from_vec(SAMPLES, 1, values);
        let run = Experiment::new(column(input), column(output));
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run], 100.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    fn shown(friction: f64, stop: f64) -> (f64, f64, Vec<(f64, bool)>) {
        let (record, policy) = (stage(friction, stop, 0.01), SlidingPolicy::default());
        let motion = Motion::of(&record, &policy).unwrap();
        let loops = vec![InnerLoop {
            sees: Sees::Output(0),
            law: Law::Dahl { distance: 0.01, averaged: true },
            drives: Drives::Input { input: 0, force: 0.0, states: 2 },
        }];
        let moving = motion.moving(&record).unwrap();
        let found = balance(&moving, 0, &loops, &BalancePolicy::default()).unwrap();
        let ends = motion.ends(&record, 0, (&found, &loops), &policy);
        (found.explained, found.forces[0], ends)
    }

    #[test]
    fn friction_and_stops_are_seen_where_both_are_and_nowhere_else() {
        let (explained, friction, ends) = shown(0.3, 2.0);
        assert!(explained > 0.9 && (friction - 0.3).abs() < 0.05, "{explained} {friction}");
        let [(high, false), (low, true)] = ends[..] else { panic!("{ends:?}") };
        assert!((high - 2.0).abs() < 0.02 && (low + 2.0).abs() < 0.02, "{ends:?}");
        // a mass that comes to rest by friction alone
        let (explained, _, ends) = shown(0.3, f64::INFINITY);
        assert!(explained > 0.9 && ends.is_empty(), "{explained} {ends:?}");
        let (explained, _, ends) = shown(0.0, f64::INFINITY);
        assert!(explained < 0.1 && ends.is_empty(), "{explained} {ends:?}");
    }

    #[test]
    fn noise_is_no_motion() {
        let moving = |record: &Record| {
            Motion::of(record, &SlidingPolicy::default()).unwrap().moving(record).unwrap().scored()
        };
        let [clear, noisy] = [0.0, 0.01].map(|noise| moving(&stage(0.3, 2.0, noise)) as f64);
        assert!(clear < 0.8 * SAMPLES as f64 && (noisy / clear - 1.0).abs() < 0.02);
    }
}
