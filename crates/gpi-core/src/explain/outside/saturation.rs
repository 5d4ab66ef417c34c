//! Whether the output saturates.
//!
//! A sensor or a drive at its limit repeats one value exactly while the input moves on. A sample is clipped if it stands at
//! the output's largest or smallest value, in a run of equal samples during which an input moves. A quantized signal also has
//! runs at its turning points. It stands as often at the next level, and a limit does not. Where one end of the range is reached often,
//! fewer samples show the other.
//!
//! Where hardly any other sample repeats the one before it, noise is far above the resolution of the sensor. There a few runs at an end
//! of the range show a limit, also while the input rests and the output rings.

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
    let is_fine = !repeats(record, output, policy);
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
            // a stage without noise may rest exactly before it is first moved
            let is_within = |run: &Range<usize>| is_fine && run.start > 0;
            runs.retain(|run| {
                let shows_limit = is_within(run) || moves(experiment, run) > policy.moved;
                run.len() >= policy.run && shows_limit
            });
        }
        let is_crowded = own.count() as f64 > policy.crowded * at_next as f64;
        (own.count() > 0 && (is_fine || is_crowded)).then_some(own)
    });
    let mut found = Clipped { runs: none(), samples, at: [false; 2] };
    if !ends.iter().flatten().any(|own| is_fine || own.share() > policy.clipped) {
        return found;
    }
    for own in ends.into_iter().flatten() {
        found.at.iter_mut().zip(own.at).for_each(|(all, own)| *all |= own);
        found.runs.iter_mut().zip(own.runs).for_each(|(all, own)| all.extend(own));
    }
    found
}

/// Whether more than a part of the samples between the ends of the range repeat the sample before them.
fn repeats(record: &Record, output: usize, policy: &OutsidePolicy) -> bool {
    let columns = || record.experiments().iter().map(|run| run.output.column(output));
    let highest = columns().map(|column| column.max()).fold(f64::NEG_INFINITY, f64::max);
    let lowest = columns().map(|column| column.min()).fold(f64::INFINITY, f64::min);
    let is_repeated =
        |(before, own): (&f64, &f64)| before == own && *own != highest && *own != lowest;
    let of = |column: nalgebra::DVectorView<f64>| {
        column.iter().zip(column.iter().skip(1)).filter(|&pair| is_repeated(pair)).count()
    };
    let repeated: usize = columns().map(of).sum();
    repeated as f64 > policy.repeated * record.samples() as f64
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
        let coarse: Vec<f64> = smooth.iter().map(|y| (1e3 * y).round() / 1e3).collect();
        let mut sorted = coarse.clone();
        sorted.sort_by(f64::total_cmp);
        let low = sorted[20];
        let few: Vec<f64> = coarse.iter().map(|y| y.max(low)).collect();
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
    fn few_samples_show_a_limit_where_no_others_repeat() {
        // the input rests after each step, and the output rings beyond the limit once
        let steps: Vec<f64> = (0..6000).map(|k| if k / 1000 == 3 { 1.0 } else { 0.5 }).collect();
        let mut e = noise(3);
        let ringing = |k: usize| {
            let after = (k % 1000) as f64;
            steps[k] * (1.0 - (-after / 100.0).exp() * (0.3 * after).cos())
        };
        let output: Vec<f64> = (0..6000).map(|k| ringing(k) + 1e-3 * e()).collect();
        let highest = 1.7;
        let limited: Vec<f64> = output.iter().map(|y| y.min(highest)).collect();
        let is_over = |y: &&f64| **y > highest;
        let over = output.iter().filter(is_over).count();
        assert!(over > 3 && over < 30, "{over}");
        let found = clipped(&stage(&steps, &limited), 0, &OutsidePolicy::default());
        assert_eq!(found.at, [true, false]);
        assert!(found.runs[0].iter().all(|run| (3000..4000).contains(&run.start)));
        // the same where the sensor is coarser than its noise
        let coarse: Vec<f64> = limited.iter().map(|y| (50.0 * y).round() / 50.0).collect();
        assert_eq!(share(&steps, &coarse), 0.0);
        // a stage that rests at the start of a record without noise
        let still: Vec<f64> = (0..6000).map(|k| if k < 1000 { 0.0 } else { 1.0 + e() }).collect();
        assert_eq!(share(&steps, &still), 0.0);
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
