//! What is known about unknowns before any data: how far some of them can be from their estimates at all.
//!
//! With `C = F F'` and an estimate of unknown i that is also known to a standard deviation s_i without the data, the covariance
//! is that of a Kalman filter's update by one more measurement, f the row i of F:
//!
//! ```text
//! C - C e_i (e_i' C e_i + s_i^2)^-1 e_i' C = F (I + f' f / s_i^2)^-1 F'
//! F (I + f' f / s_i^2)^-1/2 = F - (1 - 1 / sqrt(1 + |f|^2 / s_i^2)) (F f') f / |f|^2
//! ```
//!
//! and the row itself becomes `f / sqrt(1 + |f|^2 / s_i^2)`. One unknown after the other is treated, because the data may leave
//! some of them open by many orders of magnitude: no sum of squares of two of them is ever formed.

use crate::Matrix;

/// F of an estimate of which unknown i is also known to a standard deviation of `known[i]`, which may be infinite.
pub(super) fn with_prior(mut factor: Matrix, known: &[f64]) -> Matrix {
    for (i, deviation) in known.iter().enumerate().filter(|(_, known)| known.is_finite()) {
        let row = factor.row(i).transpose();
        let length = row.norm();
        // far below what is known before, the data decide; also for an unknown that is held
        if length <= f64::EPSILON * deviation {
            continue;
        }
        let direction = row / length;
        let left = deviation / deviation.hypot(length);
        let shares = &factor * &direction;
        factor.ger(left - 1.0, &shares, &direction, 1.0);
        factor.set_row(i, &(direction.transpose() * (left * length)));
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_covariance_is_that_of_more_measurements() {
        let factor = Matrix::from_fn(4, 3, |i, j| ((3 * i + j) as f64).sin() + 0.2 * i as f64);
        let known = [f64::INFINITY, 0.3, 2.0, f64::INFINITY];
        // one direction more, so that the covariance has an inverse
        let whole = factor.clone().insert_column(3, 0.7);
        let found = with_prior(whole.clone(), &known);
        let mut inverse = (&whole * whole.transpose()).try_inverse().unwrap();
        inverse[(1, 1)] += 1.0 / 0.09;
        inverse[(2, 2)] += 0.25;
        let expected = inverse.try_inverse().unwrap();
        assert!((&found * found.transpose() - &expected).amax() < 1e-12 * expected.amax());
    }

    #[test]
    fn what_the_data_leave_open_is_known_as_before() {
        let factor = Matrix::from_row_slice(3, 2, &[3e15, 4e15, 1.0, 0.0, 0.0, 0.0]);
        let found = with_prior(factor, &[0.5, f64::INFINITY, 0.1]);
        let deviation = |i: usize| found.row(i).norm();
        assert!((deviation(0) - 0.5).abs() < 1e-12);
        // what is left of the second is the part that does not move with the first
        assert!((deviation(1) - 0.8).abs() < 1e-12);
        assert_eq!(deviation(2), 0.0);
    }
}
