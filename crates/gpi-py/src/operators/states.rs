//! States of the operators as vectors.

use crate::errors::{parameter, to_python};
use gpi_core::Hysteresis;
use gpi_core::operators::{DeadzonesState, GpiState, InverseGpi, InverseState, OperatorError};
use pyo3::prelude::*;

/// The state of a cascade from the previous input and the play outputs.
pub(crate) fn read_state(
    hysteresis: &Hysteresis,
    values: &[f64],
) -> PyResult<GpiState<f64, Vec<f64>>> {
    let expected = 1 + hysteresis.plays().weights().len();
    if values.len() != expected {
        let message = format!(
            "`state` has {} elements, but {expected} are needed: the previous input and the plays",
            values.len()
        );
        return Err(parameter(message));
    }
    let plays = hysteresis.plays().state_from(values[1..].to_vec()).map_err(to_python)?;
    Ok(GpiState { envelope: DeadzonesState { previous: values[0] }, plays })
}

/// The inverse of [`read_state`].
pub(crate) fn write_state(state: &GpiState<f64, Vec<f64>>) -> Vec<f64> {
    let previous = std::iter::once(state.envelope.previous);
    previous.chain(state.plays.plays().iter().copied()).collect()
}

/// The state of an inverse from the number of samples out of reach and the play outputs.
pub(crate) fn read_inverse_state(
    inverse: &InverseGpi<Vec<f64>, Vec<f64>>,
    values: &[f64],
) -> Result<InverseState<Vec<f64>>, OperatorError> {
    let plays = inverse.plays().state_from(values[1..].to_vec())?;
    Ok(InverseState { plays, out_of_reach: values[0] as u32 })
}

/// The inverse of [`read_inverse_state`].
pub(crate) fn write_inverse_state(state: &InverseState<Vec<f64>>) -> Vec<f64> {
    let count = std::iter::once(f64::from(state.out_of_reach));
    count.chain(state.plays.plays().iter().copied()).collect()
}
