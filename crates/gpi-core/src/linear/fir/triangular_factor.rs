//! Least squares from the triangular factor of a regressor.

use super::iterated_ridge::PASSES;
use crate::linear::decompose::{Svd, singular_values, svd};
use crate::{Error, Matrix};

/// `A P = Q r` and `z = Q^T y` for a regressor A and targets y.
pub(super) struct TriangularFactor {
    pub(super) r: Matrix,
    pub(super) z: Matrix,
    /// The sum of squares of each target that no unknown explains.
    pub(super) rest: Vec<f64>,
    /// The unknown of each column of r.
    pub(super) order: Vec<usize>,
}

/// The minimum-norm solution, with the excitation that it rests on.
pub(super) struct Solution {
    /// (unknowns, targets).
    pub x: Matrix,
    /// Singular values of the regressor, descending.
    pub singular_values: Vec<f64>,
    /// Number of singular values above the tolerance times the largest.
    pub rank: usize,
    /// Sum of squared residuals of each target.
    pub residual_squares: Vec<f64>,
}

impl TriangularFactor {
    /// The minimum-norm solution over the directions whose singular value exceeds `tolerance` times the largest.
    ///
    /// `ridge`, relative to the mean eigenvalue of `A^T A`, regularizes by [`PASSES`] passes of iterated ridge regression,
    /// which hardly bias well excited directions.
    pub(super) fn solve(&self, tolerance: f64, ridge: f64) -> Result<Solution, Error> {
        let rank = |s: &[f64]| s.iter().take_while(|&&value| value > tolerance * s[0]).count();
        if ridge == 0.0 {
            let s = self.singular_values()?;
            let is_whole = rank(&s) == s.len();
            if let Some(x) = self.r.solve_upper_triangular(&self.z).filter(|_| is_whole) {
                return Ok(self.solution(x, s.len(), s));
            }
        }
        let Svd { u, s, v } = svd(&self.r)?;
        let rank = rank(&s);
        let mut projected = u.columns(0, rank).tr_mul(&self.z);
        let penalty = ridge * s.iter().map(|value| value * value).sum::<f64>() / s.len() as f64;
        for (mut row, value) in projected.row_iter_mut().zip(&s) {
            row *= (1.0 - (penalty / (penalty + value * value)).powi(PASSES)) / value;
        }
        Ok(self.solution(v.columns(0, rank) * projected, rank, s))
    }

    /// The solution from the unknowns in the order of r's columns.
    fn solution(&self, ordered: Matrix, rank: usize, singular_values: Vec<f64>) -> Solution {
        let left = &self.z - &self.r * &ordered;
        let squares = self.rest.iter().zip(left.column_iter());
        let residual_squares = squares.map(|(rest, left)| rest + left.norm_squared()).collect();
        let mut x = ordered.clone();
        for (row, &unknown) in ordered.row_iter().zip(&self.order) {
            x.row_mut(unknown).copy_from(&row);
        }
        Solution { x, singular_values, rank, residual_squares }
    }

    /// The singular values of the regressor, descending.
    pub(super) fn singular_values(&self) -> Result<Vec<f64>, Error> {
        singular_values(&self.r)
    }
}
