//! Autocorrelation of the residual.
//!
//! With the autocorrelations r_k of n samples, `n r_k^2` is asymptotically chi-square with one degree of freedom for
//! white noise, and independent for different k. Ljung and Box weigh the lags by `(n + 2) / (n - k)`, which makes the
//! sum Q nearly chi-square with m degrees of freedom for m lags also for moderate n (G. M. Ljung and G. E. P. Box, *On
//! a measure of lack of fit in time series models*, Biometrika 65, 1978). No degrees are subtracted for the parameters
//! of the model, because it is fitted to the output and not to the autocorrelation of e.
//!
//! With n in the millions, correlations of no practical size are significant. The threshold is therefore at least
//! `small n`, which is reached where `sum_k r_k^2` is about `small`.

use super::compared::Compared;
use super::outcome::{ResidualTest, Significance, WHITENESS, points_to};
use super::significance::{chi_square_tail, exceeded_with};

/// Ljung and Box: `Q = n (n + 2) sum_k r_k^2 / (n - k)` over the first lags of the autocorrelation.
///
/// In white noise, Q is chi-square distributed. In long records Q shows correlations far below any practical size; the
/// threshold is then a part of the variance, `Q / n = sum_k r_k^2`, and there is no p-value.
pub(super) fn whiteness(given: &Compared, output: usize, significance: f64) -> ResidualTest {
    let lags = given.policy.lags;
    let mut covariances = vec![0.0; lags + 1];
    let mut n = 0.0;
    for (residual, experiment) in given.residuals.iter().zip(given.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let values = run.column(output);
            n += values.len() as f64;
            for (lag, sum) in covariances.iter_mut().enumerate().take(values.len()) {
                *sum += (lag..values.len()).map(|k| values[k] * values[k - lag]).sum::<f64>();
            }
        }
    }
    let variance = covariances[0].max(f64::MIN_POSITIVE);
    let sum: f64 = (1..=lags)
        .map(|lag| (covariances[lag] / variance).powi(2) / (n - lag as f64).max(1.0))
        .sum();
    let statistic = n * (n + 2.0) * sum;
    let tail = |value: f64| chi_square_tail(value, lags as f64);
    let (of_noise, of_size) = (exceeded_with(significance, tail), given.policy.small * n);
    // beyond, the question is no longer whether the correlations are zero but whether they are small
    let is_of_noise = of_noise >= of_size;
    ResidualTest {
        name: WHITENESS,
        output,
        statistic,
        threshold: of_noise.max(of_size),
        significance: is_of_noise.then(|| Significance::new(tail, statistic, of_noise)),
        points_to: points_to(WHITENESS, "dynamics that the model lacks"),
    }
}
