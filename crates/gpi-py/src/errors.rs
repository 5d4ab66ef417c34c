//! The one place where errors of the core become Python exceptions.

use gpi_core::{Error, ErrorKind};
use pyo3::exceptions::{PyArithmeticError, PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple, PyType};

static BASE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static PARAMETER: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static DATA: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static NUMERICAL: PyOnceLock<Py<PyType>> = PyOnceLock::new();

/// A new exception class with the given bases.
fn class(
    py: Python<'_>,
    name: &str,
    doc: &str,
    bases: &[Bound<'_, PyType>],
) -> PyResult<Py<PyType>> {
    let namespace = PyDict::new(py);
    namespace.set_item("__doc__", doc)?;
    namespace.set_item("__module__", "gpi_hammerstein")?;
    let metaclass = py.get_type::<PyType>();
    let class = metaclass.call1((name, PyTuple::new(py, bases)?, namespace))?;
    Ok(class.cast_into::<PyType>()?.unbind())
}

fn base(py: Python<'_>) -> PyResult<Bound<'_, PyType>> {
    let doc = "Base class of every error that gpi_hammerstein raises.";
    let bases = [py.get_type::<PyException>()];
    let class = BASE.get_or_try_init(py, || class(py, "GpiError", doc, &bases))?;
    Ok(class.bind(py).clone())
}

fn class_of(py: Python<'_>, kind: ErrorKind) -> PyResult<Bound<'_, PyType>> {
    let (cell, name, doc, builtin) = match kind {
        ErrorKind::Parameter => (
            &PARAMETER,
            "ParameterError",
            "A parameter of the call is out of its range.",
            py.get_type::<PyValueError>(),
        ),
        ErrorKind::Data => (
            &DATA,
            "DataError",
            "The data cannot be used for this computation. The message says where and why.",
            py.get_type::<PyValueError>(),
        ),
        ErrorKind::Numerical => (
            &NUMERICAL,
            "NumericalError",
            "A computation failed numerically, although the data are usable.",
            py.get_type::<PyArithmeticError>(),
        ),
    };
    let class = cell.get_or_try_init(py, || class(py, name, doc, &[base(py)?, builtin]))?;
    Ok(class.bind(py).clone())
}

/// The Python exception of an error of the core.
pub(crate) fn to_python(error: impl Into<Error>) -> PyErr {
    let error = error.into();
    Python::attach(|py| match class_of(py, error.kind()) {
        Ok(class) => PyErr::from_type(class, error.to_string()),
        Err(failure) => failure,
    })
}

/// A `ParameterError` with its own message.
pub(crate) fn parameter(message: String) -> PyErr {
    Python::attach(|py| match class_of(py, ErrorKind::Parameter) {
        Ok(class) => PyErr::from_type(class, message),
        Err(failure) => failure,
    })
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("GpiError", base(py)?)?;
    module.add("ParameterError", class_of(py, ErrorKind::Parameter)?)?;
    module.add("DataError", class_of(py, ErrorKind::Data)?)?;
    module.add("NumericalError", class_of(py, ErrorKind::Numerical)?)
}
