//! Parts of an explanation as dictionaries.

use crate::figures::figures;
use gpi_core::explain as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Error figures on the training data and on the held-out data.
pub(super) fn errors<'py>(py: Python<'py>, errors: &core::Errors) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("train", figures(py, &errors.train)?)?;
    result.set_item("holdout", figures(py, &errors.holdout)?)?;
    Ok(result)
}

/// One step with its parameters and its evidence.
pub(super) fn step<'py>(py: Python<'py>, step: &core::Step) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("effect", step.effect)?;
    let parameters = step.parameters.iter().zip(&step.units).map(|(parameter, unit)| {
        let row = PyDict::new(py);
        row.set_item("name", &parameter.name)?;
        row.set_item("value", parameter.value)?;
        row.set_item("std", Some(parameter.deviation).filter(|std| std.is_finite()))?;
        row.set_item("unit", unit)?;
        row.set_item("determined", parameter.estimate().determined)?;
        PyResult::Ok(row)
    });
    row.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
    let evidence = PyDict::new(py);
    evidence.set_item("promised", step.promised)?;
    evidence.set_item("deviance", step.deviance)?;
    evidence.set_item("chance", step.chance)?;
    evidence.set_item("dropped", step.dropped.clone())?;
    evidence.set_item("probability", step.probability)?;
    let alternatives = PyDict::new(py);
    for (name, probability) in &step.alternatives {
        alternatives.set_item(name, probability)?;
    }
    evidence.set_item("alternatives", alternatives)?;
    row.set_item("evidence", evidence)?;
    row.set_item("train_rms", step.train_rms)?;
    row.set_item("holdout_rms", step.holdout_rms)?;
    Ok(row)
}

/// A resonance at one amplitude.
pub(super) fn resonance<'py>(
    py: Python<'py>,
    one: &core::Resonance,
) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("swing", one.swing)?;
    row.set_item("frequency", one.frequency)?;
    row.set_item("std", one.deviation)?;
    Ok(row)
}

/// An effect that was tried and not accepted.
pub(super) fn rejected<'py>(py: Python<'py>, one: &core::Rejected) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("effect", one.effect)?;
    row.set_item("holdout_rms", one.holdout_rms)?;
    row.set_item("why", &one.why)?;
    row.set_item("confounded_with", one.confounded_with.clone())?;
    row.set_item("probability", one.probability)?;
    Ok(row)
}

/// One dictionary a wrong sample.
pub(super) fn wrong_samples<'py>(
    py: Python<'py>,
    found: &core::Explanation,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let mut rows = Vec::new();
    for (experiment, outputs) in found.wrong_samples.iter().enumerate() {
        for (output, places) in found.model.outputs().iter().zip(outputs) {
            for place in places {
                let row = PyDict::new(py);
                row.set_item("experiment", experiment)?;
                row.set_item("output", &output.name)?;
                row.set_item("row", place)?;
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

/// One dictionary a test, with the output's name.
pub(super) fn tests<'py>(
    py: Python<'py>,
    tests: &[core::ResidualTest],
    model: &gpi_core::Model,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let row = |test: &core::ResidualTest| {
        let row = PyDict::new(py);
        row.set_item("name", test.name)?;
        row.set_item("output", &model.outputs()[test.output].name)?;
        row.set_item("statistic", test.statistic)?;
        row.set_item("threshold", test.threshold)?;
        row.set_item("p_value", test.significance.map(|own| own.p_value))?;
        row.set_item("level", test.significance.map(|own| own.level))?;
        row.set_item("passed", test.passed())?;
        row.set_item("points_to", &test.points_to)?;
        Ok(row)
    };
    tests.iter().map(row).collect()
}
