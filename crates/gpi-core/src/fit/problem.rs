//! The estimation of a point on a record, as a least squares problem.
//!
//! The residuals are those of the free run, `e(k) = y(k) - y_hat(k; theta)` (outputs) at all N scored samples k. With
//! `psi_o(k) = d y_hat_o(k) / d theta` (unknowns) of output o and weights `w_o(k) = s_o^2 min(1, t_o / |e_o(k)|)` of the loss (s
//! the scale of the output, t the residual at which Huber's loss becomes linear, infinite for least squares):
//!
//! ```text
//! cost    = sum_k,o rho_o(e_o(k))                      rho the loss: s^2 e^2 up to |e| = t
//! descent = sum_k,o w_o(k) psi_o(k) e_o(k)             (unknowns), minus half the gradient
//! gram    = sum_k,o w_o(k) psi_o(k) psi_o(k)'          (unknowns, unknowns), half the Gauss-Newton Hessian
//! ```
//!
//! The offset and the initial state of an experiment move its own output only. The products of an experiment are therefore
//! those of the shared unknowns and its own ones, and the Gram matrix of all unknowns has the shape of an arrow.
//!
//! Where something has a prior ([`crate::chain::prior`]), its terms are added to all three.
//!
//! Where the noise has a memory ([`Loss`]), e and psi are those that its past does not predict.
//!
//! psi is never stored: its rows are streamed through the chain in blocks, each block is added to `gram` and
//! `descent`, and the memory needed does not grow with N times unknowns. Where the Gram matrix of a whole record would
//! take long, it comes from a part of it (see [`representatives`]) and the gradient from an adjoint pass, which costs a
//! few simulations whatever the number of unknowns. Source: J. Nocedal and S. Wright, Numerical Optimization, 2006,
//! chapter 10; the weights are those of iteratively reweighted least squares.

use super::gather::gather;
use super::representatives::{representatives, streamed};
use super::settings::ROUNDING;
use crate::chain::adjoint::descent;
use crate::chain::point::{Freedom, Point};
use crate::chain::stream::{Rows, Stream};
use crate::chain::table::Table;
use crate::linear::{Arrow, NormalEquations};
use crate::optimize::{Bounds, LeastSquares, Linearization, Loss};
use crate::{Error, Matrix, Record};
use nalgebra::{DMatrixView, DVector};

/// What is free of a point, on which record, and how residuals count.
pub(crate) struct Estimation<'a> {
    pub record: &'a Record,
    pub freedom: Freedom,
    pub loss: &'a Loss,
    pub table: Table,
}

impl<'a> Estimation<'a> {
    /// For points of the structure of `point`.
    pub(crate) fn new(point: &Point, record: &'a Record, freedom: Freedom, loss: &'a Loss) -> Self {
        Self { record, freedom, loss, table: Table::new(point, freedom) }
    }

    /// The same problem with unknowns as a solver needs them.
    pub(crate) fn for_solver(mut self, point: &Point) -> Self {
        let bounds = self.bounds(point);
        self.table = self.table.for_solver(point, &bounds);
        self
    }
}

