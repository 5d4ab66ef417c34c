//! How far a simulation is from a measurement.

use crate::{Matrix, Record};

/// How far a simulation is from a measurement, over all outputs and scored samples.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SimulationError {
    /// Root mean square error, in the output's unit.
    pub rms: f64,
    /// `rms` over the span (largest minus smallest value) of the measured output; with several
    /// outputs, over the root mean square of their spans.
    pub nrmse: f64,
    /// `100 (1 - |y - y_hat| / |y - mean(y)|)`, the fit of MATLAB's `compare`.
    pub fit_percent: f64,
    /// The largest absolute error.
    pub max: f64,
}

impl SimulationError {
    /// The error of residuals (one matrix an experiment) over the scored samples of a record.
    pub fn of(record: &Record, residuals: &[Matrix], remove_mean: bool) -> Self {
        let (mut squares, mut variation, mut span_squares, mut max) = (0.0, 0.0, 0.0, 0.0_f64);
        let count = record.scored() as f64;
        for output in 0..record.outputs().len() {
            let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
            for (experiment, residual) in record.experiments().iter().zip(residuals) {
                let places = || experiment.scored_runs().flatten();
                let total: f64 = places().map(|k| residual[(k, output)]).sum();
                let mean = if remove_mean { total / experiment.scored() as f64 } else { 0.0 };
                for k in places() {
                    let (error, value) = (residual[(k, output)], experiment.output[(k, output)]);
                    squares += (error - mean).powi(2);
                    max = max.max((error - mean).abs());
                    (low, high, sum) = (low.min(value), high.max(value), sum + value);
                }
            }
            let mean = sum / count;
            for experiment in record.experiments() {
                let measured = experiment.output.column(output);
                let scored = experiment.scored_runs().flatten().map(|k| measured[k]);
                variation += scored.map(|value| (value - mean).powi(2)).sum::<f64>();
            }
            span_squares += (high - low).powi(2);
        }
        let outputs = record.outputs().len() as f64;
        let rms = (squares / (count * outputs)).sqrt();
        Self {
            rms,
            nrmse: rms / (span_squares / outputs).sqrt(),
            fit_percent: 100.0 * (1.0 - (squares / variation).sqrt()),
            max,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    #[test]
    fn errors_are_those_of_the_definitions() {
        let channel = |name: &str| vec![Channel::new(name, "")];
        let run = crate::Experiment {
            input: Matrix::zeros(4, 1),
            output: Matrix::from_column_slice(4, 1, &[9.0, 0.0, 2.0, 4.0]),
            covariates: Matrix::zeros(4, 0),
            warmup: 1,
            held_out: vec![],
        };
        let record = Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let residual = [Matrix::from_column_slice(4, 1, &[100.0, 1.0, 1.0, 1.0])];
        let error = SimulationError::of(&record, &residual, false);
        assert_eq!((error.rms, error.nrmse, error.max), (1.0, 0.25, 1.0));
        assert!((error.fit_percent - 100.0 * (1.0 - (3.0_f64 / 8.0).sqrt())).abs() < 1e-12);
        assert_eq!(SimulationError::of(&record, &residual, true).rms, 0.0);
    }
}
