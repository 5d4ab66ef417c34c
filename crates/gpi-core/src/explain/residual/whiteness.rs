//! Memory of the residual.

use super::chance::{chi_square_tail, exceeded_with};
use super::{Beside, ResidualTest};

/// Ljung and Box: `Q = n (n + 2) sum_k r_k^2 / (n - k)` over the first lags of the autocorrelation.
pub(super) fn whiteness(beside: &Beside, output: usize, chance: f64) -> ResidualTest {
    const LAGS: usize = 25;
    /// Less of a residual's variance in its correlations is of no practical size, however sure.
    const SMALL: f64 = 0.01;
    let mut covariances = [0.0; LAGS + 1];
    let mut n = 0.0;
    for (residual, experiment) in beside.residuals.iter().zip(beside.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let values = run.column(output);
            n += values.len() as f64;
            for (lag, sum) in covariances.iter_mut().enumerate().take(values.len()) {
                *sum += (lag..values.len()).map(|k| values[k] * values[k - lag]).sum::<f64>();
            }
        }
    }
    let variance = covariances[0].max(f64::MIN_POSITIVE);
    let sum: f64 = (1..=LAGS)
        .map(|lag| (covariances[lag] / variance).powi(2) / (n - lag as f64).max(1.0))
        .sum();
    let statistic = n * (n + 2.0) * sum;
    let tail = |value: f64| chi_square_tail(value, LAGS as f64);
    ResidualTest {
        name: "whiteness",
        output,
        statistic,
        threshold: exceeded_with(chance, tail).max(SMALL * n),
        p_value: tail(statistic),
        points_to: "memory that the model lacks, or coloured noise",
    }
}
