//! Measured records.

use crate::arrays::{experiments, from_matrix, from_owned, vector};
use crate::channels::{Label, channels, label, names, units};
use crate::errors::{parameter, to_python};
use crate::plotting::{in_notebook, plot};
use gpi_core::{Experiment, Matrix, TimeAxis};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PySlice;

/// Measured experiments with one actuator at one sampling rate.
///
/// Parameters
/// ----------
/// u, y : array_like, shape (samples,) or (samples, channels), or a list of arrays
///     Input and output, each channel in its own unit. A list holds one array for each experiment.
/// rate : float
///     Sampling rate in Hz.
/// covariates : array_like, shape (samples,) or (samples, columns), or a list of arrays, optional
///     Other measured columns, each in its own unit.
/// warmup : int or list of int, optional
///     Number of samples at the start of each experiment that drive the model but are not scored; none when left out.
/// input_names, output_names, covariate_names : list of str, optional
///     Names of the columns. When left out, they are u, y and x, with numbers if there are several columns.
/// input_units, output_units, covariate_units : list of str, optional
///     Units of the columns, which are used as labels.
///
/// Raises
/// ------
/// DataError
///     A sample is NaN or infinite (the message names column and row), the lengths differ, or there are no samples.
/// ParameterError
///     The rate is not positive, or an array has another shape.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = np.sin(np.arange(100.0))
/// >>> gpi.Record(u, 2 * u, rate=1000.0, input_units=["V"], output_units=["um"])
/// Record(100 samples at 1000 Hz, u [V] -> y [um])
///
/// A record is a sequence of samples. A slice is a part of it:
///
/// >>> record = gpi.Record(u, 2 * u, rate=1000.0)
/// >>> len(record), record[20:50], record.time[0][-1].item()
/// (100, Record(30 samples at 1000 Hz, u -> y), 0.099)
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Record {
    pub(crate) record: gpi_core::Record,
}

