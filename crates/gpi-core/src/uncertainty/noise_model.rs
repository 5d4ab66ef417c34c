//! The residual's own autocorrelation, as an autoregression.

use super::settings::NoiseModelSettings;
use crate::{Matrix, Record};
use nalgebra::DVector;

/// `e(k) = sum_i a_i e(k-i) + w(k)` for each output, with w white but correlated between outputs.
#[derive(Clone, Debug)]
pub(crate) struct NoiseModel {
    /// a_1, a_2, .. of each output.
    pub coefficients: Vec<Vec<f64>>,
    /// Covariance of w, (outputs, outputs).
    pub innovations: Matrix,
}

impl NoiseModel {
    /// Fits orders up to 30 by Levinson and Durbin's recursion to the scored samples; each output takes
    /// the order with the least BIC.
    pub(crate) fn of(residuals: &[Matrix], record: &Record) -> Self {
        let outputs = residuals[0].ncols();
        let samples = record.scored();
        let scored = || {
            let pairs = residuals.iter().zip(record.experiments());
            pairs.flat_map(|(residual, experiment)| experiment.scored_rows(residual))
        };
        let settings = NoiseModelSettings::default();
        let longest = settings.order.min(samples / settings.samples);
        let coefficients: Vec<Vec<f64>> = (0..outputs)
            .map(|output| {
                let mut covariances = vec![0.0; longest + 1];
                for residual in scored() {
                    let values = residual.column(output);
                    for (lag, sum) in covariances.iter_mut().enumerate().take(values.len()) {
                        *sum +=
                            (lag..values.len()).map(|k| values[k] * values[k - lag]).sum::<f64>();
                    }
                }
                levinson(&covariances, samples)
            })
            .collect();
        let mut innovations = Matrix::zeros(outputs, outputs);
        let mut white = DVector::zeros(outputs);
        for residual in scored() {
            for k in 0..residual.nrows() {
                for (output, filter) in coefficients.iter().enumerate() {
                    let past = (1..=k).zip(filter);
                    let predicted: f64 = past.map(|(lag, a)| a * residual[(k - lag, output)]).sum();
                    white[output] = residual[(k, output)] - predicted;
                }
                innovations.ger(1.0, &white, &white, 1.0);
            }
        }
        Self { coefficients, innovations: innovations / samples as f64 }
    }
}

impl NoiseModel {
    /// Prediction errors of the residuals; the first samples, which cannot be predicted, are zero.
    pub(crate) fn whiten(&self, residuals: &[Matrix]) -> Vec<Matrix> {
        let whiten = |residual: &Matrix| {
            Matrix::from_fn(residual.nrows(), residual.ncols(), |k, output| {
                let filter = &self.coefficients[output];
                if k < filter.len() {
                    return 0.0;
                }
                let past = filter.iter().zip(1..).map(|(a, lag)| a * residual[(k - lag, output)]);
                residual[(k, output)] - past.sum::<f64>()
            })
        };
        residuals.iter().map(whiten).collect()
    }
}

/// The autoregression with the least BIC.
fn levinson(covariances: &[f64], samples: usize) -> Vec<f64> {
    let NoiseModelSettings { rounding, .. } = NoiseModelSettings::default();
    let mut filter: Vec<f64> = Vec::new();
    let mut variance = covariances[0];
    let penalty = (samples.max(2) as f64).ln();
    let criterion = |variance: f64, order: usize| {
        samples as f64 * variance.max(f64::MIN_POSITIVE).ln() + order as f64 * penalty
    };
    let mut best = (criterion(variance, 0), filter.clone());
    for order in 1..covariances.len() {
        // A residual without noise, or rounding on one that is predicted exactly.
        if variance <= rounding * covariances[0] || variance <= 0.0 {
            break;
        }
        let predicted: f64 =
            filter.iter().enumerate().map(|(i, a)| a * covariances[order - 1 - i]).sum();
        let reflection = (covariances[order] - predicted) / variance;
        let reversed: Vec<f64> = filter.iter().rev().copied().collect();
        filter.iter_mut().zip(reversed).for_each(|(a, mirror)| *a -= reflection * mirror);
        filter.push(reflection);
        variance *= 1.0 - reflection * reflection;
        let value = criterion(variance, order);
        if value < best.0 {
            best = (value, filter.clone());
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_recovered() {
        // covariances of e(k) = 0.9 e(k-1) - 0.2 e(k-2) + w, from the Yule-Walker equations
        let first = 0.9 / 1.2;
        let mut covariances = vec![1.0, first];
        for lag in 2..20 {
            covariances.push(0.9 * covariances[lag - 1] - 0.2 * covariances[lag - 2]);
        }
        let filter = levinson(&covariances, 1000);
        assert_eq!(filter.len(), 2);
        assert!((filter[0] - 0.9).abs() < 1e-12 && (filter[1] + 0.2).abs() < 1e-12);
        assert!(levinson(&[2.0, 0.01, -0.01], 1000).is_empty());
    }
}
