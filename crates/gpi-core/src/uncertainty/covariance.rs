//! How far the estimates may be from the truth: the covariance of a least squares fit under coloured
//! noise.

use crate::chain::point::{Bounds, Freedom, Layout, Point};
use crate::chain::stream::Stream;
use crate::fit::linearization::{Weighting, gather};
use crate::fit::minimize::{FitOptions, Fitted};
use crate::fit::representatives::{representatives, streamed};
use crate::linear::{NormalEquations, symmetric_eigen};
use crate::uncertainty::noise_model::Colour;
use crate::{Error, Matrix, Record};
use nalgebra::DVector;

/// Covariance of the unknowns of a [`Layout`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Uncertainty {
    /// (unknowns, unknowns); zero for those that are held.
    pub covariance: Matrix,
    /// Directions that the data do not determine, (unknowns, directions), of unit length after scaling
    /// every unknown by its column's norm.
    pub open: Matrix,
    /// Parameters that the fit has used up, counted in samples of white noise: `tr(H^-1 M) / variance`.
    pub used: f64,
    /// Parameters that are free: neither held nor at a bound.
    pub estimated: usize,
}

/// Directions whose eigenvalue is below this fraction of the largest, in columns scaled to one length,
/// are not determined by the data.
const IDENTIFIABLE: f64 = 1e-12;

impl Uncertainty {
    /// `H^-1 M H^-1` with H the Gram matrix of the sensitivities and M that of the score under the
    /// residual's colour: with R the autocovariance of an autoregression 1 / a(q), `J^T R J` is the
    /// Gram matrix of the sensitivities filtered by 1 / a(q).
    pub(crate) fn new(
        fitted: &Fitted,
        record: &Record,
        options: &FitOptions,
        residuals: Vec<Matrix>,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let (Fitted { point, linearization, .. }, FitOptions { freedom, weighting, .. }) =
            (fitted, options);
        let layout = &linearization.layout;
        let curvature = weighting.curvature(&residuals, record);
        let mut weighted = residuals;
        weighted.iter_mut().for_each(|residual| weighting.apply(residual));
        let colour = Colour::of(&weighted, record);
        drop(weighted);
        let scores = score_gram(point, record, *freedom, weighting, &colour, check)?;
        let Bounds { lower, upper } = point.bounds(layout, record, *freedom);
        // A weight at zero is not estimated, it is known to be on its bound.
        let free: Vec<usize> =
            (0..layout.len).filter(|&i| lower[i] < 0.0 && upper[i] > 0.0).collect();
        let reduce = |matrix: &Matrix| {
            Matrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])])
        };
        let gram = reduce(&linearization.equations.gram) * curvature;
        let scores = reduce(&scores);
        let scale = gram.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let scaled = |m: &Matrix| {
            Matrix::from_fn(free.len(), free.len(), |i, j| m[(i, j)] / (scale[i] * scale[j]))
        };
        let (values, vectors) = descending_eigen(scaled(&gram));
        let largest = values.iter().copied().fold(0.0, f64::max);
        let rank = values.iter().take_while(|&&value| value > IDENTIFIABLE * largest).count();
        let known = vectors.columns(0, rank);
        let inverse = known
            * Matrix::from_diagonal(&values.rows(0, rank).map(|v| 1.0 / v))
            * known.transpose();
        let scores = scaled(&scores);
        let samples = (record.scored() * record.outputs().len()) as f64;
        let used =
            (&inverse * &scores).trace() * samples / linearization.cost.max(f64::MIN_POSITIVE);
        let reduced = &inverse * scores * &inverse;
        let mut covariance = Matrix::zeros(layout.len, layout.len);
        for (i, &row) in free.iter().enumerate() {
            for (j, &column) in free.iter().enumerate() {
                covariance[(row, column)] = reduced[(i, j)] / (scale[i] * scale[j]);
            }
        }
        let mut open = Matrix::zeros(layout.len, free.len() - rank);
        for direction in rank..free.len() {
            for (i, &row) in free.iter().enumerate() {
                open[(row, direction - rank)] = vectors[(i, direction)];
            }
        }
        Ok(Self { covariance, open, used, estimated: free.len() })
    }

    /// Standard deviations of the unknowns; NaN where an undetermined direction takes part.
    pub(crate) fn deviations(&self) -> DVector<f64> {
        /// A share of an undetermined direction that rounding alone does not give.
        const SHARE: f64 = 1e-3;
        DVector::from_fn(self.covariance.nrows(), |i, _| {
            let open = self.open.row(i).amax() > SHARE;
            if open { f64::NAN } else { self.covariance[(i, i)].max(0.0).sqrt() }
        })
    }

    /// Names and shares of the unknowns in every direction that the data do not determine, the largest
    /// first.
    pub(crate) fn undetermined(&self, names: &[String]) -> Vec<Vec<(String, f64)>> {
        /// Smaller shares than this do not help to see what is mixed up.
        const SHARE: f64 = 0.05;
        let direction = |column: nalgebra::DVectorView<f64>| {
            let mut shares: Vec<_> = names
                .iter()
                .cloned()
                .zip(column.iter().copied())
                .filter(|(_, s)| s.abs() > SHARE)
                .collect();
            shares.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            shares
        };
        self.open.column_iter().map(direction).collect()
    }

    /// Standard deviations of functions of the point, from central differences along the principal
    /// axes of the covariance.
    ///
    /// `values` are those of the unknowns: a step stays far below them, also along an axis on which the
    /// data determine nothing.
    pub(crate) fn spread(
        &self,
        values_of: &[f64],
        moved: impl Fn(&DVector<f64>) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<f64>, Error> {
        /// Fraction of a standard deviation: small enough to be linear, far above rounding.
        const STEP: f64 = 1e-2;
        const FAR_BELOW: f64 = 1e-5;
        let largest = values_of.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let reach = |value: f64| FAR_BELOW * value.abs().max(1e-4 * largest);
        // Zero for an unknown that is held: rounding must not move it off its place, such as the
        // threshold zero, on whose two sides the deadzone is another one.
        let scale = self.covariance.diagonal().map(|square| square.max(0.0).sqrt());
        let divisor = scale.map(|value| if value > 0.0 { value } else { 1.0 });
        let n = scale.len();
        let correlation =
            Matrix::from_fn(n, n, |i, j| self.covariance[(i, j)] / (divisor[i] * divisor[j]));
        let (values, vectors) = descending_eigen(correlation);
        let mut variances: Vec<f64> = Vec::new();
        for (axis, &value) in values.iter().enumerate().take_while(|(_, value)| **value > 1e-14) {
            let deviation = vectors.column(axis).component_mul(&scale) * value.sqrt();
            let parts = deviation.iter().zip(values_of);
            let fraction = parts
                .filter(|(part, _)| **part != 0.0)
                .map(|(part, value)| reach(*value) / part.abs())
                .fold(STEP, f64::min);
            let step = deviation * fraction;
            let (above, below) = (moved(&step)?, moved(&-step)?);
            variances.resize(above.len(), 0.0);
            for (sum, (above, below)) in variances.iter_mut().zip(above.iter().zip(&below)) {
                *sum += ((above - below) / (2.0 * fraction)).powi(2);
            }
        }
        Ok(variances.into_iter().map(f64::sqrt).collect())
    }
}

