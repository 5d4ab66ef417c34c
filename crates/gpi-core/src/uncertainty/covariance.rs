//! The covariance of a least squares fit under autocorrelated noise.
//!
//! With H the Gram matrix of the sensitivities and M the score's covariance (both (unknowns, unknowns), see
//! `fit/certainty.rs`) the covariance of the estimate is `C = H^-1 M H^-1`. Units must not decide what is identifiable, so
//! rows and columns are scaled by `s_i = sqrt(H_ii)` first: `H_ij / (s_i s_j) = V L V'` has a unit diagonal. Directions V_k
//! with `L_k <= 1e-12 L_max` are unidentifiable: they are left out of the inverse and kept apart, and the deviation of
//! every parameter that takes part in one is NaN. Unknowns at a bound are held and have variance zero.
//!
//! C is computed as `F F'`, `F = V L^(-1/2) Q D^(1/2)` with `L^(-1/2) V' M V L^(-1/2) = Q D Q'`: products of inverses would lose
//! the small variances of combinations of parameters of which each alone is hardly determined.
//!
//! The number of samples of white noise that the fit uses up is `tr(H^-1 M) / sigma^2`, sigma^2 the residual's variance:
//! the number of unknowns for white noise, since M is then `sigma^2 H`, and more for slow noise (K. Takeuchi, 1976).
//!
//! A function f of the unknowns has the variance `g' C g`, g its gradient (delta method). With the axes
//! `d_k = F U_k` of `C = F F'`, U the principal axes of F with rows of unit length, it is the sum of squares of the derivatives
//! along them: `sum_k ((f(theta + h d_k) - f(theta - h d_k)) / (2 h))^2`.

use super::settings::CovarianceSettings;
use crate::linear::symmetric_eigen;
use crate::{Error, Matrix};
use nalgebra::DVector;

/// Covariance of the unknowns of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Uncertainty {
    /// (unknowns, unknowns); zero for those that are held.
    pub covariance: Matrix,
    /// F, (unknowns, directions), with the covariance F F'.
    factor: Matrix,
    /// Unidentifiable directions, (unknowns, directions), of unit length after scaling
    /// every unknown by its column's norm.
    pub open: Matrix,
    /// Parameters that the fit has used up, counted in samples of white noise: `tr(H^-1 M) / variance`.
    pub used: f64,
    /// Parameters that are free: neither held nor at a bound.
    pub estimated: usize,
    settings: CovarianceSettings,
}

