//! Whether the output saturates.
//!
//! A sensor or a drive at its limit repeats one value exactly while the input moves on. A sample is clipped if it stands at
//! the output's largest or smallest value, in a run of equal samples during which an input moves. A quantized signal also has
//! runs at its turning points. It stands as often at the next level, and a limit does not. Where one end of the range is reached often,
//! fewer samples show the other.

use crate::explain::policy::OutsidePolicy;
use crate::{Experiment, Matrix, Record};
use std::ops::Range;

/// Clipped samples of one output.
pub(super) struct Clipped {
    /// Runs of each experiment.
    pub(super) runs: Vec<Vec<Range<usize>>>,
    samples: usize,
    /// Whether they stand at the largest value, and whether some stand at the smallest.
    pub(super) at: [bool; 2],
}

impl Clipped {
    /// The part of all samples that is clipped.
    pub(super) fn share(&self) -> f64 {
        self.count() as f64 / self.samples as f64
    }

    fn count(&self) -> usize {
        self.runs.iter().flatten().map(Range::len).sum()
    }
}

/// The clipped samples of an output; none where they are too small a part.
pub(super) fn clipped(record: &Record, output: usize, policy: &OutsidePolicy) -> Clipped {
    let samples = record.samples();
    let none = || vec![Vec::new(); record.experiments().len()];
    let ends = [1.0, -1.0].map(|sign| {
        let values = || {
            record
                .experiments()
                .iter()
                .flat_map(|e| e.output.column(output).into_owned().data.as_vec().clone())
        };
        let extreme = values().map(|y| sign * y).fold(f64::NEG_INFINITY, f64::max);
        let below = values().map(|y| sign * y).filter(|y| *y < extreme);
        let next = below.fold(f64::NEG_INFINITY, f64::max);
        let at_next = values().filter(|y| sign * y == next).count();
        let mut own = Clipped { runs: none(), samples, at: [sign > 0.0, sign < 0.0] };
        for (experiment, runs) in record.experiments().iter().zip(&mut own.runs) {
            let stands = |k: usize| sign * experiment.output[(k, output)] == extreme;
            *runs = runs_of(experiment.input.nrows(), stands);
            runs.retain(|run| run.len() >= policy.run && moves(experiment, run) > policy.moved);
        }
        (own.count() as f64 > policy.crowded * at_next as f64).then_some(own)
    });
    let mut found = Clipped { runs: none(), samples, at: [false; 2] };
    if !ends.iter().flatten().any(|own| own.share() > policy.clipped) {
        return found;
    }
    for own in ends.into_iter().flatten() {
        found.at.iter_mut().zip(own.at).for_each(|(all, own)| *all |= own);
        found.runs.iter_mut().zip(own.runs).for_each(|(all, own)| all.extend(own));
    }
    found
}

/// Whether there are clipped samples at which a model errs more than elsewhere.
pub(super) fn is_unexplained(clipped: &Clipped, residuals: &[Matrix], output: usize) -> bool {
    let count = clipped.count();
    let square = |experiment: usize, run: &Range<usize>| {
        residuals[experiment].view((run.start, output), (run.len(), 1)).norm_squared()
    };
    let of = |(experiment, runs): (usize, &Vec<Range<usize>>)| {
        runs.iter().map(|run| square(experiment, run)).sum::<f64>()
    };
    let there: f64 = clipped.runs.iter().enumerate().map(of).sum();
    let all: f64 = residuals.iter().map(|residual| residual.column(output).norm_squared()).sum();
    let elsewhere = (clipped.samples - count).max(1) as f64;
    count > 0 && there / count as f64 > (all - there) / elsewhere
}

/// Runs of consecutive samples for which something holds.
fn runs_of(samples: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (0..samples).filter(|&k| holds(k)) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end += 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// The largest movement of an input in a run, as a part of its span.
fn moves(experiment: &Experiment, run: &Range<usize>) -> f64 {
    let part = |column: nalgebra::DVectorView<f64>| {
        let inside = column.rows(run.start, run.len());
        0.5 * (inside.max() - inside.min())
    };
    experiment.input.column_iter().map(part).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::{noise, slow_input, stage};

    fn share(u: &[f64], y: &[f64]) -> f64 {
        clipped(&stage(u, y), 0, &OutsidePolicy::default()).share()
    }

    #[test]
    fn a_limit_is_not_quantization_and_not_a_rest() {
        let u = slow_input(6000);
        let mut e = noise(2);
        let smooth: Vec<f64> = u.iter().map(|u| u + 0.01 * e()).collect();
        assert_eq!(share(&u, &smooth), 0.0);
        let limited: Vec<f64> = smooth.iter().map(|y| y.clamp(-0.8, 0.7)).collect();
        let expected = limited.iter().filter(|y| **y == 0.7 || **y == -0.8).count() as f64;
        let found = share(&u, &limited);
        assert!(found > 0.01 && found <= expected / 6000.0, "{found}");
        // few samples at one end, where the other one is a limit
        let mut sorted = smooth.clone();
        sorted.sort_by(f64::total_cmp);
        let low = sorted[20];
        let few: Vec<f64> = smooth.iter().map(|y| y.max(low)).collect();
        assert_eq!(share(&u, &few), 0.0);
        let both: Vec<f64> = few.iter().map(|y| y.min(0.7)).collect();
        let found = clipped(&stage(&u, &both), 0, &OutsidePolicy::default());
        assert_eq!(found.at, [true; 2]);
        let is_lowest = |run: &Range<usize>| both[run.start] == low;
        assert!(found.runs[0].iter().any(is_lowest) && !found.runs[0].iter().all(is_lowest));
        let quantized: Vec<f64> = u.iter().map(|u| (8.0 * u).round() / 8.0).collect();
        assert_eq!(share(&u, &quantized), 0.0);
        // the smallest value only while the input rests
        let resting: Vec<f64> = (0..6000).map(|k| if k < 500 { -1.0 } else { u[k] }).collect();
        let output: Vec<f64> = resting.iter().map(|u| 2.0 * u).collect();
        assert_eq!(share(&resting, &output), 0.0);
    }

    #[test]
    fn a_model_of_the_limit_explains_it() {
        let u = slow_input(6000);
        let limited: Vec<f64> = u.iter().map(|u| u.min(0.6)).collect();
        let record = stage(&u, &limited);
        let clipped = clipped(&record, 0, &OutsidePolicy::default());
        let without: Vec<f64> = u.iter().zip(&limited).map(|(u, y)| y - u).collect();
        let mut e = noise(5);
        let with = Matrix::from_fn(6000, 1, |k, _| if limited[k] == 0.6 { 0.0 } else { e() });
        assert!(is_unexplained(&clipped, &[Matrix::from_column_slice(6000, 1, &without)], 0));
        assert!(!is_unexplained(&clipped, &[with], 0));
    }
}
