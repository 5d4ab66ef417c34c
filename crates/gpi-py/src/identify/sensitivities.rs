//! Derivatives of a model's simulated output.

use crate::arrays::{from_matrices, from_matrix, from_vector};
use crate::calls;
use crate::model::Model;
use crate::progress::interruptible;
use gpi_core::identify::{self as core, RefineOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Derivatives of a model's simulated output with respect to the parameters that ``refine`` estimates.
///
/// The DC gain of G is fixed: the element of D that belongs to an input's largest DC gain compensates for changes of
/// ``section[i]`` and ``feedthrough``. All derivatives are stored in memory.
///
/// Parameters
/// ----------
/// model : Model
///     The model at which the derivatives are taken.
/// record : Record or path
///     The input, and the output for the gradient.
/// thresholds, half_widths : bool
///     Whether these are among the parameters, as in ``refine``.
/// offset_knots : int
///     As in ``refine``.
///
/// Returns
/// -------
/// dict
///     ``names``; ``values``, shape (parameters,), each in its own unit; ``jacobians``, one for each experiment, each
///     (outputs, scored samples, parameters), in output units per unit of the parameter; ``gradient``, shape
///     (parameters,), half the gradient of ``cost``; ``hessian``, shape (parameters, parameters), J^T J; ``cost``, the
///     sum of the squared residuals.
///
/// Raises
/// ------
/// DataError, ParameterError
///     As in ``refine``.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = np.convolve(gpi.PlayBank([0, 2.0], [1.0, 0.5])(u), [0.0, 0.7, 0.3])[:2000]
/// >>> record = gpi.Record(u, y, rate=1000.0, warmup=100)
/// >>> model = gpi.identify(record, half_widths=[0, 2], thresholds=0)
/// >>> found = gpi.sensitivities(model, record)
/// >>> found["jacobians"][0].shape == (1, 1900, len(found["names"]))
/// True
#[pyfunction]
#[pyo3(signature = (model, record, *, thresholds = false, half_widths = false, offset_knots = 1))]
pub(super) fn sensitivities<'py>(
    py: Python<'py>,
    model: &Model,
    record: &Bound<'_, PyAny>,
    thresholds: bool,
    half_widths: bool,
    offset_knots: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let options = RefineOptions { thresholds, half_widths, robust: None, offset_knots };
    let record = calls::record("record", record, "gpi.sensitivities(model, ")?;
    let (model, record) = (&model.model, &record.get().record);
    let found =
        interruptible(py, None, |report| core::sensitivities(model, record, &options, report))?;
    let result = PyDict::new(py);
    result.set_item("names", &found.names)?;
    result.set_item("values", from_vector(py, &found.values))?;
    let jacobians = found.jacobians.iter().map(|outputs| {
        let shape = outputs[0].shape();
        from_matrices(py, shape, outputs).call_method1("transpose", (2, 0, 1))
    });
    result.set_item("jacobians", jacobians.collect::<PyResult<Vec<_>>>()?)?;
    result.set_item("gradient", from_vector(py, found.gradient.as_slice()))?;
    result.set_item("hessian", from_matrix(py, &found.hessian))?;
    result.set_item("cost", found.cost)?;
    Ok(result)
}
