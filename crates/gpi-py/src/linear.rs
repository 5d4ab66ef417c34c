//! FIR estimate, realization, state space, noncausal inverse.

use crate::arrays::{
    experiments, from_complex, from_matrices, from_matrix, from_signal, from_vector, markov,
    matrix, signal, vector,
};
use crate::errors::{parameter, to_python};
use gpi_core::linear::{self, EraOptions, InverseOptions, TransferFunction};
use gpi_core::{Channel, Experiment, Matrix};
use nalgebra::DVector;
use numpy::IntoPyArray;
use numpy::ndarray::Array3;
use pyo3::prelude::*;
use pyo3::types::PySlice;

/// Calls a function of the package's plot module.
pub(crate) fn plot<'py>(
    name: &str,
    result: &Bound<'py, PyAny>,
    ax: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let options = pyo3::types::PyDict::new(result.py());
    options.set_item("ax", ax)?;
    let module = result.py().import("gpi_hammerstein.plot")?;
    module.call_method(name, (result,), Some(&options))
}

/// A finite impulse response model: ``y(k) = sum_j H_j u(k-j) + offset``.
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Fir {
    pub(crate) fir: linear::Fir,
}

#[pymethods]
impl Fir {
    /// Markov parameters H_j, shape (outputs, inputs, taps), in output units per input unit.
    #[getter]
    fn markov<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrices(py, self.fir.markov[0].shape(), &self.fir.markov)
    }

    /// Constant term of each experiment, shape (experiments, outputs).
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, &self.fir.offsets)
    }

    /// Singular values of the regressor (means removed), shape (taps * inputs,), descending.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.singular_values)
    }

    /// Largest over smallest singular value; above 1e8 it says no more than "at least that".
    #[getter]
    fn condition(&self) -> f64 {
        self.fir.condition()
    }

    /// Number of singular values above 1e-6 of the largest: the directions that the input excites.
    #[getter]
    fn rank(&self) -> usize {
        self.fir.rank
    }

    /// Root mean square of the residual of each output, shape (outputs,).
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.residual_rms)
    }

    /// Rows of the regression.
    #[getter]
    fn samples(&self) -> usize {
        self.fir.samples
    }

    /// The output for u, shape (samples,) or (samples, inputs), from rest and without offset.
    fn simulate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let expected = self.fir.markov[0].ncols();
        if input.ncols() != expected {
            let message = format!("`u` has {} channels, but {expected} are needed", input.ncols());
            return Err(parameter(message));
        }
        Ok(from_signal(u.py(), &self.fir.simulate(&input), one_dimensional))
    }

    /// Draws the Markov parameters; see ``gpi_hammerstein.plot.markov``.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("markov", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let (outputs, inputs) = self.fir.markov[0].shape();
        format!(
            "Fir({} taps, {inputs} inputs, {outputs} outputs, rank {} of {}, condition {:.3e}, \
             residual rms {:.4?})",
            self.fir.taps(),
            self.fir.rank,
            self.fir.singular_values.len(),
            self.fir.condition(),
            self.fir.residual_rms
        )
    }
}

/// Estimates Markov parameters by least squares (equation 25 of the paper).
///
/// Parameters
/// ----------
/// u, y : array_like, shape (samples,) or (samples, channels), or lists of arrays
///     Input and output; lists hold one array an experiment, and each experiment has its own offset.
/// taps : int
///     Number of Markov parameters, mu + 1 in the paper.
/// ridge : float
///     Zero is plain least squares. A positive value, relative to the mean eigenvalue of the normal
///     equations, leaves out what the input hardly excites (three passes of iterated ridge
///     regression).
///
/// Returns
/// -------
/// Fir
///     The estimate with its excitation rank and condition number.
///
/// Raises
/// ------
/// DataError
///     Samples that are not finite, unequal lengths, fewer samples than unknowns.
/// ParameterError
///     No taps, a negative ridge.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = np.random.default_rng(0).standard_normal(500)
/// >>> fir = gpi.fir(u, 3.0 + np.convolve(u, [2.0, -1.0])[:500], taps=3)
/// >>> np.round(fir.markov[0, 0], 9).tolist(), fir.rank
/// ([2.0, -1.0, 0.0], 3)
#[pyfunction]
#[pyo3(signature = (u, y, taps, *, ridge = 0.0))]
fn fir(
    py: Python<'_>,
    u: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    taps: usize,
    ridge: f64,
) -> PyResult<Fir> {
    let (inputs, outputs) = (experiments("u", u)?, experiments("y", y)?);
    if inputs.len() != outputs.len() {
        let message = format!("`u` has {} experiments, but `y` {}", inputs.len(), outputs.len());
        return Err(parameter(message));
    }
    let channels = |letter: &str, signals: &[Matrix]| -> Vec<Channel> {
        let count = signals.first().map_or(0, Matrix::ncols);
        (1..=count).map(|index| Channel::new(format!("{letter}{index}"), "")).collect()
    };
    let (u_channels, y_channels) = (channels("u", &inputs), channels("y", &outputs));
    let runs = inputs.into_iter().zip(outputs).map(|(input, output)| Experiment {
        covariates: Matrix::zeros(input.nrows(), 0),
        input,
        output,
        warmup: 0,
    });
    let record = gpi_core::Record::new(runs.collect(), 1.0, u_channels, y_channels, vec![]);
    let record = record.map_err(to_python)?;
    let fir = py.detach(|| linear::estimate(&record, taps, ridge)).map_err(to_python)?;
    Ok(Fir { fir })
}

