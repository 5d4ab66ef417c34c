//! The cascade of envelope and plays.

use super::by_channel::by_channel;
use super::deadzones::Deadzones;
use super::inverse_gpi::InverseGpi;
use super::play_bank::PlayBank;
use super::states::{read_state, write_inverse_state, write_state};
use crate::arrays::{from_vector, vector};
use crate::errors::to_python;
use gpi_core::Hysteresis;
use gpi_core::operators::{self, Operator};
use pyo3::prelude::*;

/// The generalized Prandtl-Ishlinskii operator: ``v = P[D[u]]`` (equation 1 of the paper).
///
/// Parameters
/// ----------
/// envelope : Deadzones
///     The envelope D.
/// plays : PlayBank
///     The bank of plays P.
///
/// Methods
/// -------
/// __call__(u)
///     Return v from rest, for a signal u of shape (samples,) or (samples, channels) in the input's unit; v is shaped like
///     u, in its own unit.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> op = gpi.Gpi(gpi.Deadzones([0.0, 1.0], [1.0, -0.5]), gpi.PlayBank([0.0, 0.5], [1.0, 2.0]))
/// >>> op([3.0]).tolist()
/// [5.0]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Gpi {
    pub(crate) hysteresis: Hysteresis,
}

#[pymethods]
impl Gpi {
    #[new]
    fn new(envelope: &Deadzones, plays: &PlayBank) -> Self {
        Self { hysteresis: operators::Gpi::new(envelope.envelope.clone(), plays.bank.clone()) }
    }

    /// The envelope D.
    #[getter]
    fn envelope(&self) -> Deadzones {
        Deadzones { envelope: self.hysteresis.envelope().clone() }
    }

    /// The bank of plays P.
    #[getter]
    fn plays(&self) -> PlayBank {
        PlayBank { bank: self.hysteresis.plays().clone() }
    }

    fn __call__<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.run(u, None)?.0)
    }

    /// The output from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, channels)
    ///     Input, in its unit; each channel has a state of its own.
    /// state : array_like, shape (1 + n,) or (1 + n, channels), optional
    ///     The previous input, in the unit of u, then the play outputs, in the unit of z; zeros (rest) when left out.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     v in the shape of u, in its own unit, and the state, shape (1 + n,) or (1 + n, channels), in the units that
    ///     ``state`` has.
    #[pyo3(signature = (u, state = None))]
    fn run<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let hysteresis = &self.hysteresis;
        let length = 1 + hysteresis.plays().weights().len();
        let read = |values: &[f64]| read_state(hysteresis, values);
        by_channel(u, ("u", length), state, read, |state, input, output| {
            hysteresis.block(state, input, output);
            write_state(state)
        })
    }

    /// The exact inverse, from v to u, on the interval around zero in which the envelope increases.
    ///
    /// Parameters
    /// ----------
    /// limits : tuple of float, optional
    ///     The lowest and the highest drive, in the unit of u. The drive is clamped where v is out of reach.
    ///
    /// Returns
    /// -------
    /// InverseGpi
    ///     The inverse: ``op(op.inverse()(v))`` equals v.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     A slope of the plays, or the envelope's slope at zero, is not positive; the deadzones are directional; or the
    ///     envelope does not increase between the limits.
    #[pyo3(signature = (*, limits = None))]
    fn inverse(&self, limits: Option<(f64, f64)>) -> PyResult<InverseGpi> {
        let (lower, upper) = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let inverse = self.hysteresis.inverse_within(lower, upper).map_err(to_python)?;
        Ok(InverseGpi::new(inverse))
    }

    /// The state of the inverse that corresponds to a state of this cascade.
    ///
    /// Parameters
    /// ----------
    /// state : array_like, shape (1 + n,)
    ///     What ``run`` returned: the previous input, in the unit of u, then the play outputs, in the unit of z.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (1 + n,)
    ///     A state for ``InverseGpi.run``: the number of samples out of reach, which is zero, then the outputs of its
    ///     plays, in the unit of v.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     The play outputs differ by more than their half-widths allow. No input leads to such a state.
    fn inverse_state<'py>(&self, state: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let forward = read_state(&self.hysteresis, &vector("state", state)?)?;
        let own = self.hysteresis.inverse_state(&forward).map_err(to_python)?;
        Ok(from_vector(state.py(), &write_inverse_state(&own)))
    }

    fn __repr__(&self) -> String {
        let (m, n) =
            (self.hysteresis.envelope().weights().len(), self.hysteresis.plays().weights().len());
        format!("Gpi({m} deadzones, {n} plays)")
    }
}
