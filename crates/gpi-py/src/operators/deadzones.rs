//! The envelope: a weighted sum of deadzones.

use crate::arrays::{empty_signal, from_vector, vector, with_columns};
use crate::errors::{parameter, to_python};
use gpi_core::operators::{self, DeadzonesState, Operator, Reading};
use numpy::PyArrayMethods;
use pyo3::prelude::*;

type Envelope = operators::Deadzones<Vec<f64>>;

/// A weighted sum of deadzones: ``z(k) = sum_j g_j Z_{eta_j}[u](k)`` (equation 2 of the paper).
///
/// Parameters
/// ----------
/// thresholds : array_like, shape (m,)
///     eta_j, in the input's unit, of either sign.
/// weights : array_like, shape (m,)
///     g_j, of either sign, in units of z per unit of u.
/// reading : {"one-sided", "directional"}
///     The deadzone convention. "one-sided" is the usual memoryless deadzone (eta > 0: max(u - eta, 0); eta < 0:
///     min(u - eta, 0); eta = 0: u). "directional" is equation (3) of the paper exactly as printed, which also
///     depends on whether u rises or falls.
///
/// Raises
/// ------
/// ParameterError
///     The lengths differ, a value is not finite, or the deadzone convention is unknown.
///
/// Methods
/// -------
/// __call__(u)
///     Return z from rest (previous input zero), shape (samples,), in its own unit, for a signal u, shape (samples,), in
///     the input's unit.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> envelope = gpi.Deadzones([0.0, 1.0], [1.0, -0.5])
/// >>> envelope([-2.0, 0.5, 3.0]).tolist()
/// [-2.0, 0.5, 2.0]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Deadzones {
    pub(crate) envelope: Envelope,
}

/// The deadzone convention of this name.
pub(crate) fn read_reading(name: &str) -> PyResult<Reading> {
    let readings = [Reading::OneSided, Reading::Directional];
    let message = || parameter(format!("`reading` = {name}: must be one-sided or directional"));
    readings.into_iter().find(|&known| reading_name(known) == name).ok_or_else(message)
}

fn reading_name(reading: Reading) -> &'static str {
    match reading {
        Reading::OneSided => "one-sided",
        Reading::Directional => "directional",
    }
}

#[pymethods]
impl Deadzones {
    #[new]
    #[pyo3(signature = (thresholds, weights, reading = "one-sided"))]
    fn new(
        thresholds: &Bound<'_, PyAny>,
        weights: &Bound<'_, PyAny>,
        reading: &str,
    ) -> PyResult<Self> {
        let reading = read_reading(reading)?;
        let (eta, g) = (vector("thresholds", thresholds)?, vector("weights", weights)?);
        Ok(Self { envelope: Envelope::new(eta, g, reading).map_err(to_python)? })
    }

    /// Thresholds eta_j, shape (m,), in the input's unit.
    #[getter]
    fn thresholds<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.envelope.thresholds())
    }

    /// Weights g_j, shape (m,), in units of z per unit of u.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.envelope.weights())
    }

    /// The deadzone convention, "one-sided" or "directional".
    #[getter]
    fn reading(&self) -> &'static str {
        reading_name(self.envelope.reading())
    }

    fn __call__<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.run(u, None)?.0)
    }

    /// The output after a given previous input, and the last input.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,)
    ///     Input, in its unit.
    /// previous : float, optional
    ///     u(-1), in the unit of u; zero when left out. Only the directional convention uses it.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray and float
    ///     z, shape (samples,), in its own unit, and the last input, in the unit of u.
    #[pyo3(signature = (u, previous = None))]
    fn run<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        previous: Option<f64>,
    ) -> PyResult<(Bound<'py, PyAny>, f64)> {
        let (py, mut state) = (u.py(), DeadzonesState { previous: previous.unwrap_or(0.0) });
        with_columns("u", u, |input, (samples, channels), one_dimensional| {
            if !one_dimensional {
                let message =
                    format!("`u` has shape ({samples}, {channels}); (samples,) is needed");
                return Err(parameter(message));
            }
            let array = empty_signal(py, (samples, 1), true)?;
            let mut writing = array.try_readwrite()?;
            let output = writing.as_slice_mut()?;
            py.detach(|| self.envelope.block(&mut state, input, output));
            drop(writing);
            Ok((array.into_any(), state.previous))
        })
    }

    fn __repr__(&self) -> String {
        let count = self.envelope.weights().len();
        format!("Deadzones({count} thresholds, {})", self.reading())
    }
}
