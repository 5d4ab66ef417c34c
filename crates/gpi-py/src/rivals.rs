//! Simple models of a record.

use crate::calls;
use gpi_core::rivals::{self as core, Rival};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Fits four simple models to a record, and scores them on held-out data.
///
/// A model with hysteresis and dynamics is worth its parameters only if it predicts better than these. With c a constant
/// offset, u_i input i, and F_r the play of half-width r, every output is
///
/// - ``static-polynomial``: ``y(k) = c + sum_i sum_n a_in u_i(k)^n``, at most of degree 5;
/// - ``plays``: ``y(k) = c + sum_i (a_i u_i(k-d) + sum_j p_ij F_rij[u_i](k-d))``, 20 plays with half-widths that are uniform
///   over half the span of u_i, and one delay d;
/// - ``fir``: ``y(k) = c + sum_i sum_l h_il u_i(k-l)``;
/// - ``arx``: ``y(k) = c + sum_l a_l y(k-l) + sum_i sum_l b_il u_i(k-l)``, simulated without measured outputs.
///
/// Degree, delay, length and a ridge are chosen by cross-validation on the training data, the orders of ``arx`` by the
/// simulation error there. The offset of the training data is kept. Before the first sample, u has its first value; ``arx``
/// starts from the measured first outputs.
///
/// Parameters
/// ----------
/// record : Record or path
///     Training data, u of shape (samples, inputs) and y of shape (samples, outputs). Its scored samples are used.
/// holdout : Record or path, optional
///     Held-out data. When left out, ten blocks of time of each experiment of ``record`` are held out, as in ``explain``.
///
/// Returns
/// -------
/// list of dict
///     Rows of ``name``, ``detail`` (what was chosen), ``train_rms`` and ``holdout_rms`` (rms errors in the output's unit). A
///     model that the data cannot determine is left out.
///
/// Raises
/// ------
/// DataError
///     ``holdout`` has other numbers of inputs or outputs.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 100.0), (0.0, 10.0))
/// >>> found = gpi.rivals(gpi.Record(u, u**3, rate=1000.0))
/// >>> [row["name"] for row in found]
/// ['static-polynomial', 'plays', 'fir', 'arx']
/// >>> found[0]["detail"], found[0]["holdout_rms"] < 1e-6
/// ('degree 3', True)
#[pyfunction]
#[pyo3(signature = (record, holdout = None))]
fn rivals<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyAny>,
    holdout: Option<&Bound<'py, PyAny>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let record = calls::record("record", record, "gpi.rivals(")?;
    let holdout = calls::optional_record("holdout", holdout, "gpi.rivals(record, ")?;
    let (record, holdout) =
        (&record.get().record, holdout.as_ref().map(|other| &other.get().record));
    let found = py.detach(|| match holdout {
        Some(other) => core::rivals(record, Some(other)),
        None => core::rivals(&gpi_core::explain::hold_out(record)?, None),
    });
    rows(py, &found.map_err(crate::errors::to_python)?)
}

/// One dictionary a rival.
pub(crate) fn rows<'py>(py: Python<'py>, rivals: &[Rival]) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let row = |rival: &Rival| {
        let row = PyDict::new(py);
        row.set_item("name", rival.name)?;
        row.set_item("detail", &rival.detail)?;
        row.set_item("train_rms", rival.train_rms)?;
        row.set_item("holdout_rms", rival.holdout_rms)?;
        Ok(row)
    };
    rivals.iter().map(row).collect()
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(rivals, module)?)
}
