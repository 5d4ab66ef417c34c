//! Calls of the package's Python modules that draw results and show them in notebooks.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Calls a function of the package's plot module.
pub(crate) fn plot<'py>(
    name: &str,
    result: &Bound<'py, PyAny>,
    ax: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let options = PyDict::new(result.py());
    options.set_item("ax", ax)?;
    let module = result.py().import("gpi_hammerstein.plot")?;
    module.call_method(name, (result,), Some(&options))
}

/// The HTML that a notebook shows for a result.
pub(crate) fn in_notebook<'py>(
    name: &str,
    result: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    result.py().import("gpi_hammerstein.report.notebook")?.call_method1(name, (result,))
}
