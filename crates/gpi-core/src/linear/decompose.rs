//! Matrix decompositions of nalgebra matrices by faer.

use crate::{Error, Matrix};
use faer::linalg::solvers::{self, Solve};
use faer::{Mat, MatRef, Scale, Side};
use nalgebra::DVector;
use num_complex::Complex64;

/// Directions of [`leading_svd`] besides the wanted ones: they let the wanted directions converge faster.
const SPARE: usize = 6;

/// Passes after which [`leading_svd`] gives up, so that the full decomposition is used.
const PASSES: i32 = 6;

/// Residual of a singular pair, relative to the largest singular value, at which [`leading_svd`] has converged: the
/// rounding error of the full decomposition.
const CONVERGED: f64 = 1e-14;

/// Singular value decomposition `u diag(s) v^T` with the singular values in descending order.
pub(crate) struct Svd {
    pub u: Matrix,
    pub s: Vec<f64>,
    pub v: Matrix,
}

fn view(matrix: &Matrix) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

fn owned(matrix: MatRef<'_, f64>) -> Matrix {
    Matrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)])
}

fn not_converged(decomposition: &'static str, matrix: &Matrix) -> Error {
    Error::NotConverged { decomposition, rows: matrix.nrows(), columns: matrix.ncols() }
}

/// The thin singular value decomposition: `u` is (rows, n) and `v` (columns, n), where n is the smaller dimension.
///
/// For a symmetric matrix it follows from the eigendecomposition, which is faster.
pub(crate) fn svd(matrix: &Matrix) -> Result<Svd, Error> {
    if is_symmetric(matrix) {
        let (values, vectors) = symmetric_eigen(matrix)?;
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&i, &j| values[j].abs().total_cmp(&values[i].abs()));
        let s = order.iter().map(|&i| values[i].abs()).collect();
        let v = vectors.select_columns(&order);
        let mut u = v.clone();
        for (mut column, &i) in u.column_iter_mut().zip(&order) {
            column *= values[i].signum();
        }
        return Ok(Svd { u, s, v });
    }
    parts(view(matrix).thin_svd(), matrix)
}

fn parts<E>(found: Result<solvers::Svd<f64>, E>, matrix: &Matrix) -> Result<Svd, Error> {
    let svd = found.map_err(|_| not_converged("singular value decomposition", matrix))?;
    let s = svd.S().column_vector().iter().copied().collect();
    Ok(Svd { u: owned(svd.U()), s, v: owned(svd.V()) })
}

/// The singular values, descending.
pub(crate) fn singular_values(matrix: &Matrix) -> Result<Vec<f64>, Error> {
    view(matrix)
        .singular_values()
        .map_err(|_| not_converged("singular value decomposition", matrix))
}

/// The `count` largest singular values with their vectors by subspace iteration (Halko, Martinsson and Tropp 2011);
/// `None` if they do not converge within a few passes.
pub(crate) fn leading_svd(matrix: &Matrix, count: usize) -> Option<Svd> {
    let (a, width) = (view(matrix), (count + SPARE).min(matrix.nrows().min(matrix.ncols())));
    // arbitrary directions: none of the singular vectors may be orthogonal to all of them
    let mut image = a * Mat::from_fn(matrix.ncols(), width, |i, j| {
        ((i * i + 1) as f64 * (j + 1) as f64 * 0.618).sin()
    });
    let mut before = f64::INFINITY;
    for passes in (0..PASSES).rev() {
        let left = image.qr().compute_thin_Q();
        let parts = (a.transpose() * &left).thin_svd().ok()?;
        let (s, right) = (parts.S().column_vector(), parts.U());
        let left = left * parts.V();
        image = a * right;
        // `A^T u = s v` holds by construction, so the residual is that of `A v = s u`
        let error = |j: usize| (image.col(j) - left.col(j) * Scale(s[j])).norm_l2() / s[0];
        let error = (0..count).map(error).fold(0.0, f64::max);
        if error <= CONVERGED {
            return Some(Svd {
                u: owned(left.as_ref().subcols(0, count)),
                s: s.iter().copied().take(count).collect(),
                v: owned(right.subcols(0, count)),
            });
        }
        // prediction: each pass reduces the error by the same factor
        if error * (error / before).powi(passes) > CONVERGED && before.is_finite() {
            break;
        }
        before = error;
    }
    None
}

/// The full singular value decomposition: `u` and `v` are square.
pub(crate) fn full_svd(matrix: &Matrix) -> Result<Svd, Error> {
    let (rows, columns) = matrix.shape();
    if matrix.is_empty() {
        let (u, v) = (Matrix::identity(rows, rows), Matrix::identity(columns, columns));
        return Ok(Svd { u, s: Vec::new(), v });
    }
    parts(view(matrix).svd(), matrix)
}

fn is_symmetric(matrix: &Matrix) -> bool {
    let n = matrix.nrows();
    matrix.is_square() && (0..n).all(|j| (0..j).all(|i| matrix[(i, j)] == matrix[(j, i)]))
}

/// Eigenvalues (descending) and eigenvectors (columns) of a symmetric matrix; only its lower triangle is used.
pub(crate) fn symmetric_eigen(matrix: &Matrix) -> Result<(DVector<f64>, Matrix), Error> {
    let eigen = view(matrix)
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| not_converged("symmetric eigendecomposition", matrix))?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let n = matrix.nrows();
    let descending = DVector::from_fn(n, |i, _| values[n - 1 - i]);
    Ok((descending, Matrix::from_fn(n, n, |i, j| vectors[(i, n - 1 - j)])))
}

/// The eigenvalues of a square matrix.
pub(crate) fn eigenvalues(matrix: &Matrix) -> Result<Vec<Complex64>, Error> {
    if matrix.is_empty() {
        return Ok(Vec::new());
    }
    view(matrix).eigenvalues().map_err(|_| not_converged("eigendecomposition", matrix))
}

/// Eigenvalues and eigenvectors (columns) of a square matrix.
pub(crate) fn eigen(
    matrix: &Matrix,
) -> Result<(DVector<Complex64>, nalgebra::DMatrix<Complex64>), Error> {
    let eigen = view(matrix).eigen().map_err(|_| not_converged("eigendecomposition", matrix))?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let n = matrix.nrows();
    Ok((
        DVector::from_fn(n, |i, _| values[i]),
        nalgebra::DMatrix::from_fn(n, n, |i, j| vectors[(i, j)]),
    ))
}

/// The Cholesky decomposition of a symmetric matrix, of which the lower triangle is used.
pub(crate) struct Cholesky(solvers::Llt<f64>);

impl Cholesky {
    /// `None` if the matrix is not positive definite.
    pub(crate) fn new(matrix: &Matrix) -> Option<Self> {
        view(matrix).llt(Side::Lower).ok().map(Self)
    }

    /// Solves `matrix x = right`.
    pub(crate) fn solve(&self, right: &Matrix) -> Matrix {
        owned(self.0.solve(view(right)).as_ref())
    }
}

/// Solves `matrix x = right`; `None` if the matrix is singular. The solution of an empty system is empty.
pub(crate) fn solve<T: nalgebra::ComplexField>(
    matrix: nalgebra::DMatrix<T>,
    right: &nalgebra::DMatrix<T>,
) -> Option<nalgebra::DMatrix<T>> {
    if matrix.is_empty() { Some(right.clone()) } else { matrix.lu().solve(right) }
}
