//! Whether the output integrates the input.
//!
//! A regression of the output on lags of u and on plays of u is compared with one that also has the first and the second
//! running integral of u without its mean:
//!
//! `I_1(k) = sum_{j<=k} (u(j) - mean u) / N`, and `I_2` the same of `I_1`.
//!
//! Both are scored on folds that they were not fitted to. The statistic is the squares of the first over those of the second.
//! On records of known truth, integrating stages have 2.2 to 550, and fifty others at most 1.4.

use crate::explain::policy::OutsidePolicy;
use crate::rivals::regression::{Features, Sums};
use crate::rivals::{Plays, RivalPolicy};
use crate::{Experiment, Record};

/// Lags and plays of every input, then its integrals.
struct Memory<'a> {
    record: &'a Record,
    lags: &'a [usize],
    plays: Plays,
    /// Of each experiment and input, both integrals.
    integrals: Vec<Vec<[Vec<f64>; 2]>>,
}

impl Memory<'_> {
    fn without_integrals(&self) -> usize {
        self.lags.len() * self.record.inputs().len() + self.plays.count()
    }
}

impl Features for Memory<'_> {
    fn count(&self) -> usize {
        self.without_integrals() + 2 * self.record.inputs().len()
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        let input = &self.record.experiments()[experiment].input;
        let (own, integrals) = row.split_at_mut(self.without_integrals());
        let (lags, plays) = own.split_at_mut(self.lags.len() * input.ncols());
        for (i, column) in input.column_iter().enumerate() {
            for (value, lag) in lags[i * self.lags.len()..].iter_mut().zip(self.lags) {
                *value = column[k.saturating_sub(*lag)];
            }
        }
        self.plays.fill(experiment, k, plays);
        let known = self.integrals[experiment].iter().flatten();
        integrals.iter_mut().zip(known).for_each(|(value, integral)| *value = integral[k]);
    }
}

/// The squares without the integrals over those with them; `None` where the samples are too few.
pub(super) fn ratio(
    record: &Record,
    output: usize,
    rivals: &RivalPolicy,
    policy: &OutsidePolicy,
) -> Option<f64> {
    let spans = vec![2.0; record.inputs().len()];
    let features = Memory {
        record,
        lags: &policy.lags,
        plays: Plays::of(record, &spans, policy.plays),
        integrals: record.experiments().iter().map(both_integrals).collect(),
    };
    let target = |experiment: usize, k: usize, values: &mut [f64]| {
        values[0] = record.experiments()[experiment].output[(k, output)];
    };
    let sums = Sums::of(&features, record, 1, target, rivals);
    let score = |size: usize| Some(sums.cross_validated(size, policy.ridge)?.score());
    let (without, with) = (score(features.without_integrals())?, score(features.count())?);
    // squares that are rounding say nothing
    let least = f64::EPSILON * record.scored() as f64;
    Some(without.max(least) / with.max(least))
}

fn both_integrals(experiment: &Experiment) -> Vec<[Vec<f64>; 2]> {
    let one = |column: nalgebra::DVectorView<f64>| {
        let first = integral(&column.iter().copied().collect::<Vec<_>>());
        let second = integral(&first);
        [first, second]
    };
    experiment.input.column_iter().map(one).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::{noise, slow_input, stage};

    fn ratio_of(y: &[f64], u: &[f64]) -> f64 {
        ratio(&stage(u, y), 0, &RivalPolicy::default(), &OutsidePolicy::default()).unwrap()
    }

    #[test]
    fn only_an_integral_is_one() {
        let u = slow_input(6000);
        let mut e = noise(8);
        let (mut position, mut lag, mut creep) = (0.0, 0.0, 0.0);
        let (mut integrating, mut ordinary) = (Vec::new(), Vec::new());
        for (k, u) in u.iter().enumerate() {
            position += 1e-3 * (u - 0.1);
            lag += 0.05 * (u - lag);
            creep += 4e-4 * (lag - creep);
            integrating.push(position + 0.2 * lag + 0.01 * e());
            ordinary.push(lag + 0.2 * creep + 1e-5 * k as f64 + 0.01 * e());
        }
        let (integrating, ordinary) = (ratio_of(&integrating, &u), ratio_of(&ordinary, &u));
        let policy = OutsidePolicy::default();
        assert!(integrating > policy.integrated, "{integrating}");
        assert!(ordinary < policy.integrated, "creep and drift: {ordinary}");
    }
}
