//! Whether a slow function of time follows how the input moves.
//!
//! A function of time stands for a cause that is not known. Where it bends when the recent amplitude of the input does, the input is the
//! cause: a gain that falls while the stage swings widely does not drift. With g the values at the knots, h their distance in
//! samples, and for each input u
//!
//! ```text
//! f(k) = a f(k - 1) + (1 - a) x(k),   a = exp(-1 / (c h)),   x(k) = u(k), |u(k) - mean(u)|, or |u(k) - u(k - 1)|
//! ```
//!
//! taken at the knots, r is the correlation of the second differences of g and of f. Those of a smooth g are hardly more than the errors of
//! its estimate, which do not depend on the input, so that `t = r sqrt((n - 2) / (1 - r^2))` of n differences has Student's distribution
//! with n - 2 degrees of freedom. Values or first differences of slow curves are correlated by chance. The value at the first sample is
//! zero by definition and is left out: where the output begins at zero, the data do not determine the gain there.

use crate::Record;
use crate::chain::point::Point;
use crate::explain::policy::ExaminationPolicy;
use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Memories c of the input, in spacings of the knots: from what has just happened to what outlasts some knots.
const MEMORIES: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];

/// Whether the bends of the function of time at a place are those of a measure of the input's recent motion, by more than chance.
pub(super) fn follows_input(
    record: &Record,
    point: &Point,
    place: usize,
    policy: &ExaminationPolicy,
) -> bool {
    let later = point.effects[place].values();
    let spacing = record.longest() as f64 / later.len().max(1) as f64;
    let mut chances = Vec::new();
    for experiment in record.experiments() {
        let rows = experiment.input.nrows();
        let inside = (rows as f64 / spacing).round() as usize;
        let values: Vec<f64> = later.iter().copied().take(inside).collect();
        for column in experiment.input.column_iter() {
            let u: Vec<f64> = column.iter().copied().collect();
            for motion in motions(&u) {
                for memory in MEMORIES {
                    let recent = recent(&motion, memory * spacing);
                    let at = |j: usize| recent[((j as f64 * spacing) as usize).min(rows - 1)];
                    let known: Vec<f64> = (1..=values.len()).map(at).collect();
                    chances.extend(chance(&bends(&values), &bends(&known)));
                }
            }
        }
    }
    let tests = chances.len() as f64;
    chances.iter().any(|chance| chance * tests < policy.followed)
}

/// Measures of the motion of an input: its level, its amplitude and its speed.
fn motions(u: &[f64]) -> [Vec<f64>; 3] {
    let mean = u.iter().sum::<f64>() / u.len().max(1) as f64;
    let amplitude = u.iter().map(|u| (u - mean).abs()).collect();
    let speed = u.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    [u.to_vec(), amplitude, std::iter::once(0.0).chain(speed).collect()]
}

/// The weighted mean of the past of a signal, with a memory of so many samples.
fn recent(signal: &[f64], memory: f64) -> Vec<f64> {
    let kept = (-1.0 / memory.max(f64::MIN_POSITIVE)).exp();
    let mut mean = signal.first().copied().unwrap_or(0.0);
    let next = |value: &f64| {
        mean = kept * mean + (1.0 - kept) * value;
        mean
    };
    signal.iter().map(next).collect()
}

/// Second differences.
fn bends(values: &[f64]) -> DVector<f64> {
    let bends = values.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
    DVector::from_iterator(values.len().saturating_sub(2), bends)
}

/// The probability that independent signals are correlated as much; `None` for too few or constant values.
fn chance(one: &DVector<f64>, other: &DVector<f64>) -> Option<f64> {
    let freedom = one.len().checked_sub(2).filter(|&freedom| freedom > 0)? as f64;
    let centred = |signal: &DVector<f64>| signal.add_scalar(-signal.mean());
    let (one, other) = (centred(one), centred(other));
    let sizes = one.norm() * other.norm();
    if sizes <= 0.0 {
        return None;
    }
    let r = (one.dot(&other) / sizes).abs().min(1.0 - f64::EPSILON);
    let t = r * (freedom / (1.0 - r * r)).sqrt();
    Some(2.0 * StudentsT::new(0.0, 1.0, freedom).ok()?.sf(t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::plain::plain;
    use crate::effects::GainDrift;
    use crate::{Channel, Experiment, Matrix};

    #[test]
    fn chance_is_that_of_the_table() {
        // r = 0.6319 of ten values is exceeded with a probability of 5 %
        let one = DVector::from_iterator(10, (0..10).map(|i| f64::from(i) - 4.5));
        let square = |i: i32| (f64::from(i) - 4.5).powi(2);
        let other = DVector::from_iterator(10, (0..10).map(square));
        let other = other.add_scalar(-other.mean());
        let r = 0.6319_f64;
        let mixed = r * one.normalize() + (1.0 - r * r).sqrt() * other.normalize();
        assert!((chance(&one, &mixed).unwrap() - 0.05).abs() < 2e-5);
        assert!(chance(&one, &DVector::from_element(10, 3.0)).is_none());
        let two = DVector::from_vec(vec![1.0, 2.0]);
        assert!(chance(&two, &two).is_none());
    }

    /// A gain that changes as the given curve does, beside an input whose bursts have these amplitudes, one for each knot.
    fn is_driven(amplitudes: &[f64], curve: impl Fn(usize) -> f64) -> bool {
        let (burst, rate) = (100, 1e3);
        let u = Matrix::from_fn(burst * amplitudes.len(), 1, |k, _| {
            amplitudes[k / burst] * (0.8 * k as f64).sin()
        });
        let channels = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        let run = Experiment::new(u.clone(), u);
        let record = Record::new(vec![run], rate, channels.0, channels.1, vec![]).unwrap();
        let changes = (1..=amplitudes.len()).map(curve).collect();
        let duration = record.longest() as f64 / rate;
        let gain = GainDrift { output: 0, changes, duration };
        let point = plain(&[1.0], &[1.0], vec![gain.into()]);
        follows_input(&record, &point, 0, &ExaminationPolicy::default())
    }

    #[test]
    fn a_gain_that_the_amplitude_changes_follows_the_input_and_a_parabola_does_not() {
        // amplitudes without order
        let amplitudes: Vec<f64> = (0..32).map(|i| f64::from((7 * i * i + 3 * i) % 11)).collect();
        let burst = |knot: usize| amplitudes[knot - 1];
        let parabola = |knot: usize| knot as f64 * (knot as f64 - 24.0);
        let error = |knot: usize| 0.1 * f64::from((5 * knot as i32 * knot as i32) % 7);
        assert!(is_driven(&amplitudes, |knot| parabola(knot) + burst(knot) + error(knot)));
        assert!(!is_driven(&amplitudes, |knot| parabola(knot) + error(knot)));
        // three knots have too few bends
        assert!(!is_driven(&amplitudes[..3], burst));
    }

    #[test]
    fn the_recent_mean_forgets() {
        let step: Vec<f64> = (0..100).map(|k| if k < 50 { 0.0 } else { 1.0 }).collect();
        let mean = recent(&step, 10.0);
        assert!(mean[49] == 0.0 && (mean[59] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
    }
}
