//! Discrete-time linear state space models.

use super::decompose::{eigenvalues, solve};
use crate::{Error, Matrix};
use nalgebra::DVector;
use num_complex::Complex64;

/// Samples whose states [`StateSpace::simulate_from`] stores at once, so that its products are matrix products.
const BLOCK: usize = 1024;

/// `x(k+1) = A x(k) + B v(k)`, `y(k) = C x(k) + D v(k)`.
///
/// A is (order, order), B (order, inputs), C (outputs, order) and D (outputs, inputs). The response to v is (15) of the
/// paper, with the Markov parameters of [`StateSpace::markov`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StateSpace {
    #[serde(with = "super::matrix_file")]
    pub(super) a: Matrix,
    #[serde(with = "super::matrix_file")]
    pub(super) b: Matrix,
    #[serde(with = "super::matrix_file")]
    pub(super) c: Matrix,
    #[serde(with = "super::matrix_file")]
    pub(super) d: Matrix,
}

impl StateSpace {
    /// A model from its four matrices.
    ///
    /// ```
    /// use gpi_core::{Matrix, linear::StateSpace};
    /// let scalar = |value| Matrix::from_element(1, 1, value);
    /// let lag = StateSpace::new(scalar(0.5), scalar(1.0), scalar(0.5), scalar(0.0))?;
    /// assert_eq!(lag.dc_gain()?[0], 1.0);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The sizes of the matrices do not match, or an element is not finite.
    pub fn new(a: Matrix, b: Matrix, c: Matrix, d: Matrix) -> Result<Self, Error> {
        Error::require_equal("rows and columns", ("A", a.nrows()), ("A", a.ncols()))?;
        Error::require_equal("rows", ("A", a.nrows()), ("B", b.nrows()))?;
        Error::require_equal("columns", ("A", a.ncols()), ("C", c.ncols()))?;
        Error::require_equal("rows", ("C", c.nrows()), ("D", d.nrows()))?;
        Error::require_equal("columns", ("B", b.ncols()), ("D", d.ncols()))?;
        for (name, matrix) in [("A", &a), ("B", &b), ("C", &c), ("D", &d)] {
            Error::require_finite(name, matrix)?;
        }
        Ok(Self { a, b, c, d })
    }

    /// The model `y(k) = gain v(k - delay)`, for a `gain` (outputs, inputs) and a `delay` in samples.
    pub fn delayed_gain(gain: &Matrix, delay: usize) -> Self {
        let (outputs, inputs) = gain.shape();
        if delay == 0 {
            let (b, c) = (Matrix::zeros(0, inputs), Matrix::zeros(outputs, 0));
            return Self { a: Matrix::zeros(0, 0), b, c, d: gain.clone() };
        }
        let order = delay * inputs;
        let mut a = Matrix::zeros(order, order);
        for state in inputs..order {
            a[(state, state - inputs)] = 1.0;
        }
        let mut b = Matrix::zeros(order, inputs);
        b.view_mut((0, 0), (inputs, inputs)).fill_with_identity();
        let mut c = Matrix::zeros(outputs, order);
        c.view_mut((0, order - inputs), (outputs, inputs)).copy_from(gain);
        Self { a, b, c, d: Matrix::zeros(outputs, inputs) }
    }

    /// A, (order, order).
    pub fn a(&self) -> &Matrix {
        &self.a
    }

    /// B, (order, inputs).
    pub fn b(&self) -> &Matrix {
        &self.b
    }

    /// C, (outputs, order).
    pub fn c(&self) -> &Matrix {
        &self.c
    }

    /// D, (outputs, inputs).
    pub fn d(&self) -> &Matrix {
        &self.d
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.b.ncols()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.c.nrows()
    }

    /// The output y(k) for one sample v(k); `state` changes from x(k) to x(k+1).
    pub fn step(&self, state: &mut DVector<f64>, input: &DVector<f64>) -> DVector<f64> {
        let output = &self.c * &*state + &self.d * input;
        *state = &self.a * &*state + &self.b * input;
        output
    }

