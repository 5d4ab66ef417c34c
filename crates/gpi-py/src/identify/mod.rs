//! From record to model.

mod grid;
mod hysteresis;
mod refine;
mod sensitivities;

pub(crate) use grid::grid;

use crate::calls;
use crate::errors::{parameter, to_python};
use crate::model::{Identification, Model, Refinement};
use crate::operators::read_reading;
use crate::progress::interruptible;
use gpi_core::identify::{self as core, IdentifyOptions};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Identifies a model from a record.
///
/// G is estimated by FIR least squares and ERA, and the hysteresis by bounded least squares with G fixed. The two steps are
/// repeated until the error no longer falls. Then all parts are refined jointly, (T3) in the theory, and the structures are
/// compared, (T4). If the input is not persistently exciting (a sine, for example), only a gain and a delay are
/// identifiable for G; ``model.identification.notes`` reports this.
///
/// Parameters
/// ----------
/// record : Record or path
///     Training data, or the file that ``read_record`` reads them from. All of its scored samples are used.
/// taps : int, optional
///     Number of taps of the FIR estimate; chosen from the slowest pole when left out.
/// order : int, optional
///     Order of G; chosen by BIC when left out.
/// half_widths : int or array_like, shape (n,), optional
///     The initial number of plays, which are distributed over half the span of u, or their half-widths, in the unit of
///     u, which are then kept fixed. When left out, their number is chosen by BIC, at most 24.
/// thresholds : int or array_like, shape (m,), optional
///     The initial number of deadzones, which are distributed over the range of u, or their thresholds, in the unit of u,
///     which are then kept fixed. When left out, their number is chosen by BIC, at most 10.
/// reading : {"one-sided", "directional"}
///     The deadzone convention, as in ``Deadzones``.
/// hysteresis : {"plays", "stops"}, optional
///     What the hysteresis consists of: plays, whose output lags behind the input, or stops, whose output leads it, as the
///     force of friction leads the displacement. Chosen by the data when left out.
/// delay : int, optional
///     Restricts G to a gain with a delay of this many samples.
/// robust : bool, optional
///     Whether to use Huber's loss instead of least squares, as in ``refine``.
/// offset_knots : int
///     Number of knots of a slowly varying offset of each experiment, as in ``refine``.
/// progress : callable, optional
///     Called with a ``Progress``: the stage, the trial, the fraction done and the best error so far; an exception stops the work.
///
/// Returns
/// -------
/// Model
///     The model, with its ``identification`` and its ``refinement``.
///
/// Raises
/// ------
/// DataError
///     A signal is constant, or there are more taps than the input or the number of samples supports.
/// ParameterError
///     A parameter is out of its range.
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
#[pyo3(signature = (record, *extra, taps = None, order = None, half_widths = None, thresholds = None,
    reading = "one-sided", hysteresis = None, delay = None, robust = None, offset_knots = 1, progress = None, **others),
    text_signature = "(record, *, taps=None, order=None, half_widths=None, thresholds=None, \
reading='one-sided', hysteresis=None, delay=None, robust=None, offset_knots=1, progress=None)")]
fn identify(
    py: Python<'_>,
    record: &Bound<'_, PyAny>,
    extra: &Bound<'_, PyTuple>,
    taps: Option<usize>,
    order: Option<usize>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    reading: &str,
    hysteresis: Option<&str>,
    delay: Option<usize>,
    robust: Option<bool>,
    offset_knots: usize,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Model> {
    calls::only_a_record("identify", record, extra, others)?;
    let record = calls::record("record", record, "gpi.identify(")?;
    let options = IdentifyOptions {
        taps,
        order,
        half_widths: grid("half_widths", half_widths)?,
        thresholds: grid("thresholds", thresholds)?,
        reading: read_reading(reading)?,
        delay,
        elements: elements(hysteresis)?,
        robust,
        offset_knots,
    };
    let record = &record.get().record;
    let found = interruptible(py, progress, |report| core::identify(record, &options, report))?;
    let model =
        found.model.clone().with_prediction(&found.refinement, record).map_err(to_python)?;
    let refinement = Refinement::new(&model, found.refinement.clone())?;
    let refinement = Some(Py::new(py, refinement)?);
    Ok(Model { model, identification: Some(Py::new(py, Identification { found })?), refinement })
}

/// The elements of a name.
pub(crate) fn elements(hysteresis: Option<&str>) -> PyResult<Option<core::Elements>> {
    let known = |name: &str| match name {
        "plays" => Ok(core::Elements::Plays),
        "stops" => Ok(core::Elements::Stops),
        other => Err(parameter(format!("`hysteresis` = {other}: must be plays or stops"))),
    };
    hysteresis.map(known).transpose()
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<hysteresis::HysteresisFit>()?;
    module.add_function(wrap_pyfunction!(hysteresis::fit_hysteresis, module)?)?;
    module.add_function(wrap_pyfunction!(identify, module)?)?;
    module.add_function(wrap_pyfunction!(refine::refine, module)?)?;
    module.add_function(wrap_pyfunction!(sensitivities::sensitivities, module)?)
}
