//! Candidates' columns without what the model's own sensitivities can express.
//!
//! For columns C (one a probe, all scored samples of all outputs below each other), sensitivities J and weighted
//! residual e, let Q = J W W' J' be the projection onto what the model can do (see [`Base`]). Then
//!
//! - `left = C' (I - Q) C = C' C - (W' J' C)' (W' J' C)`,
//! - `score = C' (I - Q) e = C' e - (W' J' C)' (W' J' e)`,
//! - `cost = e' (I - Q) e = e' e - |W' J' e|^2`, what a converged model would leave.
//!
//! J has millions of rows and is never stored: it is streamed once, and `J' C`, `C' C` and `C' e` are summed on the
//! way.
//!
//! The first line follows from `(I - Q)' (I - Q) = I - Q`, because Q is symmetric and `W' J' J W = I`. Where squares
//! are scaled by a weight (loss and units of the outputs), every product contains it once: `C' C` stands for
//! `sum_k weight(k) C(k)' C(k)`. With Huber's loss the weights are those at the present residual, and `e' e` is the
//! loss itself, which exceeds the weighted squares; for plain squares both are the same. Where the noise has a memory, C, J
//! and e are what its past does not predict.
//!
//! The difference in `left` loses digits where a candidate is nearly what the model does already. Its columns are left
//! out in [`super::score`] where less than a part of `squares` remains.
//!
//! The memory is (p, n) for n columns and, for one experiment at a time, (samples, n). For loops with many values even
//! that is avoided: their derivatives are unknowns of a model that contains the loop, and C'C, J'C and C'e are blocks
//! of the Gram matrix and of the descent of that larger model.

use super::base::Base;
use crate::chain::free_run::Signals;
use crate::chain::group::Group;
use crate::chain::stream::{Rows, Stream};
use crate::effects::{Effect, Proposal};
use crate::fit::gather::{gather, whitened};
use crate::fit::problem::Estimation;
use crate::optimize::{LeastSquares, Linearization};
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;

/// Makes columns (samples, outputs) of an experiment.
type Columns<'a> = &'a dyn Fn(&Signals, &Matrix, &Experiment, usize) -> Result<Vec<Matrix>, Error>;

/// Columns without what the model's sensitivities can express.
pub(crate) struct Projection {
    /// `C' (I - Q) C`, (columns, columns); known within each group of columns only.
    pub left: Matrix,
    /// `C' (I - Q) e`.
    pub score: DVector<f64>,
    /// Squares of the columns before the projection.
    pub squares: DVector<f64>,
    /// `e' (I - Q) e`.
    pub cost: f64,
}

