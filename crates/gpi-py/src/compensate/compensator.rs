//! The causal compensator.

use crate::arrays::from_vector;
use crate::errors::{parameter, to_python};
use crate::operators::{InverseGpi, by_channel, read_inverse_state, write_inverse_state};
use gpi_core::compensate::StreamingCompensator;
use gpi_core::operators::{CompensatorState, Faults, LagsState, Operator};
use pyo3::prelude::*;

type State = CompensatorState<Vec<f64>, Vec<f64>>;

/// A causal compensator, which computes the drive one sample at a time, see ``Model.compensator``.
///
/// ``u = D^-1[P^-1[v]]`` with ``v = (r - offset - sum_i c_i l_i) / gain`` and
/// ``l_i(k+1) = l_i(k) + rate_i (v(k) - l_i(k))``. The reference r must be slow compared with the dynamics. ``gpi export``
/// writes the same compensator in C or in Rust.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> compensator = model.compensator(limits=(0.0, 10.0))
/// >>> drive, state = compensator.run([5.0, 6.0, 5.0], compensator.standing_at(5.0))
/// >>> drive.round(6).tolist()
/// [4.0, 4.666667, 3.666667]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Compensator {
    found: StreamingCompensator,
}

#[pymethods]
impl Compensator {
    /// The inverse of the hysteresis.
    #[getter]
    fn hysteresis(&self) -> InverseGpi {
        InverseGpi::new(self.found.compensator.hysteresis().clone())
    }

    /// DC gain from v to the output without creep, in output units per unit of v.
    #[getter]
    fn gain(&self) -> f64 {
        self.found.compensator.gain()
    }

    /// The output at v = 0, in the output's unit.
    #[getter]
    fn offset(&self) -> f64 {
        self.found.compensator.offset()
    }

    /// Rates of creep, shape (lags,): the fraction of its distance to v that each lag moves in one sample,
    /// ``1 - exp(-1 / (T_i rate))``.
    #[getter]
    fn creep_rates<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.found.compensator.creep().rates())
    }

    /// Gains c_i of creep, in output units per unit of v, shape (lags,).
    #[getter]
    fn creep_gains<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.found.compensator.creep().gains())
    }

    /// Lowest and highest v, in the unit of v. A reference that needs a v outside of this range is taken as a fault: v is
    /// set to the nearest end.
    #[getter]
    fn range(&self) -> (f64, f64) {
        self.found.compensator.range().into()
    }

    /// Names of the parts of the model that the drive compensates.
    #[getter]
    fn compensated(&self) -> Vec<&'static str> {
        self.found.compensated.clone()
    }

    /// Names of the parts of the model that the drive does not compensate, with the reason.
    #[getter]
    fn left(&self) -> Vec<(&'static str, &'static str)> {
        self.found.left.clone()
    }

    /// The steady state after a step of the reference from zero, for ``run``.
    ///
    /// Parameters
    /// ----------
    /// reference : float
    ///     Constant value of the output, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (2 + plays + 2 lags,)
    ///     The last drive, in the input's unit; the number of samples out of reach; the outputs of the plays and of the
    ///     lags, and the rounding errors of the lags, in the unit of v.
    fn standing_at<'py>(&self, py: Python<'py>, reference: f64) -> PyResult<Bound<'py, PyAny>> {
        if !reference.is_finite() {
            return Err(parameter(format!("`reference` = {reference} must be a finite number")));
        }
        Ok(from_vector(py, &written(&self.found.compensator.standing_at(reference))))
    }

    /// The drive from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// reference : array_like, shape (samples,)
    ///     Desired output, in its unit, at the model's rate. The drive is held at samples that are not finite, and v is
    ///     limited to ``range``.
    /// state : array_like, shape (2 + plays + 2 lags,)
    ///     The state that ``standing_at`` or the last call returned, each number in its own unit.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     The drive, shape (samples,), in the input's unit, and the state, shape (2 + plays + 2 lags,), in the units that
    ///     ``state`` has.
    fn run<'py>(
        &self,
        reference: &Bound<'py, PyAny>,
        state: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let compensator = &self.found.compensator;
        by_channel(
            reference,
            ("reference", self.length()),
            Some(state),
            |values| self.read(values),
            |state, input, output| {
                compensator.block(state, input, output);
                written(state)
            },
        )
    }

    fn __repr__(&self) -> String {
        let compensator = &self.found.compensator;
        let [lower, upper] = compensator.hysteresis().drive();
        format!(
            "Compensator({} plays, {} lags, drive {lower} to {upper})",
            compensator.hysteresis().plays().weights().len(),
            compensator.creep().gains().len()
        )
    }
}

impl Compensator {
    pub(crate) fn new(found: StreamingCompensator) -> Self {
        Self { found }
    }

    fn length(&self) -> usize {
        let compensator = &self.found.compensator;
        2 + compensator.hysteresis().plays().weights().len() + 2 * compensator.creep().gains().len()
    }

    fn read(&self, values: &[f64]) -> PyResult<State> {
        let compensator = &self.found.compensator;
        if values.len() != self.length() {
            let (found, expected) = (values.len(), self.length());
            let message = format!(
                "`state` has {found} elements, but {expected} are needed: take it from `standing_at` or `run`"
            );
            return Err(parameter(message));
        }
        let (hysteresis, creep) =
            values[1..].split_at(self.length() - 1 - 2 * compensator.creep().gains().len());
        let (lags, carried) = creep.split_at(creep.len() / 2);
        Ok(State {
            hysteresis: read_inverse_state(compensator.hysteresis(), hysteresis)
                .map_err(to_python)?,
            creep: LagsState { lags: lags.to_vec(), carried: carried.to_vec() },
            drive: values[0],
            faults: Faults::default(),
        })
    }
}

/// The drive, the samples out of reach, the plays, the lags and their rounding errors.
fn written(state: &State) -> Vec<f64> {
    let parts = [
        &[state.drive],
        &write_inverse_state(&state.hysteresis)[..],
        &state.creep.lags,
        &state.creep.carried,
    ];
    parts.concat()
}
