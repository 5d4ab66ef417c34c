//! Deadzones, plays and their cascade.

use crate::arrays::{self, empty_signal, from_signal, from_vector, vector, with_columns};
use crate::errors::{parameter, to_python};
use crate::inverse_hysteresis::{self, InverseGpi};
use gpi_core::operators::{self, DeadzonesState, GpiState, Operator, Reading};
use gpi_core::{Hysteresis, Matrix};
use numpy::PyArrayMethods;
use pyo3::prelude::*;

type Bank = operators::PlayBank<Vec<f64>>;
type Envelope = operators::Deadzones<Vec<f64>>;

/// A weighted bank of plays: ``v(k) = sum_i p_i F_{r_i}[z](k)`` (equation 11 of the paper).
///
/// Each play follows (7), ``F(k) = max(z(k) - r, min(z(k) + r, F(k-1)))``, from rest F(-1) = 0.
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
///     Unequal lengths, values that are not finite, negative half-widths.
///
/// Methods
/// -------
/// __call__(z, *, threads=1)
///     v from rest, for a signal z of shape (samples,) or (samples, channels) in the input's unit; v is shaped like z, in
///     its own unit. ``threads`` as in ``run``.
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

    // Python shows no text of a call: the class has it.
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
    ///     Stretches into which the time of each channel is cut, and which run at once; more than one pays from about a
    ///     million samples on.
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
        channels(z, ("z", self.bank.weights().len()), state, read, |state, input, output| {
            if threads == 1 {
                bank.block(state, input, output);
            } else {
                bank.block_on(threads, state, input, output);
            }
            state.plays().to_vec()
        })
    }

    /// The bank that undoes this one, its plays from narrow to wide (Kuhnen 2003), (T9) in the theory.
    ///
    /// With P_i = p_0 + .. + p_i: half-widths ``r'_i = sum_{j<=i} p_j (r_i - r_j)``, weights ``p'_0 = 1/P_0`` and
    /// ``p'_i = 1/P_i - 1/P_{i-1}``.
    ///
    /// Returns
    /// -------
    /// PlayBank
    ///     From v to z.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     A slope P_i that is not positive; without a play of half-width zero the first one is zero.
    fn inverse(&self) -> PyResult<Self> {
        Ok(Self { bank: self.bank.inverse().map_err(to_python)? })
    }

    fn __repr__(&self) -> String {
        format!("PlayBank({} plays, weights sum to {})", self.bank.weights().len(), sum(&self.bank))
    }
}