impl Base<'_> {
    /// Projects columns in groups of so many, each a candidate of its own. `columns` makes them for an experiment from
    /// its signals, its output and its index.
    pub(crate) fn project(&self, groups: &[usize], columns: Columns) -> Result<Projection, Error> {
        let unknowns = self.table.len;
        let n = groups.iter().sum();
        let mut cross = Matrix::zeros(unknowns, n);
        let mut squares = Matrix::zeros(n, n);
        let mut with_residual = DVector::zeros(n);
        for (index, experiment) in self.record.experiments().iter().enumerate() {
            let known = &self.signals[index];
            let here = self.point.output(known, index);
            let columns = columns(known, &here, experiment, index)?.into_iter();
            let columns: Vec<Matrix> =
                columns.map(|column| whitened(column, experiment, self.loss)).collect();
            let places: Vec<usize> = experiment.scored_runs().flatten().collect();
            let mut first = 0;
            let derivatives = self.freedom.derivatives;
            let table = &self.table;
            let stream = Stream::new(self.point, table, derivatives, experiment, index)?;
            gather(stream, self.loss, &mut || Ok(()), |Rows { regressors, residuals, .. }| {
                let count = residuals.ncols();
                let places = &places[first..first + count];
                for (output, regressor) in regressors.iter().enumerate() {
                    let own = Matrix::from_fn(count, n, |row, column| {
                        columns[column][(places[row], output)]
                    });
                    let residual = residuals.row(output).transpose();
                    let weights = residual.map(|value| self.loss.of(output, value).0);
                    let mut weighted = own.clone();
                    for mut column in weighted.column_iter_mut() {
                        column.component_mul_assign(&weights);
                    }
                    cross.gemm(1.0, regressor, &weighted, 1.0);
                    let mut begin = 0;
                    for &size in groups {
                        let (own, weighted) =
                            (own.columns(begin, size), weighted.columns(begin, size));
                        let mut among = squares.view_mut((begin, begin), (size, size));
                        among.gemm_tr(1.0, &own, &weighted, 1.0);
                        begin += size;
                    }
                    with_residual.gemv_tr(1.0, &weighted, &residual, 1.0);
                }
                first += count;
            })?;
        }
        Ok(self.projected(&cross, &squares, with_residual))
    }

    /// Columns by their inner products with the model's sensitivities, with each other and with the residual.
    fn projected(
        &self,
        cross: &Matrix,
        squares: &Matrix,
        with_residual: DVector<f64>,
    ) -> Projection {
        let white = self.whitening.tr_mul(cross);
        let own = self.whitening.tr_mul(&self.linearization.descent);
        Projection {
            left: squares - white.tr_mul(&white),
            score: with_residual - white.tr_mul(&own),
            squares: squares.diagonal(),
            cost: self.linearization.cost - own.norm_squared(),
        }
    }

    /// The same as [`Base::project`] for loops around G, whose columns are the derivatives by their values; `None`
    /// for what has no loops.
    pub(super) fn loops_projected(
        &self,
        candidate: &Proposal<Effect>,
    ) -> Result<Option<Projection>, Error> {
        let point = self.point.with_effect(candidate.block.clone());
        let place = point.effects.iter().position(|own| *own == candidate.block);
        let loops = candidate.block.place().closed_loops();
        let (Some(place), Some(block), true) = (place, loops, candidate.linear) else {
            return Ok(None);
        };
        let mut check = || Ok(());
        let problem = Estimation::new(&point, self.record, self.freedom, self.loss);
        let Linearization { gram, descent, .. } = problem.linearize(&point, &mut check)?;
        let table = problem.table;
        let inserted = table.range(Group::Effect { place });
        let known: Vec<usize> = (0..table.len).filter(|i| !inserted.contains(i)).collect();
        let (values, steps) = (block.values(), block.steps());
        let moved = |probe: &Effect| {
            let pairs = probe.values().into_iter().zip(&values);
            pairs.into_iter().position(|(probe, value)| probe != *value)
        };
        let own: Vec<usize> = candidate.probes.iter().filter_map(moved).collect();
        let n = own.len();
        let unknown = |i: usize| inserted.start + own[i];
        let step = |i: usize| steps[own[i]];
        let cross =
            Matrix::from_fn(known.len(), n, |i, j| gram.get(known[i], unknown(j)) * step(j));
        let squares =
            Matrix::from_fn(n, n, |i, j| gram.get(unknown(i), unknown(j)) * step(i) * step(j));
        let with_residual = DVector::from_fn(n, |i, _| descent[unknown(i)] * step(i));
        Ok(Some(self.projected(&cross, &squares, with_residual)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{model, record, run};
    use crate::chain::point::{DynamicsFreedom, Freedom};
    use crate::chain::sensitivity::Derivatives;
    use crate::effects::{Drives, InnerLoop, Law, Sees, Stiffness};
    use crate::fit::preparation::Prepared;
    use crate::optimize::{Autoregression, Loss};

    #[test]
    fn columns_of_loops_are_their_derivatives() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.0, 100, vec![250..300, 400..420]); 2]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let point = prepared.point_of(&model).unwrap();
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives: Derivatives { thresholds: false, half_widths: false, starts: false },
            states: false,
            identity: true,
            dynamics: DynamicsFreedom::Everything,
        };
        let noise = [&[][..], &[0.8, -0.2]].map(Autoregression::new).to_vec();
        let loss = Loss { scales: vec![1.0, 0.4], noise, ..Loss::squares(2) };
        let base = Base::new(&point, &prepared.record, freedom, &loss).unwrap();
        let inner = |law| InnerLoop {
            sees: Sees::Mixture { states: vec![0.3, 0.5, -0.2], inputs: vec![0.1, 0.2] },
            law,
            drives: Drives::States(vec![0.0; 3]),
        };
        let stops = Law::Stops { half_widths: vec![0.1, 0.6], weights: vec![0.5, 1.0] };
        let square = Law::Power { exponent: 2, scale: 1.5 };
        let block = Stiffness { loops: vec![inner(stops), inner(square)] };
        // drives of the first loop, and of the second behind what the first one sees and weighs
        let candidate =
            Proposal::all(vec![Proposal::linear(block, (0..3).chain(12..15))]).remove(0);
        let found = base.loops_projected(&candidate).unwrap().unwrap();
        let columns = |known: &Signals, here: &Matrix, own: &Experiment, index: usize| {
            let gained = |probe: &Effect| point.gained_by(probe, known, here, own, index);
            candidate.probes.iter().map(gained).collect()
        };
        let expected = base.project(&[candidate.probes.len()], &columns).unwrap();
        for i in 0..candidate.probes.len() {
            let size = expected.squares[i];
            assert!(size > 0.0);
            assert!((found.squares[i] - size).abs() < 1e-5 * size, "{i}");
            assert!((found.left[(i, i)] - expected.left[(i, i)]).abs() < 1e-5 * size, "{i}");
            let scale = (size * expected.cost).sqrt();
            assert!((found.score[i] - expected.score[i]).abs() < 1e-5 * scale, "{i}");
        }
    }
}
