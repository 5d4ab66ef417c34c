//! A point run free over the record, and the model that it is.

use super::point::{Past, Point};
use super::sensitivity::Parameters;
use super::stream::hats;
use crate::linear::Sections;
use crate::{Error, Matrix, Model, Record};
use nalgebra::{DVector, RowDVector};

impl Point {
    /// Other dynamics, which stood still before the record.
    pub(super) fn replace_dynamics(&mut self, dynamics: Sections) {
        for past in &mut self.pasts {
            past.state = DVector::zeros(dynamics.order());
        }
        self.dynamics = dynamics;
    }

    /// The intermediate signals v (samples, inputs) of an experiment's input.
    pub(super) fn intermediate(&self, input: &Matrix, past: &Past) -> Matrix {
        let mut v = input.clone();
        let columns = v.as_mut_slice().chunks_exact_mut(input.nrows());
        for ((input, channel), column) in self.channels.iter().enumerate().zip(columns) {
            channel.apply(past.plays.as_ref().map(|plays| &plays[input][..]), column);
        }
        v
    }

    /// Measured minus simulated outputs of each experiment, (samples, outputs), warm-ups included.
    pub(super) fn residuals(&self, record: &Record) -> Result<Vec<Matrix>, Error> {
        let linear = self.dynamics.to_state_space()?;
        let delayed = linear.order() - self.dynamics.order();
        let runs = record.experiments().iter().zip(&self.pasts).zip(&self.offsets);
        runs.map(|((experiment, past), offsets)| {
            let samples = experiment.input.nrows();
            let v = self.intermediate(&experiment.input, past);
            let mut state = linear.equilibrium(&v.row(0).transpose());
            let mut residual = &experiment.output - linear.simulate_from(&mut state, &v)?;
            let mut free = DVector::zeros(linear.order());
            free.rows_mut(delayed, past.state.len()).copy_from(&past.state);
            for k in 0..samples {
                if past.moving && k >= experiment.warmup {
                    let mut row = residual.row_mut(k);
                    row -= (linear.c() * &free).transpose();
                    free = linear.a() * free;
                }
                for (knot, weight) in hats(k, samples, offsets.nrows()) {
                    let mut row = residual.row_mut(k);
                    row -= weight * offsets.row(knot);
                }
            }
            Ok(residual)
        })
        .collect()
    }

    /// The mean additive term of each output, experiments counted by their scored samples.
    pub(super) fn mean_offsets(&self, record: &Record) -> RowDVector<f64> {
        let scored = record.scored() as f64;
        let parts = record.experiments().iter().zip(&self.offsets).map(|(e, knots)| {
            // the mean of a piecewise linear function: the end knots count half
            let n = knots.nrows();
            let weight = |knot: usize| if knot == 0 || knot + 1 == n { 0.5 } else { 1.0 };
            let total: f64 = (0..n).map(weight).sum();
            let rows = (0..n).map(|knot| knots.row(knot) * (weight(knot) / total));
            rows.fold(RowDVector::zeros(knots.ncols()), |sum, row| sum + row)
                * ((e.input.nrows() - e.warmup) as f64 / scored)
        });
        parts.fold(RowDVector::zeros(self.dynamics.outputs()), |sum, part| sum + part)
    }

    /// The model, with the channels of the record `given`; `means` were taken from its outputs.
    pub(super) fn to_model(
        &self,
        given: &Record,
        record: &Record,
        means: &[f64],
    ) -> Result<Model, Error> {
        let hysteresis: Result<_, _> = self.channels.iter().map(Parameters::to_operator).collect();
        let (inputs, outputs) = (given.inputs().to_vec(), given.outputs().to_vec());
        let rest = self.mean_offsets(record);
        let offsets = means.iter().zip(rest.iter()).map(|(mean, rest)| mean + rest);
        let linear = self.dynamics.to_state_space()?;
        Model::new(given.rate(), inputs, outputs, hysteresis?, linear, offsets.collect())
    }
}
