//! The drive without knowledge of hysteresis and dynamics: the best static curve from the reference to the drive.
//!
//! With w the v that G needs in steady state for the reference, moved and scaled to -1 to 1,
//!
//! ```text
//! u(k) = sum_(i <= n) c_i T_i(w(k)),   c = argmin sum_k (u(k) - drive(k))^2
//! ```
//!
//! T_i Chebyshev's polynomials. Of the degrees n = 1 to 5, the one is taken with which the predicted output is nearest to
//! the reference: a drive that is nearer to the right one need not lead to a nearer output. This is what a calibration table
//! with a smooth curve achieves.

use super::dynamics;
use crate::{Error, Matrix, Model};
use nalgebra::DVector;

/// Largest degree of the curve: an envelope bends a few times, and a higher degree oscillates between the samples. By hand.
const DEGREE: usize = 5;

/// Part of the largest singular value up to which a direction of the coefficients is not determined.
const DETERMINED: f64 = 1e-12;

/// The outputs (samples, outputs) under the best static curve of a reference (samples, outputs), for a drive (samples, inputs)
/// that follows it; `simulate` turns a drive into outputs.
pub(super) fn static_curve(
    model: &Model,
    reference: &Matrix,
    drive: &Matrix,
    simulate: impl Fn(&Matrix) -> Result<Matrix, Error>,
) -> Result<Matrix, Error> {
    let output = |degree| simulate(&of_degree(degree, model, reference, drive)?);
    let missed = |output: &Matrix| (output - reference).norm_squared();
    let mut best = output(1)?;
    for degree in 2..=DEGREE {
        let next = output(degree)?;
        if missed(&next) < missed(&best) {
            best = next;
        }
    }
    Ok(best)
}

/// The static curves of a degree that come nearest to a drive.
fn of_degree(
    degree: usize,
    model: &Model,
    reference: &Matrix,
    drive: &Matrix,
) -> Result<Matrix, Error> {
    let still = Matrix::from_fn(reference.nrows(), reference.ncols(), |k, o| {
        reference[(k, o)] - model.offsets()[o]
    });
    let mut curve = still * dynamics::inverse_gain(model.linear())?.transpose();
    for (mut v, u) in curve.column_iter_mut().zip(drive.column_iter()) {
        let (middle, half) = (0.5 * (v.max() + v.min()), 0.5 * (v.max() - v.min()));
        let basis =
            |v: f64| polynomials(degree, if half > 0.0 { (v - middle) / half } else { 0.0 });
        let (mut gram, mut right) =
            (Matrix::zeros(degree + 1, degree + 1), DVector::zeros(degree + 1));
        for (&v, &u) in v.iter().zip(u.iter()) {
            let row = basis(v);
            gram.ger(1.0, &row, &row, 1.0);
            right.axpy(u, &row, 1.0);
        }
        let no_curve = || {
            Error::parameter("reference", v.max(), "no static curve fits the drive: it overflows")
        };
        // the decomposition of a matrix that has overflowed panics
        if gram.iter().chain(right.iter()).any(|value| !value.is_finite()) {
            return Err(no_curve());
        }
        let found = gram.svd(true, true);
        let least = DETERMINED * found.singular_values.max();
        let coefficients = found.solve(&right, least).map_err(|_| no_curve())?;
        v.apply(|value| *value = basis(*value).dot(&coefficients));
    }
    Ok(curve)
}

/// `T_0(w) .. T_n(w)`, n at least 1.
fn polynomials(degree: usize, w: f64) -> DVector<f64> {
    let mut values = DVector::from_element(degree + 1, 1.0);
    values[1] = w;
    for i in 2..=degree {
        values[i] = 2.0 * w * values[i - 1] - values[i - 2];
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_those_of_chebyshev() {
        for angle in [0.1_f64, 1.0, 2.5] {
            let values = polynomials(DEGREE, angle.cos());
            for (i, value) in values.iter().enumerate() {
                assert!((value - (i as f64 * angle).cos()).abs() < 1e-14);
            }
        }
    }
}
