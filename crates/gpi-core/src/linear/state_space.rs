//! Discrete-time linear state space models.

use super::decompose::{eigenvalues, solve};
use crate::{Error, Matrix};
use nalgebra::DVector;
use num_complex::Complex64;

/// `x(k+1) = A x(k) + B v(k)`, `y(k) = C x(k) + D v(k)`.
///
/// A is (order, order), B (order, inputs), C (outputs, order), D (outputs, inputs).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StateSpace {
    a: Matrix,
    b: Matrix,
    c: Matrix,
    d: Matrix,
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
    /// Matrices whose sizes do not fit, or with elements that are not finite.
    pub fn new(a: Matrix, b: Matrix, c: Matrix, d: Matrix) -> Result<Self, Error> {
        Error::require_equal("rows and columns", ("A", a.nrows()), ("A", a.ncols()))?;
        Error::require_equal("rows", ("A", a.nrows()), ("B", b.nrows()))?;
        Error::require_equal("columns", ("A", a.ncols()), ("C", c.ncols()))?;
        Error::require_equal("rows", ("C", c.nrows()), ("D", d.nrows()))?;
        Error::require_equal("columns", ("B", b.ncols()), ("D", d.ncols()))?;
        for (name, matrix) in [("A", &a), ("B", &b), ("C", &c), ("D", &d)] {
            if let Some(value) = matrix.iter().find(|value| !value.is_finite()) {
                return Err(Error::parameter(name, value, "every element must be finite"));
            }
        }
        Ok(Self { a, b, c, d })
    }

    /// The static gain `y(k) = D v(k - delay)`, `delay` in samples.
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

    /// One sample: the output y(k) for v(k); `state` moves on from x(k) to x(k+1).
    pub fn step(&self, state: &mut DVector<f64>, input: &DVector<f64>) -> DVector<f64> {
        let output = &self.c * &*state + &self.d * input;
        *state = &self.a * &*state + &self.b * input;
        output
    }

    /// The outputs (samples, outputs) for `input` (samples, inputs); `state` is x(0) and becomes the
    /// state after the last sample.
    ///
    /// # Errors
    /// An input with another number of channels, a state of another length.
    pub fn simulate_from(&self, state: &mut DVector<f64>, input: &Matrix) -> Result<Matrix, Error> {
        Error::require_equal("channels", ("input", input.ncols()), ("B", self.inputs()))?;
        Error::require_equal("states", ("state", state.len()), ("A", self.order()))?;
        /// Samples whose states are held at once.
        const BLOCK: usize = 1024;
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

    /// The outputs from rest, x(0) = 0.
    ///
    /// # Errors
    /// An input with another number of channels.
    pub fn simulate(&self, input: &Matrix) -> Result<Matrix, Error> {
        self.simulate_from(&mut DVector::zeros(self.order()), input)
    }

    /// The state x in which the constant input `v` keeps the model: `x = A x + B v`; zero where a
    /// pole at z = 1 leaves no such state.
    pub fn equilibrium(&self, input: &DVector<f64>) -> DVector<f64> {
        let identity = Matrix::identity(self.order(), self.order());
        let driven = Matrix::from_columns(&[&self.b * input]);
        match solve(identity - &self.a, &driven) {
            Some(state) => state.column(0).into_owned(),
            None => DVector::zeros(self.order()),
        }
    }

    /// Markov parameters H_0 = D, H_j = C A^(j-1) B, each (outputs, inputs).
    pub fn markov(&self, count: usize) -> Vec<Matrix> {
        let mut propagated = self.b.clone();
        let mut markov = Vec::with_capacity(count);
        for lag in 0..count {
            if lag == 0 {
                markov.push(self.d.clone());
            } else {
                markov.push(&self.c * &propagated);
                propagated = &self.a * propagated;
            }
        }
        markov
    }

    /// The eigenvalues of A.
    ///
    /// # Errors
    /// The eigendecomposition does not converge.
    pub fn poles(&self) -> Result<Vec<Complex64>, Error> {
        eigenvalues(&self.a)
    }

    /// The largest modulus of a pole, zero for a static gain; below 1 the model is stable.
    ///
    /// # Errors
    /// The eigendecomposition does not converge.
    pub fn spectral_radius(&self) -> Result<f64, Error> {
        Ok(self.poles()?.iter().map(|pole| pole.norm()).fold(0.0, f64::max))
    }

    /// G(1), (outputs, inputs): the output that a constant input of 1 leads to.
    ///
    /// # Errors
    /// A pole at z = 1.
    pub fn dc_gain(&self) -> Result<Matrix, Error> {
        let identity = Matrix::identity(self.order(), self.order());
        match solve(identity - &self.a, &self.b) {
            Some(states) => Ok(&self.c * states + &self.d),
            None => Err(Error::Unstable {
                modulus: 1.0,
                remedy: "a pole at z = 1 integrates and has no DC gain",
            }),
        }
    }

    /// G(e^{jw}) at `frequencies` w in radians per sample, each (outputs, inputs).
    pub fn frequency_response(&self, frequencies: &[f64]) -> Vec<nalgebra::DMatrix<Complex64>> {
        let complex = |matrix: &Matrix| matrix.map(|value| Complex64::new(value, 0.0));
        let (a, b, c, d) = (complex(&self.a), complex(&self.b), complex(&self.c), complex(&self.d));
        let response = |&frequency: &f64| {
            let mut resolvent = -a.clone();
            for state in 0..self.order() {
                resolvent[(state, state)] += Complex64::from_polar(1.0, frequency);
            }
            let nan = nalgebra::DMatrix::from_element(
                self.order(),
                self.inputs(),
                Complex64::new(f64::NAN, 0.0),
            );
            &c * solve(resolvent, &b).unwrap_or(nan) + &d
        };
        frequencies.iter().map(response).collect()
    }

    /// The same model with input channel `input` multiplied by `gain`.
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
    fn delayed_gain_delays() {
        let gain = Matrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]);
        let markov = StateSpace::delayed_gain(&gain, 3).markov(5);
        assert_eq!(markov[3], gain);
        assert!(markov.iter().enumerate().all(|(lag, tap)| lag == 3 || tap.amax() == 0.0));
        assert!(StateSpace::delayed_gain(&gain, 3).zeros().unwrap().is_empty());
    }
}
