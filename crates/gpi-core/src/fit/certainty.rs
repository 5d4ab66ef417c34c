//! The uncertainty of a fit, under the residual's own autocorrelation.
//!
//! With weighted residuals `e_o(k)`, sensitivities `psi_o(k)` (unknowns) and `H = sum psi psi'` (unknowns, unknowns), an
//! estimate near the truth differs from it by `H^-1 sum psi e`. Its covariance is thus `H^-1 M H^-1`, with the score's
//! covariance `M = J' R J`, J all rows psi' and R the autocovariance matrix of e (L. Ljung, System Identification, 1999,
//! section 9.2). R is not formed (samples times samples): each output's residual is modelled as an autoregression,
//!
//! ```text
//! a_o(q) e_o(k) = w_o(k),   a_o(q) = 1 - a_o1 q^-1 - .. - a_op q^-p,   cov w = S S' (outputs, outputs)
//! ```
//!
//! so that `R = A^-1 S S' A^-T`, A the Toeplitz matrix of the a_o, and `M` is the Gram matrix of the rows
//! `S' A^-T psi`: the sensitivities filtered by the noise model and mixed by S. On a stationary record it does not matter
//! whether they are filtered forwards or backwards in time.

use super::gather::gather;
use super::minimize::{FitOptions, Fitted};
use super::problem::{Estimation, scored};
use super::representatives::{representatives, streamed};
use crate::chain::point::Point;
use crate::chain::stream::Stream;
use crate::linear::{Arrow, NormalEquations};
use crate::optimize::LeastSquares;
use crate::uncertainty::covariance::Uncertainty;
use crate::uncertainty::eigen::descending_eigen;
use crate::uncertainty::noise_model::NoiseModel;
use crate::uncertainty::settings::UncertaintySettings;
use crate::{Error, Matrix, Record};
use nalgebra::DVector;

/// The uncertainty of a fit that left these residuals. Where the fit weighed them by the noise's memory, e and psi are what the
/// past does not predict.
///
/// Where Huber's loss was used, H is scaled by the loss' mean second derivative over its mean weight.
pub(crate) fn uncertainty(
    fitted: &Fitted,
    record: &Record,
    options: &FitOptions,
    residuals: Vec<Matrix>,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<Uncertainty, Error> {
    let settings = UncertaintySettings::default();
    settings.validate()?;
    let Fitted { point, linearization, table, .. } = fitted;
    let (freedom, loss) = (options.freedom, &options.loss);
    let problem = Estimation { record, freedom, loss, table: table.clone() };
    let mut weighted = options.loss.all_errors(&residuals);
    drop(residuals);
    let curvature = options.loss.curvature(scored(&weighted, record));
    weighted.iter_mut().for_each(|residual| options.loss.apply(residual));
    let noise = NoiseModel::of(&weighted, record);
    drop(weighted);
    let scores = score_gram(point, &problem, &noise, check)?;
    // a weight at zero is not estimated, it is known to be on its bound
    let free = problem.bounds(point).free();
    let samples = (record.scored() * record.outputs().len()) as f64;
    let root = DVector::from_element(linearization.gram.len(), curvature.sqrt().recip());
    let gram = linearization.gram.scaled(&root);
    Ok(Uncertainty::new(settings.covariance, &gram, &scores, &free, samples, linearization.cost))
}

/// The Gram matrix of the sensitivities filtered by 1 / a(q), weighted with the innovations' covariance.
fn score_gram(
    point: &Point,
    problem: &Estimation,
    noise: &NoiseModel,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<Arrow, Error> {
    let Estimation { record, freedom, loss, table } = problem;
    let outputs = loss.scales.len();
    // the square root of the innovations' covariance mixes the outputs' filtered rows
    let (values, vectors) = descending_eigen(noise.innovations.clone());
    let root = vectors * Matrix::from_diagonal(&values.map(|value| value.max(0.0).sqrt()));
    let mut scores = Arrow::zeros(table.len, table.own());
    let few = representatives(point, record, table.len);
    for (index, experiment, memory) in streamed(few.as_ref(), record) {
        let (own, places) = table.of_experiment(index);
        let stream = Stream::new(point, &own, freedom.derivatives, experiment, index)?;
        let mut part = NormalEquations::zeros(own.len, 1);
        let mut past: Vec<Matrix> =
            noise.coefficients.iter().map(|a| Matrix::zeros(own.len, a.len())).collect();
        gather(stream.with_memory(memory), loss, check, |rows| {
            let mut filtered = Vec::new();
            for (output, regressor) in rows.regressors.into_iter().enumerate() {
                let (filter, past) = (&noise.coefficients[output], &mut past[output]);
                let order = filter.len();
                let count = regressor.ncols();
                let mut extended = Matrix::zeros(own.len, order + count);
                extended.columns_mut(0, order).copy_from(past);
                for k in 0..count {
                    let mut row = regressor.column(k).into_owned();
                    row *= loss.scales[output];
                    for (lag, &a) in filter.iter().enumerate() {
                        row.axpy(a, &extended.column(order + k - 1 - lag), 1.0);
                    }
                    extended.set_column(order + k, &row);
                }
                past.copy_from(&extended.columns(count, order));
                filtered.push(extended.columns(order, count).into_owned());
            }
            let none = Matrix::zeros(1, rows.residuals.ncols());
            for mixed in 0..outputs {
                let mut sum = &filtered[0] * root[(0, mixed)];
                for (output, part) in filtered.iter().enumerate().skip(1) {
                    sum += part * root[(output, mixed)];
                }
                part.add(&sum, &none);
            }
        })?;
        scores.add_part(&part.gram, &places);
    }
    let Some(few) = few else { return Ok(scores) };
    let mut scores = scores.to_dense();
    few.extend(&mut scores, table, record);
    Ok(scores.into())
}