impl Uncertainty {
    /// `H^-1 M H^-1`, H the Gram matrix `gram` of the sensitivities and M that of the score under the residual's
    /// autocorrelation, `scores`, for the unknowns `free`; all others are held. `cost` is the sum of the losses of
    /// so many `samples`.
    pub(crate) fn new(
        settings: CovarianceSettings,
        gram: &Matrix,
        scores: &Matrix,
        free: &[usize],
        samples: f64,
        cost: f64,
    ) -> Self {
        let unknowns = gram.nrows();
        let reduce = |matrix: &Matrix| {
            Matrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])])
        };
        let (gram, scores) = (reduce(gram), reduce(scores));
        let scale = gram.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let scaled = |m: &Matrix| {
            Matrix::from_fn(free.len(), free.len(), |i, j| m[(i, j)] / (scale[i] * scale[j]))
        };
        let (values, vectors) = descending_eigen(scaled(&gram));
        let largest = values.iter().copied().fold(0.0, f64::max);
        let rank =
            values.iter().take_while(|&&value| value > settings.identifiable * largest).count();
        let mut root = vectors.columns(0, rank).into_owned();
        for (mut column, value) in root.column_iter_mut().zip(values.iter()) {
            column /= value.sqrt();
        }
        let (spread, turned) = descending_eigen(root.transpose() * scaled(&scores) * &root);
        let used = spread.sum() * samples / cost.max(f64::MIN_POSITIVE);
        let mut reduced = root * turned;
        for (mut column, spread) in reduced.column_iter_mut().zip(spread.iter()) {
            column *= spread.max(0.0).sqrt();
        }
        let mut factor = Matrix::zeros(unknowns, rank);
        for (i, &row) in free.iter().enumerate() {
            factor.row_mut(row).copy_from(&(reduced.row(i) / scale[i]));
        }
        let covariance = &factor * factor.transpose();
        let mut open = Matrix::zeros(unknowns, free.len() - rank);
        for direction in rank..free.len() {
            for (i, &row) in free.iter().enumerate() {
                open[(row, direction - rank)] = vectors[(i, direction)];
            }
        }
        Self { covariance, factor, open, used, estimated: free.len(), settings }
    }

    /// Standard deviations of the unknowns; NaN where an unidentifiable direction takes part.
    pub(crate) fn deviations(&self) -> DVector<f64> {
        DVector::from_fn(self.covariance.nrows(), |i, _| {
            let open = self.open.row(i).amax() > self.settings.share;
            if open { f64::NAN } else { self.covariance[(i, i)].max(0.0).sqrt() }
        })
    }

    /// Unidentifiable parameters: names and shares of the unknowns in every such direction, the largest first.
    pub(crate) fn undetermined(&self, names: &[String]) -> Vec<Vec<(String, f64)>> {
        let direction = |column: nalgebra::DVectorView<f64>| {
            let mut shares: Vec<_> = names
                .iter()
                .cloned()
                .zip(column.iter().copied())
                .filter(|(_, s)| s.abs() > self.settings.listed)
                .collect();
            shares.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            shares
        };
        self.open.column_iter().map(direction).collect()
    }

    /// Standard deviations of functions of the point: root of the sum of squares of [`Uncertainty::axes`].
    pub(crate) fn spread(
        &self,
        values_of: &[f64],
        moved: impl Fn(&DVector<f64>) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<f64>, Error> {
        let mut variances: Vec<f64> = Vec::new();
        for axis in self.axes(values_of, moved)? {
            variances.resize(axis.len(), 0.0);
            variances.iter_mut().zip(&axis).for_each(|(sum, change)| *sum += change.powi(2));
        }
        Ok(variances.into_iter().map(f64::sqrt).collect())
    }

    /// The change of functions of the point along each principal axis of the covariance, over one standard deviation: their
    /// covariance is the sum of the outer products. From central differences.
    ///
    /// `values` are those of the unknowns: a step stays far below them, also along an axis that is
    /// unidentifiable.
    pub(crate) fn axes(
        &self,
        values_of: &[f64],
        moved: impl Fn(&DVector<f64>) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let CovarianceSettings { step: longest, part: most, least, axes, .. } = self.settings;
        let largest = values_of.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let reach = |value: f64| most * value.abs().max(least * largest);
        // Zero for an unknown that is held: rounding must not move it off its place, such as the
        // threshold zero, on whose two sides the deadzone is another one.
        let scale = self.covariance.diagonal().map(|square| square.max(0.0).sqrt());
        let divisor = scale.map(|value| if value > 0.0 { value } else { 1.0 });
        let mut scaled = self.factor.clone();
        scaled.column_iter_mut().for_each(|mut column| column.component_div_assign(&divisor));
        // any rotation leaves F F' as it is: rounding of the eigenvectors does no harm
        let (values, vectors) = descending_eigen(scaled.tr_mul(&scaled));
        let along = |(axis, _): (usize, &f64)| {
            let deviation = &self.factor * vectors.column(axis);
            let parts = deviation.iter().zip(values_of);
            let fraction = parts
                .filter(|(part, _)| **part != 0.0)
                .map(|(part, value)| reach(*value) / part.abs())
                .fold(longest, f64::min);
            let step = deviation * fraction;
            let (above, below) = (moved(&step)?, moved(&-step)?);
            let change = |(above, below): (&f64, &f64)| (above - below) / (2.0 * fraction);
            Ok(above.iter().zip(&below).map(change).collect())
        };
        values.iter().enumerate().take_while(|(_, value)| **value > axes).map(along).collect()
    }
}

/// Eigenvalues (descending) and eigenvectors of a symmetric matrix.
pub(crate) fn descending_eigen(matrix: Matrix) -> (DVector<f64>, Matrix) {
    let n = matrix.nrows();
    if n == 0 {
        return (DVector::zeros(0), matrix);
    }
    if n > CovarianceSettings::default().large
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
