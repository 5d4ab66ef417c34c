//! The noncausal FIR inverse.

use crate::arrays::{from_matrices, from_signal, signal};
use crate::errors::to_python;
use gpi_core::linear;
use pyo3::prelude::*;
use pyo3::types::PySlice;

/// A noncausal FIR inverse: ``v(k) = sum_{i=-d}^{r} h_i y(k-i)`` (equation 46 of the paper).
///
/// It is returned by ``StateSpace.noncausal_inverse``.
///
/// Methods
/// -------
/// __call__(y)
///     Return the intermediate signal (equation 47) of an output y of shape (samples,) or (samples, outputs) in the
///     outputs' units.
///
/// Examples
/// --------
/// >>> delay = gpi.StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]])
/// >>> inverse = delay.noncausal_inverse()
/// >>> inverse.r, inverse.d, inverse.taps.round(9).tolist()
/// (0, 1, [[[1.0, 0.0]]])
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct NoncausalFir {
    pub(crate) inverse: linear::NoncausalFir,
}

#[pymethods]
impl NoncausalFir {
    /// h_{-d} .. h_r, shape (inputs, outputs, d + r + 1), in units of v per output unit; inputs and outputs are those of G.
    #[getter]
    fn taps<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrices(py, self.inverse.taps[0].shape(), &self.inverse.taps)
    }

    /// Number of causal taps besides tap 0.
    #[getter]
    fn r(&self) -> usize {
        self.inverse.causal()
    }

    /// Number of noncausal taps, the samples of preview.
    #[getter]
    fn d(&self) -> usize {
        self.inverse.noncausal
    }

    /// Truncation error, (T2) in the theory: the norm of the omitted taps as a fraction of the norm of all taps. It bounds the
    /// relative error of the response.
    #[getter]
    fn error(&self) -> f64 {
        self.inverse.error
    }

    fn __call__(&self, y: &Bound<'_, PyAny>) -> PyResult<IntermediateSignal> {
        let (output, one_dimensional) = signal("y", y)?;
        let signal = self.inverse.apply(&output).map_err(to_python)?;
        Ok(IntermediateSignal { signal, one_dimensional })
    }

    fn __repr__(&self) -> String {
        format!("NoncausalFir(r={}, d={}, error {:.2e})", self.r(), self.d(), self.error())
    }
}

/// An estimate of the intermediate signal from the output.
///
/// It is returned by a call of a ``NoncausalFir``.
///
/// Examples
/// --------
/// >>> delay = gpi.StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]])
/// >>> seen = delay.noncausal_inverse()([0.0, 1.0, 2.0])
/// >>> seen.values.round(9).tolist(), seen.valid
/// ([1.0, 2.0, 2.0], slice(0, 2, 1))
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct IntermediateSignal {
    signal: linear::IntermediateSignal,
    one_dimensional: bool,
}

#[pymethods]
impl IntermediateSignal {
    /// The estimate of v, shaped like the output it was computed from, in the unit of v. Beyond its ends, the output is
    /// extrapolated by its first and its last value.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, self.signal.values.clone(), self.one_dimensional)
    }

    /// The samples that depend on measured outputs only, not on extrapolated ones.
    #[getter]
    fn valid<'py>(&self, py: Python<'py>) -> Bound<'py, PySlice> {
        let valid = &self.signal.valid;
        PySlice::new(py, valid.start as isize, valid.end as isize, 1)
    }

    fn __repr__(&self) -> String {
        let valid = &self.signal.valid;
        let samples = self.signal.values.nrows();
        format!("IntermediateSignal({samples} samples, valid {}..{})", valid.start, valid.end)
    }
}
