//! Invariant zeros, by a reduction of the system that removes the infinite ones.

use super::StateSpace;
use super::decompose::{eigenvalues, full_svd, solve};
use crate::{Error, Matrix};
use num_complex::Complex64;

/// Singular values below this fraction of the system's norm count as zero: above the rounding errors of the reduction,
/// which uses orthogonal transformations only, and far below the coefficients of practical systems.
const TOLERANCE: f64 = 1e-11;

impl StateSpace {
    /// The finite invariant zeros of a square model: the z at which `[A - z I, B; C, D]` loses rank.
    ///
    /// Outputs without direct feedthrough are replaced by their value one sample later, until D is invertible
    /// (Emami-Naeini and Van Dooren, Automatica 1982). The zeros are then the eigenvalues of `A - B D^-1 C`.
    ///
    /// ```
    /// use gpi_core::linear::TransferFunction;
    /// let zeros = TransferFunction::new(&[1.0, -2.0], &[1.0, 0.0, 0.5])?.to_state_space()?.zeros()?;
    /// assert!(zeros.len() == 1 && (zeros[0].re - 2.0).abs() < 1e-12);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The numbers of inputs and outputs differ, or a decomposition does not converge.
    pub fn zeros(&self) -> Result<Vec<Complex64>, Error> {
        Error::require_equal("channels", ("inputs", self.inputs()), ("outputs", self.outputs()))?;
        let parts = [&self.a, &self.b, &self.c, &self.d];
        let tolerance = TOLERANCE * parts.into_iter().map(Matrix::norm).fold(0.0, f64::max);
        // first for the rows of D, then, with the transposed system, for its columns
        let reduced = self.clone().reduce(tolerance)?.transpose().reduce(tolerance)?;
        if reduced.a.is_empty() || reduced.d.nrows() != reduced.d.ncols() {
            return Ok(Vec::new());
        }
        match solve(reduced.d, &reduced.c) {
            Some(feedback) => eigenvalues(&(reduced.a - reduced.b * feedback)),
            None => Ok(Vec::new()),
        }
    }

    /// The system with the transposed system matrix.
    fn transpose(&self) -> Self {
        let [a, b, c, d] = [&self.a, &self.c, &self.b, &self.d].map(Matrix::transpose);
        Self { a, b, c, d }
    }

    /// A system with the same finite zeros whose D has full row rank.
    fn reduce(mut self, tolerance: f64) -> Result<Self, Error> {
        let rank = |values: &[f64]| values.iter().filter(|&&value| value > tolerance).count();
        loop {
            let (outputs, states) = (self.c.nrows(), self.a.nrows());
            if outputs == 0 || states == 0 {
                return Ok(self);
            }
            let direct = full_svd(&self.d)?;
            let seen = rank(&direct.s);
            if seen == outputs {
                return Ok(self);
            }
            // rotated outputs: the first ones have direct feedthrough, the others depend on the state only
            let (c, d) = (direct.u.tr_mul(&self.c), direct.u.tr_mul(&self.d));
            let blind = c.rows(seen, outputs - seen).into_owned();
            let visible = full_svd(&blind)?;
            let fixed = rank(&visible.s);
            if fixed == 0 {
                // the others are always zero and carry no information
                self.c = c.rows(0, seen).into_owned();
                self.d = d.rows(0, seen).into_owned();
                return Ok(self);
            }
            // if these outputs stay zero, so do `fixed` states, whose equations become new outputs
            let free = states - fixed;
            let basis = Matrix::from_fn(states, states, |i, j| {
                visible.v[(i, if j < free { fixed + j } else { j - free })]
            });
            let a = basis.tr_mul(&(&self.a * &basis));
            let b = basis.tr_mul(&self.b);
            let c = c.rows(0, seen) * &basis;
            let inputs = b.ncols();
            let mut next_c = Matrix::zeros(seen + fixed, free);
            next_c.rows_mut(0, seen).copy_from(&c.columns(0, free));
            next_c.rows_mut(seen, fixed).copy_from(&a.view((free, 0), (fixed, free)));
            let mut next_d = Matrix::zeros(seen + fixed, inputs);
            next_d.rows_mut(0, seen).copy_from(&d.rows(0, seen));
            next_d.rows_mut(seen, fixed).copy_from(&b.rows(free, fixed));
            self.a = a.view((0, 0), (free, free)).into_owned();
            self.b = b.rows(0, free).into_owned();
            (self.c, self.d) = (next_c, next_d);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;

    fn zeros(numerator: &[f64], denominator: &[f64]) -> Vec<Complex64> {
        let system =
            TransferFunction::new(numerator, denominator).unwrap().to_state_space().unwrap();
        let mut zeros = system.zeros().unwrap();
        zeros.sort_by(|a, b| a.re.total_cmp(&b.re));
        zeros
    }

    #[test]
    fn a_zero_annuls_the_transfer_function() {
        let tf = TransferFunction::new(&[0.5, 1.0, 0.3], &[1.0, -1.0, 0.41]).unwrap();
        let zeros = tf.to_state_space().unwrap().zeros().unwrap();
        assert_eq!(zeros.len(), 2);
        assert!(zeros.iter().all(|&zero| tf.evaluate(zero)[(0, 0)].norm() < 1e-12));
    }

    #[test]
    fn infinite_zeros_leave_no_trace() {
        assert!(zeros(&[1.0], &[1.0, -0.5, 0.06, 0.0, 0.0, 0.0]).is_empty());
        let found = zeros(&[1.0, -0.5], &[1.0, -0.4, 0.1, 0.02, 0.3, -0.1]);
        assert!(found.len() == 1 && (found[0].re - 0.5).abs() < 1e-9);
    }

    #[test]
    fn zeros_anywhere_are_found() {
        let found = zeros(&[1.0, -1.734_567_8, 0.617_283_9], &[1.0, 0.0, 0.0]);
        assert!((found[0].re - 0.5).abs() < 1e-12 && (found[1].re - 1.234_567_8).abs() < 1e-12);
    }

    #[test]
    fn two_channels_with_different_delays() {
        // channel 1 has the zero 0.3 and no delay, channel 2 two samples of delay and the zero -2
        let a = Matrix::from_row_slice(
            4,
            4,
            &[
                0.5, 0.0, 0.0, 0.0, //
                0.0, 0.1, 0.2, -0.1, //
                0.0, 1.0, 0.0, 0.0, //
                0.0, 0.0, 1.0, 0.0,
            ],
        );
        let b = Matrix::from_row_slice(4, 2, &[1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let c = Matrix::from_row_slice(2, 4, &[0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
        let d = Matrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]);
        let mut found = StateSpace::new(a, b, c, d).unwrap().zeros().unwrap();
        found.sort_by(|a, b| a.re.total_cmp(&b.re));
        assert_eq!(found.len(), 2);
        assert!((found[0].re + 2.0).abs() < 1e-12 && (found[1].re - 0.3).abs() < 1e-12);
    }
}
