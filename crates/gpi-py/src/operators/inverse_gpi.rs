//! The inverse of the cascade.

use super::by_channel::by_channel;
use super::deadzones::Deadzones;
use super::play_bank::PlayBank;
use super::states::{read_inverse_state, write_inverse_state};
use crate::arrays::from_vector;
use crate::errors::{parameter, to_python};
use gpi_core::operators::{InverseGpi as Inverse, InverseState, Operator};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::sync::atomic::{AtomicU64, Ordering};

/// The exact inverse of a cascade: ``u = D^-1[P^-1[v]]``, see ``Gpi.inverse``.
///
/// P^-1 is a bank of plays and D^-1 a sum of deadzones. Where v is out of reach, the drive is clamped to its limit, and the
/// plays continue from there as those of the cascade do.
///
/// Methods
/// -------
/// __call__(v)
///     Return u from rest, for a signal v of shape (samples,) or (samples, channels) in the unit of v; u is shaped like v,
///     in its own unit. A ``UserWarning`` is issued if samples of v are out of reach.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> op = gpi.Gpi(gpi.Deadzones([0.0, 1.0], [1.0, -0.5]), gpi.PlayBank([0.0, 0.5], [1.0, 2.0]))
/// >>> op(op.inverse()([1.0, 5.0, 2.0])).round(12).tolist()
/// [1.0, 5.0, 2.0]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct InverseGpi {
    inverse: Inverse<Vec<f64>, Vec<f64>>,
}

#[pymethods]
impl InverseGpi {
    /// P^-1, from v to z.
    #[getter]
    fn plays(&self) -> PlayBank {
        PlayBank { bank: self.inverse.plays().clone() }
    }

    /// D^-1, from z to u.
    #[getter]
    fn envelope(&self) -> Deadzones {
        Deadzones { envelope: self.inverse.envelope().clone() }
    }

    /// D^-1 as a curve.
    ///
    /// A list of the knots, shape (m,), in the unit of z; the drive at each knot, shape (m,), in the unit of u; and the slopes
    /// before the first knot and after each knot, shape (m + 1,), in units of u per unit of z.
    #[getter]
    fn curve<'py>(&self, py: Python<'py>) -> [Bound<'py, PyAny>; 3] {
        let curve = self.inverse.curve();
        let slopes = [&[curve.below()], curve.slopes()].concat();
        [curve.knots(), curve.heights(), &slopes].map(|values| from_vector(py, values))
    }

    /// The lowest and the highest drive, in the unit of u; infinite where there is no limit.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        self.inverse.drive().into()
    }

    /// The envelope's outputs z at the two limits of the drive, in the unit of z.
    #[getter]
    fn reach(&self) -> (f64, f64) {
        self.inverse.reach().into()
    }

    /// The lowest and the highest v that are within reach for every state of the plays, in the unit of v.
    #[getter]
    fn safe(&self) -> (f64, f64) {
        self.inverse.safe().into()
    }

    fn __call__<'py>(&self, v: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let out_of_reach = AtomicU64::new(0);
        let (u, _) = self.drive(v, None, &out_of_reach)?;
        let beyond = out_of_reach.into_inner();
        if beyond > 0 {
            let (lower, upper) = self.limits();
            let message = format!(
                "{beyond} samples are out of reach and stand at a limit of the drive ({lower}, {upper})"
            );
            PyErr::warn(v.py(), &v.py().get_type::<PyUserWarning>(), &CString::new(message)?, 1)?;
        }
        Ok(u)
    }

    /// The drive from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// v : array_like, shape (samples,) or (samples, channels)
    ///     Desired output of the cascade, in the unit of v; each channel has a state of its own.
    /// state : array_like, shape (1 + n,) or (1 + n, channels), optional
    ///     The number of samples that were out of reach, then the play outputs, in the unit of v; zeros (rest) when left
    ///     out.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     u in the shape of v, in its own unit, and the state, shape (1 + n,) or (1 + n, channels), in the units that
    ///     ``state`` has.
    #[pyo3(signature = (v, state = None))]
    fn run<'py>(
        &self,
        v: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        self.drive(v, state, &AtomicU64::new(0))
    }

    fn __repr__(&self) -> String {
        let (lower, upper) = self.limits();
        format!(
            "InverseGpi({} plays, drive {lower} to {upper})",
            self.inverse.plays().weights().len()
        )
    }
}

impl InverseGpi {
    pub(crate) fn new(inverse: Inverse<Vec<f64>, Vec<f64>>) -> Self {
        Self { inverse }
    }

    fn drive<'py>(
        &self,
        v: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, PyAny>>,
        out_of_reach: &AtomicU64,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let length = 1 + self.inverse.plays().weights().len();
        by_channel(
            v,
            ("v", length),
            state,
            |values| self.read(values),
            |state, input, output| {
                let before = state.out_of_reach;
                self.inverse.block(state, input, output);
                out_of_reach.fetch_add(u64::from(state.out_of_reach - before), Ordering::Relaxed);
                write_inverse_state(state)
            },
        )
    }

    fn read(&self, values: &[f64]) -> PyResult<InverseState<Vec<f64>>> {
        let expected = 1 + self.inverse.plays().weights().len();
        if values.len() != expected {
            let found = values.len();
            let message = format!(
                "`state` has {found} elements, but {expected} are needed: the samples out of reach and the plays"
            );
            return Err(parameter(message));
        }
        read_inverse_state(&self.inverse, values).map_err(to_python)
    }
}