/// Realizes Markov parameters as a stable state space (Ho-Kalman / ERA).
///
/// Parameters
/// ----------
/// markov : array_like, shape (taps,) or (outputs, inputs, taps)
///     H_0, H_1, ...
/// order : int, optional
///     Number of states; chosen from the singular values when left out: where they fall by a factor
///     of 20 at once, or else where the rest holds less than 1e-4 of the sum of their squares.
/// blocks : int, optional
///     Block rows and columns of the Hankel matrix; (taps - 1) // 2 - 1 when left out, but no more
///     than 300 rows or columns.
///
/// Returns
/// -------
/// StateSpace
///     Balanced, with all singular values, and with the number of unstable poles that were reflected
///     into the unit circle.
///
/// Raises
/// ------
/// ParameterError
///     An order above the rank, blocks that the taps do not fill, taps that are not finite.
/// NumericalError
///     A realization that cannot be made stable.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> truth = gpi.StateSpace.from_transfer_function([1.0, 0.3], [1.0, -1.2, 0.6])
/// >>> gpi.era(truth.markov(41)).order
/// 2
#[pyfunction]
#[pyo3(name = "era", signature = (markov, order = None, blocks = None))]
fn realize(
    py: Python<'_>,
    markov: &Bound<'_, PyAny>,
    order: Option<usize>,
    blocks: Option<usize>,
) -> PyResult<StateSpace> {
    let taps = self::markov("markov", markov)?;
    let options = EraOptions { order, blocks };
    let era = py.detach(|| linear::realize(&taps, &options)).map_err(to_python)?;
    Ok(StateSpace {
        system: era.system,
        singular_values: Some(era.singular_values),
        reflected: era.reflected,
    })
}

/// A discrete-time linear model: ``x(k+1) = A x(k) + B v(k)``, ``y(k) = C x(k) + D v(k)``.
///
/// Parameters
/// ----------
/// A : array_like, shape (order, order)
///     State matrix.
/// B : array_like, shape (order, inputs)
///     Input matrix.
/// C : array_like, shape (outputs, order)
///     Output matrix.
/// D : array_like, shape (outputs, inputs)
///     Feed-through.
///
/// Raises
/// ------
/// DataError
///     Sizes that do not fit together.
/// ParameterError
///     Elements that are not finite.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> lag = gpi.StateSpace([[0.5]], [[1.0]], [[0.5]], [[0.0]])
/// >>> lag.dc_gain.tolist(), lag.simulate([1.0, 0.0, 0.0]).tolist()
/// ([[1.0]], [0.0, 0.5, 0.25])
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct StateSpace {
    pub(crate) system: linear::StateSpace,
    pub(crate) singular_values: Option<Vec<f64>>,
    pub(crate) reflected: usize,
}

impl From<linear::StateSpace> for StateSpace {
    fn from(system: linear::StateSpace) -> Self {
        Self { system, singular_values: None, reflected: 0 }
    }
}

#[pymethods]
impl StateSpace {
    #[new]
    #[pyo3(signature = (A, B, C, D))]
    #[allow(non_snake_case)]
    fn new(
        A: &Bound<'_, PyAny>,
        B: &Bound<'_, PyAny>,
        C: &Bound<'_, PyAny>,
        D: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (a, b, c, d) = (matrix("A", A)?, matrix("B", B)?, matrix("C", C)?, matrix("D", D)?);
        Ok(linear::StateSpace::new(a, b, c, d).map_err(to_python)?.into())
    }

