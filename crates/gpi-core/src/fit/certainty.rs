//! How sure a fit is, under the residual's own autocorrelation.

use super::gather::gather;
use super::minimize::{FitOptions, Fitted};
use super::problem::{Estimation, scored};
use super::representatives::{representatives, streamed};
use crate::chain::point::Point;
use crate::chain::stream::Stream;
use crate::linear::NormalEquations;
use crate::optimize::LeastSquares;
use crate::uncertainty::covariance::{Uncertainty, descending_eigen};
use crate::uncertainty::noise_model::NoiseModel;
use crate::{Error, Matrix, Record};

/// The uncertainty of a fit that left these residuals.
///
/// The noise is modelled as an autoregression `a(q) e = w` of the residual. With R its autocovariance matrix, the
/// score's covariance `J' R J` is the Gram matrix of the sensitivities filtered by 1 / a(q).
pub(crate) fn uncertainty(
    fitted: &Fitted,
    record: &Record,
    options: &FitOptions,
    residuals: Vec<Matrix>,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<Uncertainty, Error> {
    let Fitted { point, linearization, .. } = fitted;
    let problem = Estimation::new(point, record, options.freedom, &options.loss);
    let curvature = options.loss.curvature(scored(&residuals, record));
    let mut weighted = residuals;
    weighted.iter_mut().for_each(|residual| options.loss.apply(residual));
    let noise = NoiseModel::of(&weighted, record);
    drop(weighted);
    let scores = score_gram(point, &problem, &noise, check)?;
    // a weight at zero is not estimated, it is known to be on its bound
    let free = problem.bounds(point).free();
    let samples = (record.scored() * record.outputs().len()) as f64;
    let gram = &linearization.gram * curvature;
    Ok(Uncertainty::new(&gram, &scores, &free, samples, linearization.cost))
}

/// The Gram matrix of the sensitivities filtered by 1 / a(q), weighted with the innovations' covariance.
fn score_gram(
    point: &Point,
    problem: &Estimation,
    noise: &NoiseModel,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<Matrix, Error> {
    let Estimation { record, freedom, loss, table } = problem;
    let outputs = loss.scales.len();
    // the square root of the innovations' covariance mixes the outputs' filtered rows
    let (values, vectors) = descending_eigen(noise.innovations.clone());
    let root = vectors * Matrix::from_diagonal(&values.map(|value| value.max(0.0).sqrt()));
    let mut equations = NormalEquations::zeros(table.len, 1);
    let few = representatives(point, record, table.len);
    for (index, experiment, memory) in streamed(few.as_ref(), record) {
        let stream = Stream::new(point, table, freedom.derivatives, experiment, index)?;
        let mut past: Vec<Matrix> =
            noise.coefficients.iter().map(|a| Matrix::zeros(table.len, a.len())).collect();
        gather(stream.with_memory(memory), check, |rows| {
            let mut filtered = Vec::new();
            for (output, regressor) in rows.regressors.iter().enumerate() {
                let (filter, past) = (&noise.coefficients[output], &mut past[output]);
                let order = filter.len();
                let count = regressor.ncols();
                let mut extended = Matrix::zeros(table.len, order + count);
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
                equations.add(&sum, &none);
            }
        })?;
    }
    if let Some(few) = few {
        few.extend(&mut equations.gram, table, record);
    }
    Ok(equations.gram)
}
