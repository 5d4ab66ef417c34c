//! The inverse of the cascade.

use crate::arrays::from_vector;
use crate::errors::{parameter, to_python};
use crate::operators::{Deadzones, PlayBank, channels};
use gpi_core::operators::{InverseGpi as Inverse, InverseState, Operator, OperatorError};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::sync::atomic::{AtomicU64, Ordering};

/// The exact inverse of a cascade: ``u = D^-1[P^-1[v]]``, see ``Gpi.inverse``.
///
/// P^-1 are plays and D^-1 deadzones. What the limits do not reach is clamped: the drive stops at its limit, and the
/// plays go on from there as they do forwards.
///
/// Methods
/// -------
/// __call__(v)
///     u from rest, for a signal v of shape (samples,) or (samples, channels) in the unit of v; u is shaped like v, in its
///     own unit. Warns (``UserWarning``) where v is out of reach.
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
    /// The knots, shape (m,), in the unit of z; the drive at each, shape (m,), in the unit of u; the slopes before the first
    /// one and behind each, shape (m + 1,), in units of u per unit of z.
    #[getter]
    fn curve<'py>(&self, py: Python<'py>) -> [Bound<'py, PyAny>; 3] {
        let curve = self.inverse.curve();
        let slopes = [&[curve.below()], curve.slopes()].concat();
        [curve.knots(), curve.heights(), &slopes].map(|values| from_vector(py, values))
    }

    /// The lowest and the highest drive u, in the unit of u; infinite where there is no limit.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        self.inverse.drive().into()
    }

    /// The lowest and the highest z, the envelope's outputs at these drives, in the unit of z.
    #[getter]
    fn reach(&self) -> (f64, f64) {
        self.inverse.reach().into()
    }

    /// The lowest and the highest v, in the unit of v, that are within reach wherever the plays stand.
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
    ///     What the cascade shall give, in the unit of v; each channel has a state of its own.
    /// state : array_like, shape (1 + n,) or (1 + n, channels), optional
    ///     The number of samples that were out of reach, then where the plays stand, in the unit of v; zeros (rest)
    ///     when left out.
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
        channels(
            v,
            ("v", length),
            state,
            |values| self.read(values),
            |state, input, output| {
                let before = state.out_of_reach;
                self.inverse.block(state, input, output);
                out_of_reach.fetch_add(u64::from(state.out_of_reach - before), Ordering::Relaxed);
                write(state)
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
        read(&self.inverse, values).map_err(to_python)
    }
}

/// From the count, then the plays.
pub(crate) fn read(
    inverse: &Inverse<Vec<f64>, Vec<f64>>,
    values: &[f64],
) -> Result<InverseState<Vec<f64>>, OperatorError> {
    let plays = inverse.plays().state_from(values[1..].to_vec())?;
    Ok(InverseState { plays, out_of_reach: values[0] as u32 })
}

/// The count, then the plays.
pub(crate) fn write(state: &InverseState<Vec<f64>>) -> Vec<f64> {
    let count = std::iter::once(f64::from(state.out_of_reach));
    count.chain(state.plays.plays().iter().copied()).collect()
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<InverseGpi>()
}
