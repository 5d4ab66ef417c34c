//! From record to model.

use crate::arrays::{from_vector, vector};
use crate::errors::to_python;
use crate::identification::Identification;
use crate::model::Model;
use crate::operators::{Gpi, read_reading};
use crate::record::Record;
use crate::refine::Refinement;
use gpi_core::Error;
use gpi_core::identify::{self as core, Grid, IdentifyOptions};
use pyo3::prelude::*;

/// A count, or values.
pub(crate) fn grid(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Grid>> {
    let Some(value) = value else { return Ok(None) };
    if let Ok(count) = value.extract::<usize>() {
        return Ok(Some(Grid::Count(count)));
    }
    Ok(Some(Grid::Values(vector(name, value)?)))
}

/// Runs long work without the interpreter's lock. Ctrl-C and exceptions of the progress function stop
/// it and are raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(core::Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    match in_part(py, progress, work) {
        (_, Some(exception)) => Err(exception),
        (result, None) => result.map_err(to_python),
    }
}

/// The same for work that returns what it has when it is stopped.
pub(crate) fn interruptible_in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(core::Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    match in_part(py, progress, work) {
        (Err(Error::Interrupted), Some(exception)) => Err(exception),
        (result, _) => result.map_err(to_python),
    }
}

fn in_part<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(core::Progress) -> Result<T, Error> + Send,
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

/// A hysteresis fitted to an input and an intermediate signal.
///
/// It comes from ``fit_hysteresis``.
///
/// Examples
/// --------
/// >>> u = 4 * np.sin(0.01 * np.arange(2000)) * np.linspace(1, 0.5, 2000)
/// >>> v = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u)
/// >>> fit = gpi.fit_hysteresis(u, v, half_widths=[0.0, 1.0], thresholds=0)
/// >>> fit.gpi.plays.weights.round(6).tolist()
/// [1.0, 0.5]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct HysteresisFit {
    fit: core::HysteresisFit,
}

#[pymethods]
impl HysteresisFit {
    /// Envelope and plays; the identity's weight in the envelope is 1.
    #[getter]
    fn gpi(&self) -> Gpi {
        Gpi { hysteresis: self.fit.hysteresis.clone() }
    }

    /// Constant that v carries on top, in the unit of v.
    #[getter]
    fn offset(&self) -> f64 {
        self.fit.offset
    }

    /// F(-1) of the plays, shape (n,), in the order of their half-widths, in the unit of u.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fit.start)
    }

    /// Root mean square error, in the unit of v.
    #[getter]
    fn rms(&self) -> f64 {
        self.fit.rms
    }

    /// Root mean square error before every accepted step, then at the end, shape (steps + 1,), in the unit of v.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fit.history)
    }

    /// How the fit ended, ``converged``, ``stalled`` or ``limit``.
    #[getter]
    fn status(&self) -> &'static str {
        self.fit.status.name()
    }

    fn __repr__(&self) -> String {
        format!(
            "HysteresisFit({} deadzones, {} plays, rms {:.4e}, {})",
            self.fit.hysteresis.envelope().weights().len(),
            self.fit.hysteresis.plays().weights().len(),
            self.fit.rms,
            self.fit.status.name()
        )
    }
}

/// Fits envelope and plays, both at once, to an input and an intermediate signal.
///
/// ``v(k) = sum_i p_i F_{r_i}[D[u]](k) + offset`` with ``D[u] = u + sum_j g_j Z_{eta_j}[u]`` (one-sided
/// deadzones) and p_i >= 0.
///
/// Parameters
/// ----------
/// u, v : array_like, shape (samples,)
///     Input and intermediate signal, each in its own unit.
/// half_widths : int or array_like, shape (n,), optional
///     How many to spread over half the span of u, or which ones, in the unit of u; 24 when left out.
///     Zero is always among them.
/// thresholds : int or array_like, shape (m,), optional
///     How many to spread inside the range of u, or which ones, in the unit of u; 10 when left out.
/// progress : callable, optional
///     Called with a stage's name and the fraction done; an exception stops the fit.
///
/// Returns
/// -------
/// HysteresisFit
///     Operator, offset, start and error.
///
/// Raises
/// ------
/// DataError
///     Unequal lengths, samples that are not finite, a constant signal, too few samples.
/// ParameterError
///     Half-widths that are negative, no half-width.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = 4 * np.sin(0.01 * np.arange(2000)) * np.linspace(1, 0.5, 2000)
/// >>> v = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u)
/// >>> fit = gpi.fit_hysteresis(u, v, half_widths=[0, 0.5, 1, 1.5], thresholds=0)
/// >>> bool(fit.rms < 1e-6)
/// True
#[pyfunction]
#[pyo3(signature = (u, v, *, half_widths = None, thresholds = None, progress = None))]
fn fit_hysteresis(
    py: Python<'_>,
    u: &Bound<'_, PyAny>,
    v: &Bound<'_, PyAny>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<HysteresisFit> {
    let (u, v) = (vector("u", u)?, vector("v", v)?);
    let half_widths = grid("half_widths", half_widths)?.unwrap_or(Grid::Count(24));
    let thresholds = grid("thresholds", thresholds)?.unwrap_or(Grid::Count(10));
    let fit = interruptible(py, progress, |report| {
        core::fit_hysteresis(&u, &v, &half_widths, &thresholds, report)
    })?;
    Ok(HysteresisFit { fit })
}

