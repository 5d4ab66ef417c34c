//! Lines in the residual's spectrum.

use super::chance::exceeded_with;
use super::{Beside, ResidualTest};
use crate::Matrix;
use crate::spectrum::tapered;
use crate::uncertainty::noise_model::NoiseModel;
use num_complex::Complex64;
use rustfft::FftPlanner;

/// Neighbouring places of a spectrum that a line is compared with.
const AROUND: usize = 64;

/// Residuals whose spectrum is flat but for its lines: a line stands out of a steep spectrum only then.
///
/// The colour is taken from what the residuals are without their lines, which it would follow otherwise.
pub(super) fn flattened(beside: &Beside) -> Vec<Matrix> {
    let mut smooth = beside.residuals.to_vec();
    for (residual, experiment) in smooth.iter_mut().zip(beside.record.experiments()) {
        for run in experiment.scored_runs().filter(|run| run.len() >= 4 * AROUND) {
            for mut column in residual.column_iter_mut() {
                let values = &mut column.as_mut_slice()[run.clone()];
                let without = without_lines(values);
                values.copy_from_slice(&without);
            }
        }
    }
    NoiseModel::of(&smooth, beside.record).whiten(beside.residuals)
}

/// A signal, tapered, with the narrow peaks of its spectrum cut down to what is beside them.
fn without_lines(values: &[f64]) -> Vec<f64> {
    /// A line is a few places wide; a resonance is wider, and part of the colour.
    const NEAR: usize = 4;
    const FAR: usize = 12;
    /// Times the median on either side, of which one is higher on a slope.
    const STANDS_OUT: f64 = 12.0;
    let n = values.len();
    let mut spectrum = tapered(values);
    let power: Vec<f64> = spectrum[..n / 2].iter().map(Complex64::norm_sqr).collect();
    for k in NEAR + 1..power.len() - NEAR {
        let below = median(&power[k.saturating_sub(FAR).max(1)..=k - NEAR]);
        let above = median(&power[k + NEAR..power.len().min(k + FAR + 1)]);
        let background = below.max(above);
        if power[k] > STANDS_OUT * background {
            let scale = (background / power[k]).sqrt();
            spectrum[k] *= scale;
            spectrum[n - k] *= scale;
        }
    }
    FftPlanner::new().plan_fft_inverse(n).process(&mut spectrum);
    spectrum.iter().map(|value| value.re / n as f64).collect()
}

/// The largest line of the periodogram over the median of those around it (Fisher's test, against the
/// local background): the same for noise of any smooth spectrum.
pub(super) fn lines(beside: &Beside, output: usize, chance: f64) -> ResidualTest {
    let (mut most, mut count) = (0.0_f64, 0.0_f64);
    for (residual, experiment) in beside.residuals.iter().zip(beside.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let values = run.column(output);
            for chunk in periodogram(values.as_slice()).chunks_exact(AROUND) {
                let largest = chunk.iter().copied().fold(0.0, f64::max);
                most = most.max(largest / median(chunk).max(f64::MIN_POSITIVE));
                count += AROUND as f64;
            }
        }
    }
    let tail = |ratio: f64| count.max(1.0) * single_above(ratio);
    ResidualTest {
        name: "lines",
        output,
        statistic: most,
        threshold: exceeded_with(chance, tail),
        p_value: tail(most).min(1.0),
        points_to: "periodic-disturbance",
    }
}

/// Power over frequency without its slowest places; nothing where it would be shorter than [`AROUND`].
fn periodogram(values: &[f64]) -> Vec<f64> {
    const SLOWEST: usize = 4;
    let n = values.len();
    if n < 4 * AROUND {
        return Vec::new();
    }
    let spectrum = tapered(values);
    spectrum[SLOWEST..n / 2].iter().map(Complex64::norm_sqr).collect()
}

/// The upper one of two in the middle.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// The chance that one exponential number exceeds the median of the others by this ratio.
///
/// `E exp(-ratio m)` of the m that is the j-th smallest of n exponential numbers is
/// `prod_i (n - i) / (n - i + ratio)` for i from 0 to j - 1; j is one below the place of the median, which
/// makes up for neighbours that the window ties together.
fn single_above(ratio: f64) -> f64 {
    let others = (AROUND / 2..AROUND).map(|left| left as f64);
    others.map(|left| left / (left + ratio)).product()
}
