//! Whether the output integrates the input.
//!
//! A regression of the output on past values of u, on plays of u and on a line over time is given the first and the second
//! running integral of u without its mean,
//!
//! `I_1(k) = sum_{j<=k} (u(j) - mean u) / N`, and `I_2` the same of `I_1`.
//!
//! The line stands for what integrates to rest at another input than the mean. The regression is compared with the same one without
//! the integrals, and with regressions that have leaking integrals in their place,
//!
//! `L_1(k) = L_1(k-1) + (u(k) - L_1(k-1)) / T` from `L_1(0) = u(0)`, and `L_2` the same of `L_1`,
//!
//! of time constants T up to a part of the longest experiment: a tank that fills, or a body that is heated, forgets within the
//! record, and an integrator does not. All are scored on folds that they were not fitted to. The statistic is the least squares
//! without integrals over those with them. There is none where the integrals leave a considerable part of the output: the regression
//! describes an integrator well, but of a slow plant that begins in motion it may only describe more than the one with leaking
//! integrals, whose start is unknown.

use crate::explain::policy::OutsidePolicy;
use crate::rivals::regression::{Features, Sums};
use crate::rivals::{Plays, RivalPolicy};
use crate::{Experiment, Record};

/// Past values and plays of every input and a line, then the integrals of every input.
struct Memory<'a> {
    record: &'a Record,
    lags: &'a [usize],
    plays: Plays,
    /// Of each experiment: both integrals of all inputs.
    integrals: Vec<Vec<Vec<f64>>>,
}

impl<'a> Memory<'a> {
    /// With the integrals that `integral` makes of a signal.
    fn new(
        record: &'a Record,
        policy: &'a OutsidePolicy,
        integral: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Self {
        let both = |experiment: &Experiment| {
            let columns = experiment.input.column_iter().map(|u| integral(u.as_slice()));
            columns.flat_map(|first| [integral(&first), first]).collect()
        };
        let spans = vec![2.0; record.inputs().len()];
        let plays = Plays::of(record, &spans, policy.plays);
        let integrals = record.experiments().iter().map(both).collect();
        Self { record, lags: &policy.lags, plays, integrals }
    }

    fn without_integrals(&self) -> usize {
        self.lags.len() * self.record.inputs().len() + self.plays.count() + 1
    }
}

impl Features for Memory<'_> {
    fn count(&self) -> usize {
        self.without_integrals() + 2 * self.record.inputs().len()
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        let input = &self.record.experiments()[experiment].input;
        let (own, integrals) = row.split_at_mut(self.without_integrals());
        let (lags, rest) = own.split_at_mut(self.lags.len() * input.ncols());
        let (plays, line) = rest.split_at_mut(self.plays.count());
        for (i, column) in input.column_iter().enumerate() {
            for (value, lag) in lags[i * self.lags.len()..].iter_mut().zip(self.lags) {
                *value = column[k.saturating_sub(*lag)];
            }
        }
        self.plays.fill(experiment, k, plays);
        line.fill(k as f64 / input.nrows() as f64);
        let known = &self.integrals[experiment];
        integrals.iter_mut().zip(known).for_each(|(value, integral)| *value = integral[k]);
    }
}

/// The least squares without the integrals over those with them; `None` where the samples are too few, or the integrals leave more
/// than a part of the output.
pub(super) fn ratio(
    record: &Record,
    output: usize,
    rivals: &RivalPolicy,
    policy: &OutsidePolicy,
) -> Option<f64> {
    let target = |experiment: usize, k: usize, values: &mut [f64]| {
        values[0] = record.experiments()[experiment].output[(k, output)];
    };
    let scores = |features: &Memory| {
        let sums = Sums::of(features, record, 1, target, rivals);
        [features.without_integrals(), features.count()]
            .map(|size| Some(sums.cross_validated(size, policy.ridge)?.score()))
    };
    let [without, with] = scores(&Memory::new(record, policy, integral));
    let with = with?;
    // the output has the variance one
    if with > policy.remainder * record.scored() as f64 {
        return None;
    }
    let mut least = without?;
    for halvings in 0..policy.leaks {
        let time = policy.forgotten * record.longest() as f64 * 0.5_f64.powi(halvings as i32);
        let [_, leaking] = scores(&Memory::new(record, policy, |x| leaking(x, time)));
        least = least.min(leaking?);
    }
    // squares that are rounding say nothing
    let rounding = f64::EPSILON * record.scored() as f64;
    Some(least.max(rounding) / with.max(rounding))
}

/// The running integral of a signal without its mean.
fn integral(signal: &[f64]) -> Vec<f64> {
    let count = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / count;
    let mut sum = 0.0;
    let mut add = |x: &f64| {
        sum += (x - mean) / count;
        sum
    };
    signal.iter().map(&mut add).collect()
}

/// The integral that leaks with a time constant in samples.
fn leaking(signal: &[f64], time: f64) -> Vec<f64> {
    let mut state = signal.first().copied().unwrap_or(0.0);
    let mut follow = |x: &f64| {
        state += (x - state) / time.max(1.0);
        state
    };
    signal.iter().map(&mut follow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::{noise, slow_input, stage};

    fn integrates(y: &[f64], u: &[f64]) -> bool {
        let policy = OutsidePolicy::default();
        let ratio = ratio(&stage(u, y), 0, &RivalPolicy::default(), &policy);
        ratio.is_some_and(|ratio| ratio > policy.integrated)
    }

    #[test]
    fn only_an_integral_is_one() {
        let u = slow_input(6000);
        let mut e = noise(8);
        let (mut position, mut lag, mut creep, mut level) = (0.0, 0.0, 0.0, 0.3);
        let (mut integrating, mut ordinary, mut tank) = (Vec::new(), Vec::new(), Vec::new());
        for (k, u) in u.iter().enumerate() {
            position += 1e-3 * (u - 0.1);
            lag += 0.05 * (u - lag);
            creep += 4e-4 * (lag - creep);
            // an outflow that grows with the root of the level, as of a tank
            level = f64::max(level + 5e-3 * (0.6 + 0.2 * u - f64::sqrt(level)), 0.0);
            integrating.push(position + 0.2 * lag + 0.01 * e());
            ordinary.push(lag + 0.2 * creep + 1e-5 * k as f64 + 0.01 * e());
            tank.push(level + 1e-3 * e());
        }
        assert!(integrates(&integrating, &u));
        assert!(!integrates(&ordinary, &u), "creep and drift");
        assert!(!integrates(&tank, &u), "a slow plant");
    }
}
