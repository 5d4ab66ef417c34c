//! The drive without knowledge of hysteresis and dynamics: the best static curve from the reference to the drive.
//!
//! With w the v that G needs in steady state for the reference, moved and scaled to -1 to 1,
//!
//! ```text
//! u(k) = sum_(i <= 5) c_i T_i(w(k)),   c = argmin sum_k (u(k) - drive(k))^2
//! ```
//!
//! T_i Chebyshev's polynomials. This is what a calibration table with a smooth curve achieves.

use super::dynamics;
use crate::{Error, Matrix, Model};
use nalgebra::DVector;

/// Degree of the curve: an envelope bends a few times, and a higher degree oscillates between the samples. By hand.
const DEGREE: usize = 5;

/// Part of the largest singular value up to which a direction of the coefficients is not determined.
const DETERMINED: f64 = 1e-12;

/// The static curves of a reference (samples, outputs) that come nearest to a drive (samples, inputs).
pub(super) fn static_curve(
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
        let basis = |v: f64| polynomials(if half > 0.0 { (v - middle) / half } else { 0.0 });
        let (mut gram, mut right) =
            (Matrix::zeros(DEGREE + 1, DEGREE + 1), DVector::zeros(DEGREE + 1));
        for (&v, &u) in v.iter().zip(u.iter()) {
            let row = basis(v);
            gram.ger(1.0, &row, &row, 1.0);
            right.axpy(u, &row, 1.0);
        }
        let found = gram.svd(true, true);
        let least = DETERMINED * found.singular_values.max();
        let requirement = "no static curve fits the drive";
        let coefficients = found
            .solve(&right, least)
            .map_err(|_| Error::parameter("reference", f64::NAN, requirement))?;
        v.apply(|value| *value = basis(*value).dot(&coefficients));
    }
    Ok(curve)
}

/// `T_0(w) .. T_5(w)`.
fn polynomials(w: f64) -> DVector<f64> {
    let mut values = DVector::from_element(DEGREE + 1, 1.0);
    values[1] = w;
    for i in 2..=DEGREE {
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
            let values = polynomials(angle.cos());
            for (i, value) in values.iter().enumerate() {
                assert!((value - (i as f64 * angle).cos()).abs() < 1e-14);
            }
        }
    }
}
