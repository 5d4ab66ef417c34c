//! State space models and their realization.

use crate::arrays::{
    from_complex, from_matrices, from_matrix, from_signal, from_vector, markov, matrix, signal,
    vector,
};
use crate::errors::{parameter, to_python};
use crate::noncausal_fir::NoncausalFir;
use crate::plotting::plot;
use gpi_core::linear::{self, EraOptions, InverseOptions, TransferFunction};
use nalgebra::DVector;
use numpy::IntoPyArray;
use numpy::ndarray::Array3;
use pyo3::prelude::*;

/// Realizes Markov parameters as a stable state space (Ho-Kalman / ERA), (T1) in the theory.
///
/// Parameters
/// ----------
/// markov : array_like, shape (taps,) or (outputs, inputs, taps)
///     H_0, H_1, ..., in output units per input unit.
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
///     Balanced, with the singular values (all, or as many as the order where that is given, at most 12,
///     and enough for a matrix of 100 rows or more), and with the number of unstable poles that were
///     reflected into the unit circle.
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
///     State matrix, no unit.
/// B : array_like, shape (order, inputs)
///     Input matrix, in units of the state per input unit.
/// C : array_like, shape (outputs, order)
///     Output matrix, in output units per unit of the state.
/// D : array_like, shape (outputs, inputs)
///     Feed-through, in output units per input unit.
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
    ///     Coefficients, highest power first, in output units per input unit; a shorter vector is filled with zeros in
    ///     front.
    /// denominator : array_like, shape (n + 1,)
    ///     Coefficients, highest power first, no unit.
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
            return Ok(one(&n)?.to_state_space().map_err(to_python)?.into());
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
        let tf = TransferFunction { numerator, denominator };
        Ok(tf.to_state_space().map_err(to_python)?.into())
    }

    /// State matrix, shape (order, order), no unit.
    #[getter]
    #[allow(non_snake_case)]
    fn A<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.a())
    }

    /// Input matrix, shape (order, inputs), in units of the state per input unit.
    #[getter]
    #[allow(non_snake_case)]
    fn B<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.b())
    }

    /// Output matrix, shape (outputs, order), in output units per unit of the state.
    #[getter]
    #[allow(non_snake_case)]
    fn C<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.c())
    }

    /// Feed-through, shape (outputs, inputs), in output units per input unit.
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

    /// Eigenvalues of A, shape (order,), no unit.
    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_complex(py, self.system.poles().map_err(to_python)?))
    }

    /// Finite invariant zeros of a model with as many outputs as inputs, shape (n,), no unit.
    #[getter]
    fn zeros<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_complex(py, self.system.zeros().map_err(to_python)?))
    }

    /// Largest modulus of a pole, no unit; below 1 the model is stable.
    #[getter]
    fn spectral_radius(&self) -> PyResult<f64> {
        self.system.spectral_radius().map_err(to_python)
    }

    /// G(1), shape (outputs, inputs), in output units per input unit.
    #[getter]
    fn dc_gain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_matrix(py, &self.system.dc_gain().map_err(to_python)?))
    }

    /// Singular values of ERA's Hankel matrix, shape (n,), in output units per input unit, descending, all or the
    /// leading ones (see ``era``); None for a model from elsewhere.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.singular_values.as_ref().map(|values| from_vector(py, values))
    }

    /// Unstable poles that ERA reflected into the unit circle.
    #[getter]
    fn reflected(&self) -> usize {
        self.reflected
    }

    /// The output for u, from rest x(0) = 0.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (samples,) or (samples, outputs)
    ///     y, in the outputs' units; a vector where u is one and there is one output.
    fn simulate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.run(u, None)?.0)
    }

    /// The output from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    /// state : array_like, shape (order,), optional
    ///     x(0), in the states' own units; zeros when left out.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     y, shape (samples,) or (samples, outputs), in the outputs' units, and the state, shape (order,), in the states'
    ///     own units.
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
        Ok((from_signal(py, output, one_dimensional), from_vector(py, state.as_slice())))
    }

    /// The first Markov parameters: H_0 = D, H_1 = C B, H_2 = C A B, ...
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     How many.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (outputs, inputs, count)
    ///     H_0, H_1, ..., in output units per input unit.
    fn markov<'py>(&self, py: Python<'py>, count: usize) -> Bound<'py, PyAny> {
        from_matrices(py, self.system.d().shape(), &self.system.markov(count))
    }

    /// The frequency response G(e^{jw}).
    ///
    /// Parameters
    /// ----------
    /// frequencies : array_like, shape (count,)
    ///     w in radians per sample: 2 pi f / rate.
    ///
    /// Returns
    /// -------
    /// ndarray of complex, shape (count, outputs, inputs)
    ///     G(e^{jw}), in output units per input unit.
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
    ///     Numerator, shape (outputs, inputs, order + 1), in output units per input unit, and denominator,
    ///     shape (order + 1,), no unit, both with the highest power first.
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
    ///     Largest truncation error where r or d is chosen, a fraction (``NoncausalFir.error``).
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
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw on; those of a new figure when left out.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     The axes.
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

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<StateSpace>()?;
    module.add_function(wrap_pyfunction!(realize, module)?)
}