    /// The controllable canonical form of a transfer function.
    ///
    /// Parameters
    /// ----------
    /// numerator : array_like, shape (n + 1,), or (outputs, inputs, n + 1)
    ///     Coefficients, highest power first; a shorter vector is filled with zeros in front.
    /// denominator : array_like, shape (n + 1,)
    ///     Coefficients, highest power first.
    ///
    /// Returns
    /// -------
    /// StateSpace
    ///     In discrete time if the polynomials are in z, in continuous time if they are in s.
    #[staticmethod]
    fn from_transfer_function(
        numerator: &Bound<'_, PyAny>,
        denominator: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let d = vector("denominator", denominator)?;
        let numerators = markov("numerator", numerator)?;
        let one = |n: &[f64]| TransferFunction::new(n, &d).map_err(to_python);
        if numerators.first().is_some_and(|tap| tap.len() == 1) {
            let n: Vec<f64> = numerators.iter().map(|tap| tap[0]).collect();
            return Ok(one(&n)?.to_state_space().into());
        }
        let reference = one(&[])?;
        if numerators.len() != d.len() {
            let message = format!(
                "`numerator` has {} coefficients, but `denominator` has {}",
                numerators.len(),
                d.len()
            );
            return Err(parameter(message));
        }
        let numerator = numerators.into_iter().map(|tap| tap / d[0]).collect();
        let denominator = reference.denominator;
        Ok(TransferFunction { numerator, denominator }.to_state_space().into())
    }

    /// State matrix, shape (order, order).
    #[getter]
    #[allow(non_snake_case)]
    fn A<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.a())
    }

    /// Input matrix, shape (order, inputs).
    #[getter]
    #[allow(non_snake_case)]
    fn B<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.b())
    }

    /// Output matrix, shape (outputs, order).
    #[getter]
    #[allow(non_snake_case)]
    fn C<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.c())
    }

    /// Feed-through, shape (outputs, inputs).
    #[getter]
    #[allow(non_snake_case)]
    fn D<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.d())
    }

    /// Number of states.
    #[getter]
    fn order(&self) -> usize {
        self.system.order()
    }

    /// Eigenvalues of A, shape (order,).
    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_complex(py, self.system.poles().map_err(to_python)?))
    }

    /// Finite invariant zeros of a model with as many outputs as inputs.
    #[getter]
    fn zeros<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_complex(py, self.system.zeros().map_err(to_python)?))
    }

    /// Largest modulus of a pole; below 1 the model is stable.
    #[getter]
    fn spectral_radius(&self) -> PyResult<f64> {
        self.system.spectral_radius().map_err(to_python)
    }

    /// G(1), shape (outputs, inputs).
    #[getter]
    fn dc_gain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_matrix(py, &self.system.dc_gain().map_err(to_python)?))
    }

    /// All singular values of ERA's Hankel matrix, descending; None for a model from elsewhere.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.singular_values.as_ref().map(|values| from_vector(py, values))
    }

    /// Unstable poles that ERA reflected into the unit circle.
    #[getter]
    fn reflected(&self) -> usize {
        self.reflected
    }

    /// The output for u, shape (samples,) or (samples, inputs), from rest x(0) = 0.
    fn simulate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.run(u, None)?.0)
    }

    /// The output from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input.
    /// state : array_like, shape (order,), optional
    ///     x(0); zeros when left out.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     y, shaped like u, and the state, shape (order,).
    #[pyo3(signature = (u, state = None))]
    fn run<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (input, one_dimensional) = signal("u", u)?;
        let mut state = match state {
            Some(state) => DVector::from_vec(vector("state", state)?),
            None => DVector::zeros(self.system.order()),
        };
        let output = self.system.simulate_from(&mut state, &input).map_err(to_python)?;
        let py = u.py();
        Ok((from_signal(py, &output, one_dimensional), from_vector(py, state.as_slice())))
    }

    /// The first `count` Markov parameters, shape (outputs, inputs, count).
    fn markov<'py>(&self, py: Python<'py>, count: usize) -> Bound<'py, PyAny> {
        from_matrices(py, self.system.d().shape(), &self.system.markov(count))
    }

    /// G(e^{jw}), shape (len(frequencies), outputs, inputs).
    ///
    /// Parameters
    /// ----------
    /// frequencies : array_like, shape (count,)
    ///     w in radians per sample: 2 pi f / rate.
    ///
    /// Returns
    /// -------
    /// ndarray of complex
    ///     The frequency response.
    fn frequency_response<'py>(
        &self,
        frequencies: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let response = self.system.frequency_response(&vector("frequencies", frequencies)?);
        let shape = (response.len(), self.system.outputs(), self.system.inputs());
        let array = Array3::from_shape_fn(shape, |(w, o, i)| response[w][(o, i)]);
        Ok(array.into_pyarray(frequencies.py()).into_any())
    }

    /// The transfer function with a common denominator.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     Numerator, shape (outputs, inputs, order + 1), and denominator, shape (order + 1,), highest
    ///     power first.
    fn to_transfer_function<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let tf = TransferFunction::from_state_space(&self.system).map_err(to_python)?;
        Ok((
            from_matrices(py, self.system.d().shape(), &tf.numerator),
            from_vector(py, &tf.denominator),
        ))
    }

    /// Samples this model, taken as a continuous-time one, with its input held between samples.
    ///
    /// Parameters
    /// ----------
    /// period : float
    ///     Sampling period in seconds.
    ///
    /// Returns
    /// -------
    /// StateSpace
    ///     The discrete-time model.
    fn zero_order_hold(&self, period: f64) -> PyResult<Self> {
        Ok(linear::zero_order_hold(&self.system, period).map_err(to_python)?.into())
    }

    /// The noncausal FIR approximation of the inverse (equations 45 and 46 of the paper).
    ///
    /// Parameters
    /// ----------
    /// r : int, optional
    ///     Causal taps besides tap 0; chosen from the tolerance when left out.
    /// d : int, optional
    ///     Noncausal taps, the preview; chosen from the tolerance when left out.
    /// tolerance : float
    ///     Largest truncation error where r or d is chosen.
    ///
    /// Returns
    /// -------
    /// NoncausalFir
    ///     The inverse with its truncation error.
    ///
    /// Raises
    /// ------
    /// NumericalError
    ///     A zero within 1e-4 of the unit circle, an unstable model.
    /// DataError
    ///     Unequal numbers of inputs and outputs.
    #[pyo3(signature = (r = None, d = None, tolerance = 1e-6))]
    fn noncausal_inverse(
        &self,
        r: Option<usize>,
        d: Option<usize>,
        tolerance: f64,
    ) -> PyResult<NoncausalFir> {
        let options = InverseOptions { causal: r, noncausal: d, tolerance };
        let inverse = self.system.noncausal_inverse(&options).map_err(to_python)?;
        Ok(NoncausalFir { inverse })
    }

    /// Draws the Bode plot; see ``gpi_hammerstein.plot.bode``.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("bode", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let radius = self.system.spectral_radius().unwrap_or(f64::NAN);
        format!(
            "StateSpace(order {}, {} inputs, {} outputs, largest pole {radius:.6})",
            self.system.order(),
            self.system.inputs(),
            self.system.outputs()
        )
    }
}

