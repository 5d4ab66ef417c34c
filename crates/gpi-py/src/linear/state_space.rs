//! State space models.

#![allow(
    non_snake_case,
    reason = "A, B, C and D are the arguments' and attributes' names in Python"
)]

use super::noncausal_fir::NoncausalFir;
use super::transfer_function::transfer_function;
use crate::arrays::{
    from_complex, from_matrices, from_matrix, from_signal, from_vector, markov, matrix, signal,
    vector,
};
use crate::errors::to_python;
use crate::plotting::plot;
use gpi_core::linear::{self, InverseOptions, TransferFunction};
use nalgebra::DVector;
use numpy::IntoPyArray;
use numpy::ndarray::Array3;
use pyo3::prelude::*;

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
///     The sizes of the matrices do not agree.
/// ParameterError
///     An element is not finite.
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
    fn new(
        A: &Bound<'_, PyAny>,
        B: &Bound<'_, PyAny>,
        C: &Bound<'_, PyAny>,
        D: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (a, b, c, d) = (matrix("A", A)?, matrix("B", B)?, matrix("C", C)?, matrix("D", D)?);
        Ok(linear::StateSpace::new(a, b, c, d).map_err(to_python)?.into())
    }

    #[doc = include_str!("../docs/state_space/from_transfer_function.txt")]
    #[staticmethod]
    fn from_transfer_function(
        numerator: &Bound<'_, PyAny>,
        denominator: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let numerator = markov("numerator", numerator)?;
        let found = transfer_function(numerator, &vector("denominator", denominator)?)?;
        Ok(found.to_state_space().map_err(to_python)?.into())
    }

    /// State matrix, shape (order, order), no unit.
    #[getter]
    fn A<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.a())
    }

    /// Input matrix, shape (order, inputs), in units of the state per input unit.
    #[getter]
    fn B<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.b())
    }

    /// Output matrix, shape (outputs, order), in output units per unit of the state.
    #[getter]
    fn C<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, self.system.c())
    }

    /// Feed-through, shape (outputs, inputs), in output units per input unit.
    #[getter]
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

    /// Largest modulus of the poles, no unit; the model is stable if it is below 1.
    #[getter]
    fn spectral_radius(&self) -> PyResult<f64> {
        self.system.spectral_radius().map_err(to_python)
    }

    /// DC gain G(1), shape (outputs, inputs), in output units per input unit.
    #[getter]
    fn dc_gain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_matrix(py, &self.system.dc_gain().map_err(to_python)?))
    }

    /// Singular values of ERA's Hankel matrix, shape (n,), in output units per input unit, descending, all or the
    /// leading ones (see ``era``); None for a model that ``era`` did not realize.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.singular_values.as_ref().map(|values| from_vector(py, values))
    }

    /// Number of unstable poles that ERA reflected into the unit circle.
    #[getter]
    fn reflected(&self) -> usize {
        self.reflected
    }

    /// The output for u, from rest x(0) = 0.
    ///
    #[doc = include_str!("../docs/simulate.txt")]
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
    ///     Number of Markov parameters.
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

    /// Discretizes this model, which is in continuous time, with a zero-order hold at its input.
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

    #[doc = include_str!("../docs/state_space/noncausal_inverse.txt")]
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
    #[doc = include_str!("../docs/plot.txt")]
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
