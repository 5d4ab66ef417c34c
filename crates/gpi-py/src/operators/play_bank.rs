//! The weighted bank of plays.

use super::by_channel::by_channel;
use crate::arrays::{from_vector, vector};
use crate::errors::{parameter, to_python};
use gpi_core::operators::{self, Operator};
use pyo3::prelude::*;

type Bank = operators::PlayBank<Vec<f64>>;

/// A weighted bank of plays: ``v(k) = sum_i p_i F_{r_i}[z](k)`` (equation 11 of the paper).
///
/// Each play follows (7), ``F(k) = max(z(k) - r, min(z(k) + r, F(k-1)))``. It starts from rest, F(-1) = 0.
///
/// Parameters
/// ----------
/// half_widths : array_like, shape (n,)
///     r_i >= 0, half the width of the gap, in the input's unit.
/// weights : array_like, shape (n,)
///     p_i, of any sign, in output units per input unit.
///
/// Raises
/// ------
/// ParameterError
///     The lengths differ, a value is not finite, or a half-width is negative.
///
/// Methods
/// -------
/// __call__(z, *, threads=1)
///     Return v from rest, for a signal z of shape (samples,) or (samples, channels) in the input's unit; v is shaped like
///     z, in its own unit. ``threads`` has the meaning that it has in ``run``.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> bank = gpi.PlayBank([0.0, 0.5], [1.0, 1.0])
/// >>> bank([2.0, 1.5]).tolist()
/// [3.5, 3.0]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct PlayBank {
    pub(crate) bank: Bank,
}

#[pymethods]
impl PlayBank {
    #[new]
    fn new(half_widths: &Bound<'_, PyAny>, weights: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (r, p) = (vector("half_widths", half_widths)?, vector("weights", weights)?);
        Ok(Self { bank: Bank::new(r, p).map_err(to_python)? })
    }

    /// Half-widths r_i, shape (n,), in the input's unit.
    #[getter]
    fn half_widths<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.bank.half_widths())
    }

    /// Weights p_i, shape (n,), in output units per input unit.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.bank.weights())
    }

    // Python does not show the docstring of `__call__`: the class documents the call.
    #[pyo3(signature = (z, *, threads = 1))]
    fn __call__<'py>(&self, z: &Bound<'py, PyAny>, threads: usize) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.run(z, None, threads)?.0)
    }

    /// The output from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// z : array_like, shape (samples,) or (samples, channels)
    ///     Input, in its unit; each channel has plays of its own.
    /// state : array_like, shape (n,) or (n, channels), optional
    ///     Play outputs F_i(-1) in the input's unit; zeros (rest) when left out.
    /// threads : int
    ///     Number of threads. The time of each channel is divided into as many parts, which are computed in parallel. More
    ///     than one thread is worthwhile from about a million samples.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     v in the shape of z, in its own unit, and the state, shape (n,) or (n, channels), in the input's unit.
    #[pyo3(signature = (z, state = None, *, threads = 1))]
    fn run<'py>(
        &self,
        z: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, PyAny>>,
        threads: usize,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        if threads == 0 {
            return Err(parameter("`threads` = 0: at least one is needed".to_owned()));
        }
        let bank = &self.bank;
        let read = |plays: &[f64]| bank.state_from(plays.to_vec()).map_err(to_python);
        by_channel(z, ("z", self.bank.weights().len()), state, read, |state, input, output| {
            if threads == 1 {
                bank.block(state, input, output);
            } else {
                bank.block_on(threads, state, input, output);
            }
            state.plays().to_vec()
        })
    }

    /// The inverse bank (Kuhnen 2003), (T9) in the theory.
    ///
    /// With the plays in ascending order of their half-widths and P_i = p_0 + .. + p_i, the inverse has the half-widths
    /// ``r'_i = sum_{j<=i} p_j (r_i - r_j)`` and the weights ``p'_0 = 1/P_0`` and ``p'_i = 1/P_i - 1/P_{i-1}``.
    ///
    /// Returns
    /// -------
    /// PlayBank
    ///     The operator from v to z.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     A slope P_i is not positive. Without a play of half-width zero, the first slope is zero.
    fn inverse(&self) -> PyResult<Self> {
        Ok(Self { bank: self.bank.inverse().map_err(to_python)? })
    }

    fn __repr__(&self) -> String {
        format!("PlayBank({} plays, weights sum to {})", self.bank.weights().len(), sum(&self.bank))
    }
}

fn sum(bank: &Bank) -> f64 {
    bank.weights().iter().sum()
}
