//! Half-widths and thresholds, given as their number or as their values.

use crate::arrays::vector;
use gpi_core::identify::Grid;
use pyo3::prelude::*;

/// Reads a number or an array of values.
pub(crate) fn grid(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Grid>> {
    let Some(value) = value else { return Ok(None) };
    if let Ok(count) = value.extract::<usize>() {
        return Ok(Some(Grid::Count(count)));
    }
    Ok(Some(Grid::Values(vector(name, value)?)))
}
