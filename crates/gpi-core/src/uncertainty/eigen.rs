//! The eigenvalues of a symmetric matrix, by the library that suits its size.

use super::settings::CovarianceSettings;
use crate::Matrix;
use crate::linear::symmetric_eigen;
use nalgebra::DVector;

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
