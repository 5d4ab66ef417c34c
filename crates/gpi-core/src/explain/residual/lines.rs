//! Lines in the residual's spectrum.
//!
//! The periodogram `P_k = |sum_j h(j) e(j) exp(-2 pi i j k / n)|^2` of white noise, with a taper h, has exponentially
//! distributed values. The ratio of the largest of a group of `around` neighbours to their median thus has a tail that
//! does not depend on the level of the noise ([`single_above`]); with the number of frequencies it gives the p-value.
//! It is R. A. Fisher's test (1929) with a local background in place of the total power.
//!
//! In a steep spectrum the median of neighbours is no measure of the background at a place. The residual is therefore
//! whitened first by its autoregression. An autoregression also flattens a strong line, because it is predictable. It
//! is therefore fitted to a copy of the residual without its lines: each place of the spectrum that stands out of the
//! larger of the medians on both sides by a factor is cut down to it, which keeps a resonance, wider than a line, and
//! the phase.

use super::compared::Compared;
use super::outcome::{ResidualTest, Significance, points_to};
use super::policy::ResidualPolicy;
use super::significance::exceeded_with;
use crate::Matrix;
use crate::spectrum::tapered;
use crate::uncertainty::noise_model::NoiseModel;
use num_complex::Complex64;
use rustfft::FftPlanner;

/// Residuals whose spectrum is flat but for its lines: a line stands out of a steep spectrum only then.
///
/// The autoregression that whitens them is fitted to the residuals without their lines, which it would follow otherwise.
pub(super) fn flattened(given: &Compared) -> Vec<Matrix> {
    let policy = given.policy;
    let mut smooth = given.residuals.to_vec();
    for (residual, experiment) in smooth.iter_mut().zip(given.record.experiments()) {
        for run in experiment.scored_runs().filter(|run| run.len() >= 4 * policy.around) {
            for mut column in residual.column_iter_mut() {
                let values = &mut column.as_mut_slice()[run.clone()];
                let without = without_lines(values, policy);
                values.copy_from_slice(&without);
            }
        }
    }
    NoiseModel::of(&smooth, given.record).whiten(given.residuals)
}

/// A signal, tapered, with the narrow peaks of its spectrum cut down to the background on both sides.
fn without_lines(values: &[f64], policy: &ResidualPolicy) -> Vec<f64> {
    let ResidualPolicy { line_near: near, line_far: far, stands_out, .. } = *policy;
    let n = values.len();
    let mut spectrum = tapered(values);
    let power: Vec<f64> = spectrum[..n / 2].iter().map(Complex64::norm_sqr).collect();
    for k in near + 1..power.len() - near {
        let below = median(&power[k.saturating_sub(far).max(1)..=k - near]);
        let above = median(&power[k + near..power.len().min(k + far + 1)]);
        let background = below.max(above);
        if power[k] > stands_out * background {
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
pub(super) fn lines(given: &Compared, output: usize, significance: f64) -> ResidualTest {
    let around = given.policy.around;
    let (mut most, mut count) = (0.0_f64, 0.0_f64);
    for (residual, experiment) in given.residuals.iter().zip(given.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let values = run.column(output);
            for chunk in periodogram(values.as_slice(), given.policy).chunks_exact(around) {
                let largest = chunk.iter().copied().fold(0.0, f64::max);
                most = most.max(largest / median(chunk).max(f64::MIN_POSITIVE));
                count += around as f64;
            }
        }
    }
    let tail = |ratio: f64| count.max(1.0) * single_above(ratio, around);
    let threshold = exceeded_with(significance, tail);
    ResidualTest {
        name: "lines",
        output,
        statistic: most,
        threshold,
        significance: Some(Significance::new(tail, most, threshold)),
        points_to: points_to("lines", ""),
    }
}

/// Power over frequency without its slowest places; nothing where it would be too short for a background.
fn periodogram(values: &[f64], policy: &ResidualPolicy) -> Vec<f64> {
    let n = values.len();
    if n < 4 * policy.around {
        return Vec::new();
    }
    let spectrum = tapered(values);
    spectrum[policy.slowest..n / 2].iter().map(Complex64::norm_sqr).collect()
}

/// The upper one of two in the middle.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// The probability that one exponential number exceeds the median of the others by this ratio.
///
/// `E exp(-ratio m)` of the m that is the j-th smallest of n exponential numbers is
/// `prod_i (n - i) / (n - i + ratio)` for i from 0 to j - 1; j is one below the place of the median, which
/// makes up for neighbours that the window ties together.
fn single_above(ratio: f64, around: usize) -> f64 {
    let others = (around / 2..around).map(|left| left as f64);
    others.map(|left| left / (left + ratio)).product()
}