/// A noncausal FIR inverse: ``v(k) = sum_{i=-d}^{r} h_i y(k-i)``.
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct NoncausalFir {
    pub(crate) inverse: linear::NoncausalFir,
}

#[pymethods]
impl NoncausalFir {
    /// h_{-d} .. h_r, shape (inputs of G, outputs of G, d + r + 1).
    #[getter]
    fn taps<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrices(py, self.inverse.taps[0].shape(), &self.inverse.taps)
    }

    /// Causal taps besides tap 0.
    #[getter]
    fn r(&self) -> usize {
        self.inverse.causal()
    }

    /// Noncausal taps: samples of preview.
    #[getter]
    fn d(&self) -> usize {
        self.inverse.noncausal
    }

    /// Norm of the taps left out as a fraction of all; it bounds the relative error of the response.
    #[getter]
    fn error(&self) -> f64 {
        self.inverse.error
    }

    /// The intermediate signal of y, shape (samples,) or (samples, outputs) (equation 47).
    fn __call__(&self, y: &Bound<'_, PyAny>) -> PyResult<IntermediateSignal> {
        let (output, one_dimensional) = signal("y", y)?;
        let signal = self.inverse.apply(&output).map_err(to_python)?;
        Ok(IntermediateSignal { signal, one_dimensional })
    }

    fn __repr__(&self) -> String {
        format!("NoncausalFir(r={}, d={}, error {:.2e})", self.r(), self.d(), self.error())
    }
}

/// An intermediate signal seen through the inverse.
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct IntermediateSignal {
    signal: linear::IntermediateSignal,
    one_dimensional: bool,
}

#[pymethods]
impl IntermediateSignal {
    /// v-hat, shaped like the output it was computed from.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, &self.signal.values, self.one_dimensional)
    }

    /// The samples whose inverse saw measured outputs only.
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

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Fir>()?;
    module.add_class::<StateSpace>()?;
    module.add_class::<NoncausalFir>()?;
    module.add_class::<IntermediateSignal>()?;
    module.add_function(wrap_pyfunction!(fir, module)?)?;
    module.add_function(wrap_pyfunction!(realize, module)?)
}