/// Identifies a model from a record.
///
/// G comes from FIR least squares and ERA, the hysteresis from bounded least squares behind G, and
/// both are repeated until nothing is gained; then all parts are refined together, (T3) in the theory, and the
/// structures are compared, (T4). An input that excites few directions (a sine, say)
/// supports a gain and a delay only; ``model.identification.notes`` says so.
///
/// Parameters
/// ----------
/// record : Record
///     Training data; nothing else is looked at.
/// taps : int, optional
///     Taps of the FIR estimate; chosen from the slowest pole when left out.
/// order : int, optional
///     Order of G; chosen by an information criterion when left out.
/// half_widths : int or array_like, shape (n,), optional
///     How many plays to spread over half the span of u at first, or their half-widths, in the unit of u,
///     which then do not move; chosen by the criterion from 24 down when left out.
/// thresholds : int or array_like, shape (m,), optional
///     How many deadzones to spread inside the range of u at first, or their thresholds, in the unit of u,
///     which then do not move; chosen by the criterion from 10 down when left out.
/// reading : {"one-sided", "directional"}
///     How the deadzones are read, as in ``Deadzones``.
/// delay : int, optional
///     Restricts G to a gain with a delay of this many samples.
/// robust : bool, optional
///     As in ``refine``: Huber's loss instead of squares.
/// offset_knots : int
///     As in ``refine``: knots of a slowly varying offset of each experiment.
/// progress : callable, optional
///     Called with a stage's name and the fraction done; an exception stops the work.
///
/// Returns
/// -------
/// Model
///     With ``model.identification``.
///
/// Raises
/// ------
/// DataError
///     Constant signals, more taps than the input excites or the samples allow.
/// ParameterError
///     A parameter out of its range.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(4000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = np.convolve(gpi.PlayBank([0, 2.0], [1.0, 0.5])(u), [0.0, 0.7, 0.3])[:4000]
/// >>> record = gpi.Record(u, y, rate=1000.0, warmup=100)
/// >>> model = gpi.identify(record, half_widths=[0, 1, 2, 3], thresholds=0)
/// >>> model.error(record)["fit_percent"] > 99
/// True
#[pyfunction]
#[pyo3(signature = (record, *, taps = None, order = None, half_widths = None, thresholds = None,
    reading = "one-sided", delay = None, robust = None, offset_knots = 1, progress = None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of the Python function")]
fn identify(
    py: Python<'_>,
    record: &Record,
    taps: Option<usize>,
    order: Option<usize>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    reading: &str,
    delay: Option<usize>,
    robust: Option<bool>,
    offset_knots: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Model> {
    let options = IdentifyOptions {
        taps,
        order,
        half_widths: grid("half_widths", half_widths)?,
        thresholds: grid("thresholds", thresholds)?,
        reading: read_reading(reading)?,
        delay,
        robust,
        offset_knots,
    };
    let record = &record.record;
    let found = interruptible(py, progress, |report| core::identify(record, &options, report))?;
    let model = found.model.clone();
    let refinement = Refinement { refinement: found.refinement.clone() };
    let refinement = Some(Py::new(py, refinement)?);
    Ok(Model { model, identification: Some(Py::new(py, Identification { found })?), refinement })
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<HysteresisFit>()?;
    module.add_function(wrap_pyfunction!(fit_hysteresis, module)?)?;
    module.add_function(wrap_pyfunction!(identify, module)?)
}
