//! Transfer functions from polynomials.

use crate::errors::{parameter, to_python};
use gpi_core::Matrix;
use gpi_core::linear::TransferFunction;
use pyo3::prelude::*;

/// The transfer function of these coefficients, highest power first.
///
/// The numerator of one input and output may be shorter than the denominator: it is padded with zeros in front.
pub(super) fn transfer_function(
    numerator: Vec<Matrix>,
    denominator: &[f64],
) -> PyResult<TransferFunction> {
    let of_one = |n: &[f64]| TransferFunction::new(n, denominator).map_err(to_python);
    if numerator.first().is_some_and(|tap| tap.len() == 1) {
        let n: Vec<f64> = numerator.iter().map(|tap| tap[0]).collect();
        return of_one(&n);
    }
    let scaled = of_one(&[])?.denominator;
    if numerator.len() != denominator.len() {
        let message = format!(
            "`numerator` has {} coefficients, but `denominator` has {}",
            numerator.len(),
            denominator.len()
        );
        return Err(parameter(message));
    }
    let numerator = numerator.into_iter().map(|tap| tap / denominator[0]).collect();
    Ok(TransferFunction { numerator, denominator: scaled })
}