    /// The outputs (samples, outputs) for `input` (samples, inputs); `state` changes from x(0) to the state after the
    /// last sample.
    ///
    /// # Errors
    /// The input has another number of channels, or the state another length, than the model.
    pub fn simulate_from(&self, state: &mut DVector<f64>, input: &Matrix) -> Result<Matrix, Error> {
        Error::require_equal("channels", ("input", input.ncols()), ("B", self.inputs()))?;
        Error::require_equal("states", ("state", state.len()), ("A", self.order()))?;
        let samples = input.nrows();
        let mut output = Matrix::zeros(samples, self.outputs());
        let mut next = state.clone();
        for first in (0..samples).step_by(BLOCK) {
            let rows = BLOCK.min(samples - first);
            let input = input.rows(first, rows).transpose();
            let drive = &self.b * &input;
            let mut states = Matrix::zeros(self.order(), rows);
            for k in 0..rows {
                states.set_column(k, state);
                next.copy_from(&drive.column(k));
                next.gemv(1.0, &self.a, state, 1.0);
                std::mem::swap(state, &mut next);
            }
            let block = &self.c * states + &self.d * input;
            output.rows_mut(first, rows).tr_copy_from(&block);
        }
        Ok(output)
    }

    /// The outputs (samples, outputs) for `input` (samples, inputs) and the initial state x(0) = 0.
    ///
    /// # Errors
    /// The input has another number of channels than the model.
    pub fn simulate(&self, input: &Matrix) -> Result<Matrix, Error> {
        self.simulate_from(&mut DVector::zeros(self.order()), input)
    }

    /// The steady state x for the constant input `v`, `x = A x + B v`; zero if a pole at z = 1 leaves no steady state.
    pub fn equilibrium(&self, input: &DVector<f64>) -> DVector<f64> {
        let states = self.steady_states(&Matrix::from_columns(&[&self.b * input]));
        states.map_or_else(|| DVector::zeros(self.order()), |x| x.column(0).into_owned())
    }

    /// The solutions X of `X = A X + driven`; `None` for a pole at z = 1, up to rounding.
    fn steady_states(&self, driven: &Matrix) -> Option<Matrix> {
        let order = self.order();
        if order == 0 {
            return Some(driven.clone());
        }
        let difference = Matrix::identity(order, order) - &self.a;
        let rounding = order as f64 * f64::EPSILON * difference.amax();
        let decomposed = difference.lu();
        let is_singular = decomposed.u().diagonal().amin() <= rounding;
        if is_singular { None } else { decomposed.solve(driven) }
    }

    /// The first `count` Markov parameters `H_0 = D`, `H_j = C A^(j-1) B`, each (outputs, inputs).
    pub fn markov(&self, count: usize) -> Vec<Matrix> {
        let mut propagated = self.b.clone();
        let later = (1..count).map(|_| {
            let tap = &self.c * &propagated;
            propagated = &self.a * &propagated;
            tap
        });
        std::iter::once(self.d.clone()).chain(later).take(count).collect()
    }

    /// The poles: the eigenvalues of A.
    ///
    /// # Errors
    /// The eigendecomposition does not converge.
    pub fn poles(&self) -> Result<Vec<Complex64>, Error> {
        eigenvalues(&self.a)
    }

    /// The largest modulus of a pole, zero for a static gain. The model is stable if it is below 1.
    ///
    /// # Errors
    /// The eigendecomposition does not converge.
    pub fn spectral_radius(&self) -> Result<f64, Error> {
        Ok(self.poles()?.iter().map(|pole| pole.norm()).fold(0.0, f64::max))
    }

