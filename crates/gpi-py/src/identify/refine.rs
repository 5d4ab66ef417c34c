//! Joint refinement of all parts of a model.

use crate::calls;
use crate::errors::to_python;
use crate::model::{Model, Refinement};
use crate::progress::interruptible;
use gpi_core::identify::{self as core, RefineOptions};
use pyo3::prelude::*;

/// Refines all parts of a model jointly on a record.
///
/// The Levenberg-Marquardt algorithm minimizes the simulation error (free run from the input alone), (T3) in the theory, with
/// respect to the weights of plays and deadzones, the poles and zeros of G, the offset, and the unknown initial states of
/// experiments. The DC gain of G is fixed, and the half-widths fix the scale of the envelope. ``identify`` ends with this
/// refinement.
///
/// Parameters
/// ----------
/// model : Model
///     Initial model.
/// record : Record or path
///     Training data.
/// thresholds : bool
///     Whether to estimate the thresholds of the deadzones too; they keep their signs.
/// half_widths : bool
///     Whether to estimate the half-widths of the plays too; the widest is fixed and sets the scale.
/// robust : bool, optional
///     Whether to use Huber's loss instead of least squares. When left out, it is used if the residual has isolated
///     outliers.
/// offset_knots : int
///     Number of knots of a slowly varying offset of each experiment; the model keeps the mean of the offset.
/// progress : callable, optional
///     Called with a ``Progress``: the stage, the trial, the fraction done and the best error so far; an exception stops the work.
///
/// Returns
/// -------
/// Model
///     The refined model, with its ``refinement``.
///
/// Raises
/// ------
/// DataError
///     The channels differ from the model's, a signal is constant, or there are fewer samples than parameters.
/// ParameterError
///     The record has another rate than the model, or the model is unstable.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(4000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = np.convolve(gpi.PlayBank([0, 2.0], [1.0, 0.5])(u), [0.0, 0.7, 0.3])[:4000]
/// >>> record = gpi.Record(u, y, rate=1000.0, warmup=100)
/// >>> model = gpi.identify(record, half_widths=[0, 2], thresholds=0)
/// >>> refined = gpi.refine(model, record)
/// >>> refined.refinement.status in ("converged", "stalled")
/// True
#[pyfunction]
#[pyo3(signature = (model, record, *, thresholds = false, half_widths = false, robust = None,
    offset_knots = 1, progress = None))]
pub(super) fn refine(
    py: Python<'_>,
    model: &Model,
    record: &Bound<'_, PyAny>,
    thresholds: bool,
    half_widths: bool,
    robust: Option<bool>,
    offset_knots: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Model> {
    let options = RefineOptions { thresholds, half_widths, robust, offset_knots };
    let record = calls::record("record", record, "gpi.refine(model, ")?;
    let (start, record) = (&model.model, &record.get().record);
    let (refined, refinement) =
        interruptible(py, progress, |report| core::refine(start, record, &options, report))?;
    let refined = refined.with_prediction(&refinement, record).map_err(to_python)?;
    let refinement = Some(Py::new(py, Refinement::new(&refined, refinement)?)?);
    Ok(Model { model: refined, identification: None, refinement })
}
