//! NumPy arrays in and out.

use crate::errors::parameter;
use gpi_core::Matrix;
use num_complex::Complex64;
use numpy::ndarray::{Array1, Array2, Array3, ArrayViewD};
use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple, PyWeakrefReference};

/// Runs `read` on anything that NumPy turns into an array of floats.
fn with_array<T>(
    name: &str,
    value: &Bound<'_, PyAny>,
    read: impl FnOnce(ArrayViewD<'_, f64>) -> PyResult<T>,
) -> PyResult<T> {
    let py = value.py();
    let options = PyDict::new(py);
    options.set_item("dtype", "float64")?;
    let array = py
        .import("numpy")?
        .call_method("asarray", (value,), Some(&options))
        .map_err(|error| parameter(format!("`{name}` is not an array of numbers: {error}")))?;
    let array = array.cast_into::<PyArrayDyn<f64>>()?;
    let _pinned = pinned(&array)?;
    let array = array.try_readonly()?;
    read(array.as_array())
}

/// Keeps the memory of an array, and of the arrays of which it is a view, where it is.
///
/// While Rust reads an array without the interpreter's lock, another thread may call `resize(..., refcheck=False)` on it,
/// which frees the memory. NumPy refuses that for an array that has a weak reference, whatever `refcheck` is.
fn pinned<'py>(
    array: &Bound<'py, PyArrayDyn<f64>>,
) -> PyResult<Vec<Bound<'py, PyWeakrefReference>>> {
    let mut pins = Vec::new();
    let mut next = Some(array.as_any().clone());
    while let Some(own) = next.filter(|own| own.cast::<PyUntypedArray>().is_ok()) {
        pins.push(PyWeakrefReference::new(&own)?);
        next = Some(own.getattr("base")?);
    }
    Ok(pins)
}

fn dimensions<T>(name: &str, shape: &[usize], expected: &str) -> PyResult<T> {
    Err(parameter(format!("`{name}` has shape {shape:?}; {expected} is needed")))
}

/// A vector.
pub(crate) fn vector(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    with_array(name, value, |array| match array.ndim() {
        0 | 1 => {
            Ok(array.as_slice().map_or_else(|| array.iter().copied().collect(), <[_]>::to_vec))
        }
        _ => dimensions(name, array.shape(), "a vector"),
    })
}

/// A matrix; a number is 1 x 1.
pub(crate) fn matrix(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Matrix> {
    with_array(name, value, |array| match *array.shape() {
        [] => Ok(Matrix::from_element(1, 1, array[[]])),
        [rows, columns] => Ok(Matrix::from_fn(rows, columns, |i, j| array[[i, j]])),
        _ => dimensions(name, array.shape(), "a matrix"),
    })
}

/// A signal of shape (samples,) or (samples, channels), and whether it had one dimension.
pub(crate) fn signal(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Matrix, bool)> {
    with_array(name, value, |array| copied(name, &array))
}

fn copied(name: &str, array: &ArrayViewD<'_, f64>) -> PyResult<(Matrix, bool)> {
    match *array.shape() {
        [] => Ok((Matrix::from_element(1, 1, array[[]]), true)),
        [samples] => {
            let values =
                array.as_slice().map_or_else(|| array.iter().copied().collect(), <[_]>::to_vec);
            Ok((Matrix::from_vec(samples, 1, values), true))
        }
        [samples, channels] => {
            Ok((Matrix::from_fn(samples, channels, |k, i| array[[k, i]]), false))
        }
        _ => dimensions(name, array.shape(), "(samples,) or (samples, channels)"),
    }
}

/// Runs `read` on a signal in column-major order, its shape (samples, channels), and whether it had one dimension.
///
/// A signal of one dimension is not copied.
pub(crate) fn with_columns<T>(
    name: &str,
    value: &Bound<'_, PyAny>,
    read: impl FnOnce(&[f64], (usize, usize), bool) -> PyResult<T>,
) -> PyResult<T> {
    with_array(name, value, |array| {
        if let (1, Some(values)) = (array.ndim(), array.as_slice()) {
            return read(values, (values.len(), 1), true);
        }
        let (values, one_dimensional) = copied(name, &array)?;
        read(values.as_slice(), values.shape(), one_dimensional)
    })
}

/// One signal, or a list or tuple of arrays with one array for each experiment.
pub(crate) fn experiments(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Matrix>> {
    let items: Vec<Bound<'_, PyAny>> = if let Ok(list) = value.cast::<PyList>() {
        list.iter().collect()
    } else if let Ok(tuple) = value.cast::<PyTuple>() {
        tuple.iter().collect()
    } else {
        Vec::new()
    };
    if !items.is_empty() && items.iter().all(|item| item.cast::<PyUntypedArray>().is_ok()) {
        items.iter().map(|item| Ok(signal(name, item)?.0)).collect()
    } else {
        Ok(vec![signal(name, value)?.0])
    }
}

/// Markov parameters (outputs, inputs, taps); (taps,) for one input and output.
pub(crate) fn markov(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Matrix>> {
    with_array(name, value, |array| match *array.shape() {
        [_] => Ok(array.iter().map(|&tap| Matrix::from_element(1, 1, tap)).collect()),
        [outputs, inputs, taps] => Ok((0..taps)
            .map(|lag| Matrix::from_fn(outputs, inputs, |o, i| array[[o, i, lag]]))
            .collect()),
        _ => dimensions(name, array.shape(), "(taps,) or (outputs, inputs, taps)"),
    })
}

/// A new column-major array for a signal of shape (samples, channels), or (samples,) if it has one dimension.
///
/// It is NumPy that allocates it: NumPy requests larger memory pages, which saves a third of the time for a long signal.
pub(crate) fn empty_signal<'py>(
    py: Python<'py>,
    (samples, channels): (usize, usize),
    one_dimensional: bool,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let options = PyDict::new(py);
    options.set_item("order", "F")?;
    let shape = if one_dimensional { vec![samples] } else { vec![samples, channels] };
    let array = py.import("numpy")?.call_method("empty", (shape,), Some(&options))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

pub(crate) fn from_vector<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyAny> {
    from_owned(py, values.to_vec())
}

/// An array of these values, which are not copied.
pub(crate) fn from_owned<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyAny> {
    Array1::from_vec(values).into_pyarray(py).into_any()
}

pub(crate) fn from_complex<'py>(py: Python<'py>, values: Vec<Complex64>) -> Bound<'py, PyAny> {
    Array1::from_vec(values).into_pyarray(py).into_any()
}

pub(crate) fn from_matrix<'py>(py: Python<'py>, matrix: &Matrix) -> Bound<'py, PyAny> {
    Array2::from_shape_fn(matrix.shape(), |(i, j)| matrix[(i, j)]).into_pyarray(py).into_any()
}

/// A signal in the form that the call's input had.
pub(crate) fn from_signal(
    py: Python<'_>,
    matrix: Matrix,
    one_dimensional: bool,
) -> Bound<'_, PyAny> {
    if one_dimensional && matrix.ncols() == 1 {
        from_owned(py, matrix.data.into())
    } else {
        from_matrix(py, &matrix)
    }
}

/// Matrices of one shape with the index of the matrix as last axis: (rows, columns, count).
pub(crate) fn from_matrices<'py>(
    py: Python<'py>,
    (rows, columns): (usize, usize),
    matrices: &[Matrix],
) -> Bound<'py, PyAny> {
    let stacked =
        Array3::from_shape_fn((rows, columns, matrices.len()), |(i, j, k)| matrices[k][(i, j)]);
    stacked.into_pyarray(py).into_any()
}
