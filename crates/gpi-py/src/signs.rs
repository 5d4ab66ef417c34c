//! What a record shows before any model is fitted to it.

use crate::record::Record;
use gpi_core::explain::signs as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a record shows before any model is fitted to it.
///
/// Parameters
/// ----------
/// record : Record
///     u of shape (samples, inputs) and y of shape (samples, outputs).
///
/// Returns
/// -------
/// dict
///     ``fed_back``: for each input, whether past outputs predict it beyond what its own past predicts, as they do
///     under feedback. ``clipped``: for each output, the part of all samples at which it stands at its largest or
///     smallest value while an input moves. ``excitation_order``: the order of persistent excitation of the inputs,
///     which is the largest number of taps that they determine; None where it grows with the number of taps.
///
/// Raises
/// ------
/// DataError
///     The record is too short.
///
/// Examples
/// --------
/// >>> u = np.sin(0.1 * np.arange(2000))
/// >>> signs(gpi.Record(u, np.minimum(u, 0.5), rate=100.0))["excitation_order"]
/// 2
#[pyfunction]
fn signs<'py>(py: Python<'py>, record: &Record) -> PyResult<Bound<'py, PyDict>> {
    let record = &record.record;
    let found = py.detach(|| core(record)).map_err(crate::errors::to_python)?;
    let row = PyDict::new(py);
    row.set_item("fed_back", found.fed_back)?;
    row.set_item("clipped", found.clipped)?;
    row.set_item("excitation_order", found.excitation_order)?;
    Ok(row)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(signs, module)?)
}