impl LeastSquares for Estimation<'_> {
    type Point = Point;
    type Error = Error;

    fn evaluate(&self, point: &Point) -> Result<f64, Error> {
        let cost = self.loss.cost(scored(&point.residuals(self.record)?, self.record));
        Ok(cost + point.penalty(&self.table))
    }

    /// Where the derivatives of a whole record would take long, the curvature is that of a few experiments; the
    /// gradient is always that of the whole record.
    fn linearize(
        &self,
        point: &Point,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Linearization, Error> {
        let few = representatives(point, self.record, self.table.len);
        let mut gram = Arrow::zeros(self.table.len, self.table.own());
        let mut descent = DVector::zeros(self.table.len);
        let mut cost = 0.0;
        for (index, experiment, memory) in streamed(few.as_ref(), self.record) {
            check()?;
            let (own, places) = self.table.of_experiment(index);
            let wanted = self.freedom.derivatives;
            let stream = Stream::new(point, &own, wanted, experiment, index)?;
            let mut part = NormalEquations::zeros(own.len, 1);
            gather(stream.with_memory(memory), self.loss, check, |rows| {
                cost += add(&mut part, rows, self.loss);
            })?;
            gram.add_part(&part.gram, &places);
            places.iter().zip(part.rhs.iter()).for_each(|(&i, value)| descent[i] += value);
        }
        let Some(few) = few else {
            point.curve(&self.table, &mut gram);
            let penalty = point.penalise(&self.table, &mut descent);
            return Ok(Linearization { gram, descent, cost: cost + penalty, age: None });
        };
        let mut gram = gram.to_dense();
        few.extend(&mut gram, &self.table, self.record);
        let mut gram = gram.into();
        point.curve(&self.table, &mut gram);
        let (descent, cost) = self.gradient(point, check)?;
        Ok(Linearization { gram, descent, cost, age: Some(0) })
    }

    fn gradient(
        &self,
        point: &Point,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<(DVector<f64>, f64), Error> {
        let (mut descent, cost) =
            descent(point, &self.table, self.freedom, self.loss, self.record, check)?;
        let penalty = point.penalise(&self.table, &mut descent);
        Ok((descent, cost + penalty))
    }

    fn bounds(&self, point: &Point) -> Bounds {
        point.bounds(&self.table, self.record, self.freedom)
    }

    fn step(&self, point: &Point, step: &DVector<f64>) -> Point {
        let mut moved = point.moved(step, &self.table);
        if self.table.has_whole_states() {
            moved.keep_whole_states(point, self.record);
        }
        moved
    }

    fn is_linear(&self, unknown: usize) -> bool {
        self.table.is_linear(unknown)
    }

    /// What rounding leaves of the outputs' squares.
    fn rounding(&self) -> f64 {
        let outputs = self.record.experiments().iter().flat_map(|e| e.output.column_iter());
        let scales = self.loss.scales.iter().cycle();
        ROUNDING
            * outputs.zip(scales).map(|(y, scale)| scale.powi(2) * y.norm_squared()).sum::<f64>()
    }
}

/// The scored rows of residuals, one matrix an experiment.
pub(crate) fn scored<'a>(
    residuals: &'a [Matrix],
    record: &'a Record,
) -> impl Iterator<Item = DMatrixView<'a, f64>> {
    let runs = residuals.iter().zip(record.experiments());
    runs.flat_map(|(residual, experiment)| experiment.scored_rows(residual))
}

/// Root mean square of the scored residual of each output.
pub(crate) fn residual_rms(residuals: &[Matrix], record: &Record) -> Vec<f64> {
    let squares = |output: usize| -> f64 {
        scored(residuals, record).map(|run| run.column(output).norm_squared()).sum()
    };
    let rms = |output: usize| (squares(output) / record.scored() as f64).sqrt();
    (0..record.outputs().len()).map(rms).collect()
}

