//! Error figures as a dictionary.

use gpi_core::SimulationError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// `rms`, `nrmse`, `fit_percent` and `max`.
pub(crate) fn figures<'py>(
    py: Python<'py>,
    error: &SimulationError,
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("rms", error.rms)?;
    result.set_item("nrmse", error.nrmse)?;
    result.set_item("fit_percent", error.fit_percent)?;
    result.set_item("max", error.max)?;
    Ok(result)
}