#[derive(FromPyObject)]
enum Warmup {
    Same(usize),
    Each(Vec<usize>),
}

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (u, y, rate, *, covariates = None, warmup = None,
        input_names = None, output_names = None, covariate_names = None,
        input_units = None, output_units = None, covariate_units = None))]
    fn new(
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        rate: f64,
        covariates: Option<&Bound<'_, PyAny>>,
        warmup: Option<Warmup>,
        input_names: Option<Vec<Label>>,
        output_names: Option<Vec<Label>>,
        covariate_names: Option<Vec<Label>>,
        input_units: Option<Vec<Label>>,
        output_units: Option<Vec<Label>>,
        covariate_units: Option<Vec<Label>>,
    ) -> PyResult<Self> {
        let (u, y) = (experiments("u", u)?, experiments("y", y)?);
        let x = match covariates {
            Some(x) => experiments("covariates", x)?,
            None => u.iter().map(|u| Matrix::zeros(u.nrows(), 0)).collect(),
        };
        let warmups = match warmup.unwrap_or(Warmup::Same(0)) {
            Warmup::Same(count) => vec![count; u.len()],
            Warmup::Each(counts) => counts,
        };
        let lengths = [("y", y.len()), ("covariates", x.len()), ("warmup", warmups.len())];
        for (name, length) in lengths {
            if length != u.len() {
                let message = format!("`u` has {} experiments, but `{name}` {length}", u.len());
                return Err(parameter(message));
            }
        }
        let width = |signals: &[Matrix]| signals.first().map_or(0, Matrix::ncols);
        let inputs = channels("u", width(&u), input_names, input_units)?;
        let outputs = channels("y", width(&y), output_names, output_units)?;
        let others = channels("x", width(&x), covariate_names, covariate_units)?;
        let experiments = u
            .into_iter()
            .zip(y)
            .zip(x)
            .zip(warmups)
            .map(|(((input, output), covariates), warmup)| Experiment {
                input,
                output,
                covariates,
                warmup,
                held_out: vec![],
            })
            .collect();
        let record = gpi_core::Record::new(experiments, rate, inputs, outputs, others);
        Ok(Self { record: record.map_err(to_python)? })
    }

    /// Input of each experiment, each of shape (samples, inputs), in the inputs' units.
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.record.experiments().iter().map(|e| from_matrix(py, &e.input)).collect()
    }

    /// Output of each experiment, each of shape (samples, outputs), in the outputs' units.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.record.experiments().iter().map(|e| from_matrix(py, &e.output)).collect()
    }

    /// Other measured columns of each experiment, each of shape (samples, covariates), in their units.
    #[getter]
    fn covariates<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.record.experiments().iter().map(|e| from_matrix(py, &e.covariates)).collect()
    }

    /// Time of the samples of each experiment, each of shape (samples,), in s; 0 is the first sample of the experiment.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        let rate = self.record.rate();
        let time = |rows: usize| (0..rows).map(|k| k as f64 / rate).collect();
        self.record.experiments().iter().map(|e| from_owned(py, time(e.input.nrows()))).collect()
    }

    /// Number of samples at the start of each experiment that are not scored.
    #[getter]
    fn warmup(&self) -> Vec<usize> {
        self.record.experiments().iter().map(|e| e.warmup).collect()
    }

    /// Sampling rate in Hz.
    #[getter]
    fn rate(&self) -> f64 {
        self.record.rate()
    }

    /// Number of samples of all experiments together.
    #[getter]
    fn samples(&self) -> usize {
        self.record.samples()
    }

    /// Names of the inputs.
    #[getter]
    fn input_names(&self) -> Vec<String> {
        names(self.record.inputs())
    }

    /// Names of the outputs.
    #[getter]
    fn output_names(&self) -> Vec<String> {
        names(self.record.outputs())
    }

    /// Names of the other measured columns.
    #[getter]
    fn covariate_names(&self) -> Vec<String> {
        names(self.record.covariates())
    }

    /// Units of the inputs, empty where unknown.
    #[getter]
    fn input_units(&self) -> Vec<String> {
        units(self.record.inputs())
    }

    /// Units of the outputs, empty where unknown.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units(self.record.outputs())
    }

    /// Units of the other measured columns, empty where unknown.
    #[getter]
    fn covariate_units(&self) -> Vec<String> {
        units(self.record.covariates())
    }

    /// Splits every experiment in time.
    ///
    /// Parameters
    /// ----------
    /// fraction : float
    ///     Share of the scored samples that goes into the first record, a fraction between 0 and 1.
    ///
    /// Returns
    /// -------
    /// tuple of Record
    ///     The first part and the second part. The second record contains the first part as its warm-up: a simulation begins
    ///     there, but only the second part is scored.
    fn split(&self, fraction: f64) -> PyResult<(Self, Self)> {
        let (first, rest) = self.record.split(fraction).map_err(to_python)?;
        Ok((Self { record: first }, Self { record: rest }))
    }

    /// The part between two times.
    ///
    /// Parameters
    /// ----------
    /// start, end : float
    ///     Times in seconds, counted from the first sample of each experiment. The sample at ``end`` is not included.
    ///
    /// Returns
    /// -------
    /// Record
    ///     The samples of every experiment between the two times. What is left of a warm-up stays one. The state at the start of
    ///     a part is unknown; ``split`` keeps what went before as warm-up.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     There is no scored sample between the times.
    ///
    /// Examples
    /// --------
    /// >>> record = gpi.Record(np.arange(100.0), np.arange(100.0), rate=10.0)
    /// >>> record.between(2.0, 5.0)
    /// Record(30 samples at 10 Hz, u -> y)
    fn between(&self, start: f64, end: f64) -> PyResult<Self> {
        self.record.between(start, end).map(|record| Self { record }).map_err(to_python)
    }

    /// Converts an experiment to a pandas data frame; see ``gpi_hammerstein.interop.to_pandas``.
    ///
    /// Parameters
    /// ----------
    /// experiment : int
    ///     The number of the experiment, counted from 0.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    ///     ``t [s]`` and the channels, with their units in brackets.
    #[pyo3(signature = (experiment = 0))]
    fn to_pandas<'py>(slf: &Bound<'py, Self>, experiment: usize) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("gpi_hammerstein.interop")?.call_method1("to_pandas", (slf, experiment))
    }

    /// Converts an experiment to a Polars data frame; see ``gpi_hammerstein.interop.to_polars``.
    ///
    /// Parameters
    /// ----------
    /// experiment : int
    ///     The number of the experiment, counted from 0.
    ///
    /// Returns
    /// -------
    /// polars.DataFrame
    ///     ``t [s]`` and the channels, with their units in brackets.
    #[pyo3(signature = (experiment = 0))]
    fn to_polars<'py>(slf: &Bound<'py, Self>, experiment: usize) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("gpi_hammerstein.interop")?.call_method1("to_polars", (slf, experiment))
    }

    fn __len__(&self) -> usize {
        self.record.samples()
    }

    fn __getitem__(&self, samples: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(slice) = samples.cast::<PySlice>() else {
            return Err(PyTypeError::new_err(
                "a part of a record is a slice of samples, such as record[100:200], or of time, record.between(0.1, 0.2)",
            ));
        };
        let length = isize::try_from(self.record.samples()).unwrap_or(isize::MAX);
        let found = slice.indices(length)?;
        if found.step != 1 {
            return Err(parameter(format!(
                "the step of the slice is {}, but must be 1: a record has one rate; filter it and make a new one for \
                 another rate",
                found.step
            )));
        }
        let place = |index: isize| usize::try_from(index).unwrap_or(0);
        let part = self.record.slice(place(found.start)..place(found.stop));
        part.map(|record| Self { record }).map_err(to_python)
    }

    /// Draws inputs and outputs over time; see ``gpi_hammerstein.plot.record``.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes for the outputs; those of a new figure when left out.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     The outputs' axes.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("record", slf.as_any(), ax)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook("record", slf.as_any())
    }

    fn __repr__(&self) -> String {
        let count = self.record.experiments().len();
        let experiments = if count == 1 { String::new() } else { format!("{count} experiments, ") };
        format!(
            "Record({experiments}{} samples at {} Hz, {} -> {})",
            self.record.samples(),
            self.record.rate(),
            label(self.record.inputs()),
            label(self.record.outputs())
        )
    }
}

/// Reads the sampling rate from time stamps.
///
/// Parameters
/// ----------
/// stamps : array_like, shape (samples,)
///     Time in seconds.
///
/// Returns
/// -------
/// tuple of float
///     The rate in Hz, and the largest deviation of a time step from the median step as a fraction of the median step.
///
/// Raises
/// ------
/// DataError
///     The time stamps do not increase, have gaps or are not uniform. The message names the row.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> gpi.time_axis([0.0, 0.5, 1.0])
/// (2.0, 0.0)
#[pyfunction]
fn time_axis(stamps: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let axis = TimeAxis::read(&vector("stamps", stamps)?).map_err(to_python)?;
    Ok((axis.rate, axis.jitter))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Record>()?;
    module.add_function(wrap_pyfunction!(time_axis, module)?)
}