/// Adds a block of rows to the equations; returns its cost.
fn add(equations: &mut NormalEquations, rows: Rows, loss: &Loss) -> f64 {
    let mut cost = 0.0;
    for (output, mut regressor) in rows.regressors.into_iter().enumerate() {
        let mut target = rows.residuals.row(output).into_owned();
        for (mut row, value) in regressor.column_iter_mut().zip(target.iter_mut()) {
            let (weight, own) = loss.of(output, *value);
            cost += own;
            row *= weight.sqrt();
            *value *= weight.sqrt();
        }
        let target = Matrix::from_row_slice(1, target.len(), target.as_slice());
        equations.add(&regressor, &target);
    }
    cost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::hysteresis::Prior;
    use crate::chain::looped::{fine, model, record, run};
    use crate::chain::point::DynamicsFreedom;
    use crate::chain::sensitivity::Derivatives;
    use crate::fit::preparation::Prepared;
    use crate::optimize::Autoregression;

    #[test]
    fn gradient_is_the_one_that_all_derivatives_give() {
        compare(&model());
        compare(&fine());
    }

    fn compare(model: &Model) {
        // one with a run-in from rest, and one of unknown initial state that holds samples out
        let runs = vec![run(1.5, 0.0, 130, vec![]), run(1.5, 0.3, 0, vec![300..420, 500..520])];
        let record = record(model, runs);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::scoring_all(&record, channels).unwrap();
        let mut point = prepared.point_of(model).unwrap();
        point.channels[0].prior = Prior { weights: 0.3, slopes: 0.2 };
        point.dynamics.delay = 2;
        point.pasts[1].state.iter_mut().enumerate().for_each(|(j, x)| *x = 0.1 * (j + 1) as f64);
        point.pasts[1].gaps[1] = 0.3;
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives: Derivatives { thresholds: true, half_widths: true, starts: true },
            states: true,
            identity: true,
            dynamics: DynamicsFreedom::Everything,
        };
        for coefficients in [&[][..], &[0.9, -0.3, 0.1]] {
            let noise = [coefficients, &[]].map(Autoregression::new).to_vec();
            let loss = Loss { scales: vec![1.0, 0.4], turns: vec![0.8, f64::INFINITY], noise };
            compare_with(&point, &prepared.record, freedom, &loss);
        }
    }

    fn compare_with(point: &Point, record: &Record, freedom: Freedom, loss: &Loss) {
        let mut check = || Ok(());
        let problem = Estimation::new(point, record, freedom, loss);
        let all = problem.linearize(point, &mut check).unwrap();
        let (found, cost) = problem.gradient(point, &mut check).unwrap();
        assert!((problem.evaluate(point).unwrap() / all.cost - 1.0).abs() < 1e-12);
        compare_gradients(&all, &found, cost);
        // as a solver needs them: all coefficients of sections of two poles, and what loops drive and begin with
        let problem = problem.for_solver(point);
        let mut all = problem.linearize(point, &mut check).unwrap();
        let (found, cost) = problem.gradient(point, &mut check).unwrap();
        compare_gradients(&all, &found, cost);
        assert!(problem.table.pairs().len() > 3);
        let step = DVector::from_fn(found.len(), |i, _| 1e-3 * (i as f64).sin());
        let values = |point: &Point| DVector::from_vec(problem.table.values(point));
        let difference = values(&point.moved(&step, &problem.table)) - values(point);
        for &i in problem.table.pairs().iter().flatten() {
            assert!((difference[i] - step[i]).abs() < 1e-13);
        }
        // back to the coefficients of powers of z
        let table = problem.table.clone().undo_delta_form(&mut all);
        assert!(table.pairs().is_empty());
        let same = Estimation { table, ..problem }.linearize(point, &mut check).unwrap();
        let scale = all.gram.diagonal().map(f64::sqrt);
        let [one, other] = [&all, &same].map(|own| own.gram.scaled(&scale).to_dense());
        assert!((one - other).amax() < 1e-12);
        let descent = (all.descent - same.descent).component_div(&scale);
        assert!(descent.amax() < 1e-11 * all.cost.sqrt());
    }

    fn compare_gradients(all: &Linearization, found: &DVector<f64>, cost: f64) {
        let expected = &all.descent;
        assert!((cost / all.cost - 1.0).abs() < 1e-12);
        assert!(
            expected.iter().filter(|value| value.abs() > 1e-6).count() > expected.len() * 9 / 10
        );
        for (i, (found, expected)) in found.iter().zip(expected.iter()).enumerate() {
            let scale = (all.gram.get(i, i) * all.cost).sqrt();
            assert!((found - expected).abs() <= 1e-11 * scale, "{i}: {found} {expected}");
        }
    }
}
