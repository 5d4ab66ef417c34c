//! The way from a result's methods that show it to the package's modules that draw and write.

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

/// What a notebook shows of a result.
pub(crate) fn in_notebook<'py>(
    name: &str,
    result: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    result.py().import("gpi_hammerstein.report.notebook")?.call_method1(name, (result,))
}