    /// The DC gain `G(1) = C (I - A)^-1 B + D`, (outputs, inputs): the steady-state output for a constant input of 1.
    ///
    /// # Errors
    /// The model has a pole at z = 1.
    pub fn dc_gain(&self) -> Result<Matrix, Error> {
        let remedy = "a pole at z = 1 integrates and has no DC gain";
        let states = self.steady_states(&self.b).ok_or(Error::Unstable { modulus: 1.0, remedy })?;
        Ok(&self.c * states + &self.d)
    }

    /// `C (I - A)^-1 E`, (outputs): the outputs in steady state where E, by the last states, is added to each next state.
    /// `None` with a pole at z = 1.
    pub(crate) fn gains_from_states(&self, e: &[f64]) -> Option<DVector<f64>> {
        let mut column = Matrix::zeros(self.order(), 1);
        column.rows_mut(self.order() - e.len(), e.len()).copy_from_slice(e);
        Some((&self.c * self.steady_states(&column)?).column(0).into_owned())
    }

    /// The frequency response G(e^{jw}) at `frequencies` w in rad per sample, each (outputs, inputs); NaN at a pole.
    pub fn frequency_response(&self, frequencies: &[f64]) -> Vec<nalgebra::DMatrix<Complex64>> {
        let [a, b, c, d] = [&self.a, &self.b, &self.c, &self.d].map(|m| m.map(Complex64::from));
        let response = |&frequency: &f64| {
            let mut resolvent = -a.clone();
            for state in 0..self.order() {
                resolvent[(state, state)] += Complex64::from_polar(1.0, frequency);
            }
            let none = || b.map(|_| Complex64::from(f64::NAN));
            &c * solve(resolvent, &b).unwrap_or_else(none) + &d
        };
        frequencies.iter().map(response).collect()
    }

    /// Multiplies the input channel `input` by `gain`: scales its columns of B and D.
    pub fn scale_input(&mut self, input: usize, gain: f64) {
        self.b.column_mut(input).scale_mut(gain);
        self.d.column_mut(input).scale_mut(gain);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> StateSpace {
        let a = Matrix::from_row_slice(2, 2, &[0.5, 0.4, -0.4, 0.5]);
        let b = Matrix::from_row_slice(2, 1, &[1.0, 0.0]);
        let c = Matrix::from_row_slice(1, 2, &[1.0, 2.0]);
        StateSpace::new(a, b, c, Matrix::from_element(1, 1, 0.5)).unwrap()
    }

    #[test]
    fn simulation_is_the_convolution_with_the_markov_parameters() {
        let system = example();
        let input = Matrix::from_fn(40, 1, |k, _| (k as f64 * 0.9).sin());
        let output = system.simulate(&input).unwrap();
        let markov = system.markov(40);
        for k in 0..40 {
            let sum: f64 = (0..=k).map(|lag| markov[lag][0] * input[k - lag]).sum();
            assert!((sum - output[k]).abs() < 1e-12);
        }
    }

    #[test]
    fn an_integrator_starts_at_zero() {
        // poles at 1 and 0.4; rounding leaves the matrix regular
        let a = Matrix::from_row_slice(2, 2, &[1.4, 1.0, -0.4, 0.0]);
        let b = Matrix::from_row_slice(2, 1, &[1.0, 0.5]);
        let c = Matrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let integrator = StateSpace::new(a, b, c, Matrix::zeros(1, 1)).unwrap();
        let input = DVector::from_element(1, 3.0);
        assert_eq!(integrator.equilibrium(&input), DVector::zeros(2));
        let still = example().equilibrium(&input);
        let next = &example().a * &still + &example().b * &input;
        assert!((next - still).amax() < 1e-12);
    }

    #[test]
    fn delayed_gain_delays() {
        let gain = Matrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]);
        let markov = StateSpace::delayed_gain(&gain, 3).markov(5);
        assert_eq!(markov[3], gain);
        assert!(markov.iter().enumerate().all(|(lag, tap)| lag == 3 || tap.amax() == 0.0));
        assert!(StateSpace::delayed_gain(&gain, 3).zeros().unwrap().is_empty());
    }
}