/// Runs each channel of a signal from its own state, all from zeros where none is given; `run` returns the state after
/// the last sample. States hold so many numbers.
pub(crate) fn channels<'py, S: Send + Sync>(
    signal: &Bound<'py, PyAny>,
    (name, length): (&str, usize),
    state: Option<&Bound<'py, PyAny>>,
    read: impl Fn(&[f64]) -> PyResult<S>,
    run: impl Fn(&mut S, &[f64], &mut [f64]) -> Vec<f64> + Sync,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let py = signal.py();
    with_columns(name, signal, |input, (samples, count), one_dimensional| {
        let begin = match state {
            Some(state) => arrays::signal("state", state)?.0,
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

fn sum(bank: &Bank) -> f64 {
    bank.weights().iter().sum()
}

/// A weighted sum of deadzones: ``z(k) = sum_j g_j Z_{eta_j}[u](k)`` (equation 2 of the paper).
///
/// Parameters
/// ----------
/// thresholds : array_like, shape (m,)
///     eta_j, in the input's unit, of either sign.
/// weights : array_like, shape (m,)
///     g_j, of either sign, in units of z per unit of u.
/// reading : {"one-sided", "directional"}
///     "one-sided" is the usual memoryless deadzone (eta > 0: max(u - eta, 0); eta < 0:
///     min(u - eta, 0); eta = 0: u). "directional" is the paper's (3) exactly as printed, which also
///     depends on whether u rises or falls.
///
/// Raises
/// ------
/// ParameterError
///     Unequal lengths, values that are not finite, an unknown reading.
///
/// Methods
/// -------
/// __call__(u)
///     z from rest (previous input zero), shape (samples,), in its own unit, for a signal u, shape (samples,), in the
///     input's unit.
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

/// The reading of a name.
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

    /// "one-sided" or "directional".
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
    ///     u(-1), in the unit of u, which only the directional reading looks at; zero when left out.
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

/// The generalized Prandtl-Ishlinskii operator: ``v = P[D[u]]`` (equation 1 of the paper).
///
/// Parameters
/// ----------
/// envelope : Deadzones
///     D.
/// plays : PlayBank
///     P.
///
/// Methods
/// -------
/// __call__(u)
///     v from rest, for a signal u of shape (samples,) or (samples, channels) in the input's unit; v is shaped like u, in
///     its own unit.
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
        channels(u, ("u", length), state, read, |state, input, output| {
            hysteresis.block(state, input, output);
            write_state(state)
        })
    }

    /// The exact inverse, from v to u, as far around zero as the envelope rises.
    ///
    /// Parameters
    /// ----------
    /// limits : tuple of float, optional
    ///     The lowest and the highest drive, in the unit of u; what they do not reach is clamped.
    ///
    /// Returns
    /// -------
    /// InverseGpi
    ///     ``op(op.inverse()(v))`` is v.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     A slope of the plays, or of the envelope at zero, that is not positive; directional deadzones; limits between
    ///     which the envelope does not rise.
    #[pyo3(signature = (*, limits = None))]
    fn inverse(&self, limits: Option<(f64, f64)>) -> PyResult<InverseGpi> {
        let (lower, upper) = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let inverse = self.hysteresis.inverse_within(lower, upper).map_err(to_python)?;
        Ok(InverseGpi::new(inverse))
    }

    /// The state of the inverse that belongs to a state of this cascade.
    ///
    /// Parameters
    /// ----------
    /// state : array_like, shape (1 + n,)
    ///     What ``run`` returned: the previous input, in the unit of u, then the play outputs, in the unit of z.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (1 + n,)
    ///     For ``InverseGpi.run``: no sample out of reach yet, then where its plays stand, in the unit of v.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     Plays further apart than their half-widths allow, which no input brings about.
    fn inverse_state<'py>(&self, state: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let forward = read_state(&self.hysteresis, &vector("state", state)?)?;
        let own = self.hysteresis.inverse_state(&forward).map_err(to_python)?;
        Ok(from_vector(state.py(), &inverse_hysteresis::write(&own)))
    }

    fn __repr__(&self) -> String {
        let (m, n) =
            (self.hysteresis.envelope().weights().len(), self.hysteresis.plays().weights().len());
        format!("Gpi({m} deadzones, {n} plays)")
    }
}

/// The state of a cascade from the previous input and the play outputs.
pub(crate) fn read_state(
    hysteresis: &Hysteresis,
    values: &[f64],
) -> PyResult<GpiState<f64, Vec<f64>>> {
    let expected = 1 + hysteresis.plays().weights().len();
    if values.len() != expected {
        let message = format!(
            "`state` has {} elements, but {expected} are needed: the previous input and the plays",
            values.len()
        );
        return Err(parameter(message));
    }
    let plays = hysteresis.plays().state_from(values[1..].to_vec()).map_err(to_python)?;
    Ok(GpiState { envelope: DeadzonesState { previous: values[0] }, plays })
}

/// The inverse of [`read_state`].
pub(crate) fn write_state(state: &GpiState<f64, Vec<f64>>) -> Vec<f64> {
    let previous = std::iter::once(state.envelope.previous);
    previous.chain(state.plays.plays().iter().copied()).collect()
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PlayBank>()?;
    module.add_class::<Deadzones>()?;
    module.add_class::<Gpi>()
}
