//! Long work that Ctrl-C and exceptions of a progress function stop.

use crate::errors::to_python;
use gpi_core::{Error, Report};
use pyo3::prelude::*;
use std::time::Instant;

/// What long work does at present; the argument of a ``progress`` function.
///
/// ``str`` makes one line of it, so that ``progress=print`` prints what is done.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> seen = []
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0, progress=seen.append)
/// >>> seen[-1].stage, seen[-1].done
/// ('done', 1.0)
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Progress {
    stage: String,
    trial: String,
    done: f64,
    error: Option<f64>,
    elapsed: f64,
}

/// The fraction of the work from which on the remaining time is estimated.
const ESTIMATED_FROM: f64 = 0.03;

#[pymethods]
impl Progress {
    /// The present stage, such as ``structures`` or ``score test``; ``done`` at the end.
    #[getter]
    fn stage(&self) -> &str {
        &self.stage
    }

    /// What the stage tries at present, such as an order or the name of an effect; empty where it tries nothing.
    #[getter]
    fn trial(&self) -> &str {
        &self.trial
    }

    /// What is done of all work, the fraction from 0 to 1. It never falls, and is 1 only at the end.
    #[getter]
    fn done(&self) -> f64 {
        self.done
    }

    /// The smallest rms error of a whole model on the training data so far, in the unit of the output; None before the
    /// first model is fitted. Several outputs are weighted by their residuals.
    #[getter]
    fn error(&self) -> Option<f64> {
        self.error
    }

    /// The elapsed time, in s.
    #[getter]
    fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// The remaining time, in s, if it goes on as before; None at the beginning.
    #[getter]
    fn remaining(&self) -> Option<f64> {
        (self.done > ESTIMATED_FROM).then(|| self.elapsed * (1.0 - self.done) / self.done)
    }

    fn __str__(&self) -> String {
        let trial =
            if self.trial.is_empty() { String::new() } else { format!(" ({})", self.trial) };
        let error = self.error.map_or_else(String::new, |rms| format!(", best error {rms:.4e}"));
        let remaining = self.remaining().filter(|_| self.done < 1.0);
        let remaining =
            remaining.map_or_else(String::new, |left| format!(", about {left:.0} s left"));
        let (stage, done, elapsed) = (&self.stage, 100.0 * self.done, self.elapsed);
        format!("{done:3.0} % {stage}{trial}{error}, {elapsed:.0} s{remaining}")
    }

    fn __repr__(&self) -> String {
        format!("Progress({})", self.__str__().trim_start())
    }
}

/// Runs long work without the interpreter's lock. Ctrl-C and exceptions of the progress function stop
/// the work and are raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(gpi_core::Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    match in_part(py, progress, work) {
        (_, Some(exception)) => Err(exception),
        (result, None) => result.map_err(to_python),
    }
}

/// The same for work that returns a partial result when it is stopped. The second value is whether it was, also where
/// this came too late to change the result.
pub(crate) fn interruptible_in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(gpi_core::Progress) -> Result<T, Error> + Send,
) -> PyResult<(T, bool)> {
    match in_part(py, progress, work) {
        (Err(Error::Interrupted), Some(exception)) => Err(exception),
        (result, exception) => Ok((result.map_err(to_python)?, exception.is_some())),
    }
}

fn in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(gpi_core::Progress) -> Result<T, Error> + Send,
) -> (Result<T, Error>, Option<PyErr>) {
    let mut raised = None;
    let begin = Instant::now();
    let result = py.detach(|| {
        let mut tell = |report: &Report| {
            // work on several threads may report again before it stops: the signal is not forgotten
            if raised.is_some() {
                return false;
            }
            let outcome = Python::attach(|py| {
                py.check_signals()?;
                let Some(function) = &progress else { return Ok(()) };
                let Report { stage, trial, done, error } = *report;
                let (stage, trial) = (stage.to_owned(), trial.to_owned());
                let elapsed = begin.elapsed().as_secs_f64();
                let own = Progress { stage, trial, done, error, elapsed };
                function.call1(py, (Py::new(py, own)?,)).map(|_| ())
            });
            raised = outcome.err();
            raised.is_none()
        };
        work(&mut tell)
    });
    (result, raised)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Progress>()
}
