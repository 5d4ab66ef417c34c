//! Units in which every signal has the size one: sums of powers and of products then lose few digits.

use crate::{Error, Matrix, Record};

/// `(x - centre) / scale` of every channel.
pub(crate) struct Units {
    inputs: Vec<[f64; 2]>,
    outputs: Vec<[f64; 2]>,
}

impl Units {
    /// The middle and half the span of each input; mean and standard deviation of each output's scored samples.
    pub(crate) fn of(record: &Record) -> Self {
        let positive = |scale: f64| if scale > 0.0 { scale } else { 1.0 };
        let range = |input: usize| {
            let (low, high) = crate::chain::bounds::range(record, input);
            [0.5 * (low + high), positive(0.5 * (high - low))]
        };
        let moments = |output: usize| {
            let values = || {
                let of = |e: &'_ crate::Experiment| {
                    let column = e.output.column(output).into_owned();
                    e.scored_runs().flatten().map(|k| column[k]).collect::<Vec<f64>>()
                };
                record.experiments().iter().flat_map(of)
            };
            let count = record.scored() as f64;
            let mean = values().sum::<f64>() / count;
            let squares = values().map(|y| (y - mean).powi(2)).sum::<f64>();
            [mean, positive((squares / count).sqrt())]
        };
        Self {
            inputs: (0..record.inputs().len()).map(range).collect(),
            outputs: (0..record.outputs().len()).map(moments).collect(),
        }
    }

    /// A record in these units.
    pub(crate) fn scaled(&self, record: &Record) -> Result<Record, Error> {
        let mut experiments = record.experiments().to_vec();
        for experiment in &mut experiments {
            scale(&mut experiment.input, &self.inputs);
            scale(&mut experiment.output, &self.outputs);
        }
        record.with_experiments(experiments)
    }

    /// Measured minus simulated outputs in the unit of the outputs, of signals in these units.
    pub(super) fn residuals(&self, scaled: &Record, simulated: &[Matrix]) -> Vec<Matrix> {
        let residual = |(experiment, simulated): (&crate::Experiment, &Matrix)| {
            let mut residual = &experiment.output - simulated;
            for (mut column, [_, scale]) in residual.column_iter_mut().zip(&self.outputs) {
                column *= *scale;
            }
            residual
        };
        scaled.experiments().iter().zip(simulated).map(residual).collect()
    }
}

fn scale(signal: &mut Matrix, channels: &[[f64; 2]]) {
    for (mut column, [centre, scale]) in signal.column_iter_mut().zip(channels) {
        column.apply(|x| *x = (*x - centre) / scale);
    }
}
