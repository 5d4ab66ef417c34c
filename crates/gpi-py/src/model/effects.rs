//! The effects of a model as dictionaries.

use super::refinement::estimate;
use gpi_core::effects::Effect;
use gpi_core::{Estimate, Model};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// One dictionary an effect, with its parameters in their units.
pub(super) fn rows<'py>(py: Python<'py>, model: &Model) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let known = model.estimates().map_or(&[][..], |estimates| &estimates.effects);
    let describe = |(place, effect): (usize, &Effect)| {
        let row = PyDict::new(py);
        row.set_item("name", effect.name())?;
        let own = known
            .get(place)
            .filter(|own| own.name == effect.name())
            .map(|own| own.parameters.clone());
        let parameters = own.unwrap_or_else(|| unknown(model, effect));
        let parameters = parameters.iter().map(|one| estimate(py, one));
        row.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
        Ok(row)
    };
    model.effects().iter().enumerate().map(describe).collect()
}

/// The quantities of an effect of which no uncertainty is known.
fn unknown(model: &Model, effect: &Effect) -> Vec<Estimate> {
    let quantities = model.quantities(effect).into_iter();
    quantities
        .map(|one| Estimate::new(one.name, one.unit, one.value, f64::NAN, one.zero_is_absence))
        .collect()
}
