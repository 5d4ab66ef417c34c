//! Long work that Ctrl-C and exceptions of a progress function stop.

use crate::errors::to_python;
use gpi_core::{Error, Progress};
use pyo3::prelude::*;

/// Runs long work without the interpreter's lock. Ctrl-C and exceptions of the progress function stop
/// the work and are raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    match in_part(py, progress, work) {
        (_, Some(exception)) => Err(exception),
        (result, None) => result.map_err(to_python),
    }
}

/// The same for work that returns a partial result when it is stopped.
pub(crate) fn interruptible_in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    match in_part(py, progress, work) {
        (Err(Error::Interrupted), Some(exception)) => Err(exception),
        (result, _) => result.map_err(to_python),
    }
}

fn in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Progress) -> Result<T, Error> + Send,
) -> (Result<T, Error>, Option<PyErr>) {
    let mut raised = None;
    let result = py.detach(|| {
        let mut report = |stage: &str, done: f64| {
            let outcome = Python::attach(|py| {
                py.check_signals()?;
                match &progress {
                    Some(function) => function.call1(py, (stage, done)).map(|_| ()),
                    None => Ok(()),
                }
            });
            raised = outcome.err();
            raised.is_none()
        };
        work(&mut report)
    });
    (result, raised)
}
