//! The effects of a model as dictionaries.

use gpi_core::Model;
use gpi_core::effects::Effect;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// One dictionary an effect, with its parameters in their units.
pub(super) fn rows<'py>(py: Python<'py>, model: &Model) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let describe = |effect: &Effect| {
        let row = PyDict::new(py);
        row.set_item("name", effect.name())?;
        let parameters = model.quantities(effect).into_iter().map(|quantity| {
            let row = PyDict::new(py);
            row.set_item("name", quantity.name)?;
            row.set_item("value", quantity.value)?;
            row.set_item("unit", quantity.unit)?;
            PyResult::Ok(row)
        });
        row.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
        Ok(row)
    };
    model.effects().iter().map(describe).collect()
}
