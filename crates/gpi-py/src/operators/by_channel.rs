//! Operators on signals of several channels.

use crate::arrays::{empty_signal, from_signal, signal, with_columns};
use crate::errors::parameter;
use gpi_core::Matrix;
use numpy::PyArrayMethods;
use pyo3::prelude::*;

/// Runs each channel of a signal from its own state, or from zeros where no state is given.
///
/// `read` turns a vector of `length` numbers into a state; `run` filters one channel and returns the state after its last
/// sample as such a vector.
pub(crate) fn by_channel<'py, S: Send + Sync>(
    value: &Bound<'py, PyAny>,
    (name, length): (&str, usize),
    state: Option<&Bound<'py, PyAny>>,
    read: impl Fn(&[f64]) -> PyResult<S>,
    run: impl Fn(&mut S, &[f64], &mut [f64]) -> Vec<f64> + Sync,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let py = value.py();
    with_columns(name, value, |input, (samples, count), one_dimensional| {
        let begin = match state {
            Some(state) => signal("state", state)?.0,
            None => Matrix::zeros(length, count),
        };
        if begin.ncols() != count {
            let states = begin.ncols();
            let message = format!("`state` has {states} channels, but `{name}` has {count}");
            return Err(parameter(message));
        }
        let states: PyResult<Vec<S>> = begin.column_iter().map(|c| read(c.as_slice())).collect();
        let mut states = states?;
        let array = empty_signal(py, (samples, count), one_dimensional)?;
        let mut writing = array.try_readwrite()?;
        let output = writing.as_slice_mut()?;
        let after: Vec<f64> = py.detach(|| {
            let columns = states.iter_mut().enumerate().map(|(channel, state)| {
                let own = channel * samples..(channel + 1) * samples;
                run(state, &input[own.clone()], &mut output[own])
            });
            columns.flatten().collect()
        });
        drop(writing);
        let after = Matrix::from_vec(length, count, after);
        Ok((array.into_any(), from_signal(py, after, one_dimensional)))
    })
}
