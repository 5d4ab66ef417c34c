//! Closing the loop.

use crate::identify::interruptible;
use crate::record::Record;
use gpi_core::effects::Units;
use gpi_core::explain as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Explains a record.
#[pyfunction]
#[pyo3(signature = (record, *, effects = None, progress = None))]
fn explain<'py>(
    py: Python<'py>,
    record: &Record,
    effects: Option<Vec<String>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let options = core::ExplainOptions { effects, ..core::ExplainOptions::default() };
    let record = &record.record;
    let found = interruptible(py, progress, |report| core::explain(record, &options, report))?;
    let result = PyDict::new(py);
    result.set_item("effects", found.effects.clone())?;
    let steps: Vec<_> = found
        .steps
        .iter()
        .map(|s| (s.effect, s.deviance, s.chance, s.train_rms, s.holdout_rms))
        .collect();
    result.set_item("steps", steps)?;
    let rejected: Vec<_> = found
        .rejected
        .iter()
        .map(|r| (r.effect, r.holdout_rms, r.why.clone(), r.confounded_with.clone()))
        .collect();
    result.set_item("rejected", rejected)?;
    result.set_item("before", (found.before.0.rms, found.before.1.rms))?;
    result.set_item("after", (found.after.0.rms, found.after.1.rms))?;
    result.set_item("noise", found.noise_floor.rms.clone())?;
    let units = Units { input: "V", output: "um" };
    let blocks: Vec<_> = found
        .blocks
        .iter()
        .map(|b| {
            let quantities = b.block().quantities(units);
            (
                b.name(),
                quantities.into_iter().map(|q| (q.name, q.value, q.unit)).collect::<Vec<_>>(),
            )
        })
        .collect();
    result.set_item("blocks", blocks)?;
    let tests: Vec<_> =
        found.tests.iter().map(|t| (t.name, t.statistic, t.threshold, t.p_value)).collect();
    result.set_item("tests", tests)?;
    result.set_item("model", found.model.to_json().unwrap_or_default())?;
    Ok(result)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(explain, module)?)
}