/// The Gram matrix of the sensitivities filtered by 1 / a(q), weighted with the innovations' covariance.
fn score_gram(
    point: &Point,
    record: &Record,
    freedom: Freedom,
    weighting: &Weighting,
    colour: &Colour,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<Matrix, Error> {
    let layout = Layout::new(point, freedom);
    let outputs = weighting.outputs.len();
    // the square root of the innovations' covariance mixes the outputs' filtered rows
    let (values, vectors) = descending_eigen(colour.innovations.clone());
    let root = vectors * Matrix::from_diagonal(&values.map(|value| value.max(0.0).sqrt()));
    let mut equations = NormalEquations::zeros(layout.len, 1);
    let few = representatives(point, record, layout.len);
    for (index, experiment, memory) in streamed(few.as_ref(), record) {
        let stream = Stream::new(point, &layout, freedom.derivatives, experiment, index)?;
        let mut past: Vec<Matrix> =
            colour.coefficients.iter().map(|a| Matrix::zeros(layout.len, a.len())).collect();
        gather(stream.with_memory(memory), check, |rows| {
            let mut filtered = Vec::new();
            for (output, regressor) in rows.regressors.iter().enumerate() {
                let (filter, past) = (&colour.coefficients[output], &mut past[output]);
                let order = filter.len();
                let count = regressor.ncols();
                let mut extended = Matrix::zeros(layout.len, order + count);
                extended.columns_mut(0, order).copy_from(past);
                for k in 0..count {
                    let mut row = regressor.column(k).into_owned();
                    row *= weighting.outputs[output];
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
        few.extend(&mut equations.gram, &layout, record);
    }
    Ok(equations.gram)
}

/// Eigenvalues (descending) and eigenvectors of a symmetric matrix: of a small one by nalgebra, since faer keeps
/// a workspace of megabytes, more than a record may take.
pub(crate) fn descending_eigen(matrix: Matrix) -> (DVector<f64>, Matrix) {
    const LARGE: usize = 300;
    let n = matrix.nrows();
    if n > LARGE
        && let Ok(found) = symmetric_eigen(&matrix)
    {
        return found;
    }
    let eigen = matrix.symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let values = DVector::from_fn(n, |i, _| eigen.eigenvalues[order[i]]);
    (values, eigen.eigenvectors.select_columns(&order))
}
