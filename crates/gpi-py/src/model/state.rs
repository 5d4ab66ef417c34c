//! The state of a model as one vector.

use crate::arrays::from_vector;
use crate::errors::parameter;
use crate::operators::{read_state, write_state};
use gpi_core::{LoopStep, Model, ModelState};
use nalgebra::DVector;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The previous input and the play outputs of every input, then the states of G. If there are effects: the memory of each,
/// preceded by its length, and the number of past samples.
pub(super) fn write(state: &ModelState) -> Vec<f64> {
    let plays = state.hysteresis.iter().flat_map(write_state);
    let values = plays.chain(state.linear.iter().copied());
    if state.effects.is_empty() {
        return values.collect();
    }
    let sized = |memory: &Vec<f64>| [&[memory.len() as f64], &memory[..]].concat();
    let effects = state.effects.iter().flat_map(sized);
    values.chain(effects).chain(std::iter::once(state.sample as f64)).collect()
}

/// What a loop does in one of its steps, as vectors by name.
pub(super) fn write_loop_step<'py>(
    py: Python<'py>,
    step: &LoopStep,
) -> PyResult<Bound<'py, PyDict>> {
    let fields = PyDict::new(py);
    fields.set_item("states", from_vector(py, &step.states))?;
    fields.set_item("inputs", from_vector(py, &step.inputs))?;
    fields.set_item("next", from_vector(py, &step.next))?;
    fields.set_item("earlier", from_vector(py, &step.earlier))?;
    fields.set_item("drives", from_vector(py, &step.drives))?;
    Ok(fields)
}

/// The inverse of [`write`].
pub(crate) fn read(model: &Model, values: &[f64]) -> PyResult<ModelState> {
    let sizes: Vec<usize> =
        model.hysteresis().iter().map(|h| 1 + h.plays().weights().len()).collect();
    let expected = sizes.iter().sum::<usize>() + model.linear().order();
    let (values, mut others) = values.split_at(expected.min(values.len()));
    let found = values.len() + others.len();
    let wrong = || parameter(format!("`state` has {found} elements, but {expected} are needed"));
    let mut effects = Vec::new();
    for _ in model.effects() {
        let (&size, rest) = others.split_first().ok_or_else(wrong)?;
        let (own, rest) = rest.split_at_checked(size as usize).ok_or_else(wrong)?;
        effects.push(own.to_vec());
        others = rest;
    }
    let mut sample = 0;
    if !effects.is_empty()
        && let Some((&last, rest)) = others.split_first()
    {
        (sample, others) = (last as usize, rest);
    }
    if values.len() != expected || !others.is_empty() {
        return Err(wrong());
    }
    let mut rest = values;
    let mut hysteresis = Vec::new();
    for (operator, size) in model.hysteresis().iter().zip(sizes) {
        let (own, others) = rest.split_at(size);
        hysteresis.push(read_state(operator, own)?);
        rest = others;
    }
    let linear = DVector::from_column_slice(rest);
    Ok(ModelState { hysteresis, linear, effects, sample })
}
