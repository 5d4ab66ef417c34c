//! Transfer functions with a common denominator.

use super::StateSpace;
use crate::{Error, Matrix};
use num_complex::Complex64;

/// `G(z) = N(z) / d(z)` with polynomials in descending powers, as in equation (49) of the paper.
///
/// Every entry of N has as many coefficients as d. The variable is z in discrete time and s in continuous time; the
/// conversion to a state space is the same.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    /// Coefficients of N, highest power first, each (outputs, inputs).
    pub numerator: Vec<Matrix>,
    /// Coefficients of d, highest power first; the first one is 1.
    pub denominator: Vec<f64>,
}

impl TransferFunction {
    /// A single-input, single-output transfer function; leading zeros are added to a shorter numerator.
    ///
    /// ```
    /// use gpi_core::linear::TransferFunction;
    /// let lag = TransferFunction::new(&[0.5], &[1.0, -0.5])?.to_state_space()?;
    /// assert_eq!(lag.markov(3)[2][0], 0.25);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The denominator is empty or starts with zero, or the numerator has a higher degree.
    pub fn new(numerator: &[f64], denominator: &[f64]) -> Result<Self, Error> {
        let leading = denominator.first().copied().unwrap_or(0.0);
        let requirement = "its highest power needs a coefficient other than 0";
        Error::require(leading != 0.0, "denominator", leading, requirement)?;
        let Some(padding) = denominator.len().checked_sub(numerator.len()) else {
            let requirement = format!(
                "the denominator has {} coefficients; a proper system has no more in its numerator",
                denominator.len()
            );
            return Err(Error::parameter("numerator", numerator.len(), requirement));
        };
        let padded = std::iter::repeat_n(0.0, padding).chain(numerator.iter().copied());
        Ok(Self {
            numerator: padded.map(|value| Matrix::from_element(1, 1, value / leading)).collect(),
            denominator: denominator.iter().map(|value| value / leading).collect(),
        })
    }

    /// The transfer function of a state space model. The denominator is the characteristic polynomial of A, the numerator
    /// its convolution with the Markov parameters.
    ///
    /// # Errors
    /// The eigendecomposition does not converge.
    pub fn from_state_space(system: &StateSpace) -> Result<Self, Error> {
        let mut polynomial = vec![Complex64::new(1.0, 0.0)];
        for pole in system.poles()? {
            polynomial.push(Complex64::new(0.0, 0.0));
            for power in (1..polynomial.len()).rev() {
                let shifted = polynomial[power - 1] * pole;
                polynomial[power] -= shifted;
            }
        }
        let denominator: Vec<f64> = polynomial.iter().map(|value| value.re).collect();
        let markov = system.markov(denominator.len());
        let numerator = (0..denominator.len()).map(|power| {
            let terms = (0..=power).map(|j| &markov[power - j] * denominator[j]);
            terms.fold(Matrix::zeros(system.outputs(), system.inputs()), |sum, term| sum + term)
        });
        Ok(Self { numerator: numerator.collect(), denominator })
    }

    /// The controllable canonical form. Its states are scaled, so that large coefficients (continuous time in rad/s) do
    /// not reduce the accuracy.
    ///
    /// # Errors
    /// A coefficient is not finite, or so large that its scaled form is not.
    pub fn to_state_space(&self) -> Result<StateSpace, Error> {
        let degree = self.denominator.len() - 1;
        let (outputs, inputs) = self.numerator[0].shape();
        // an upper bound of the roots' moduli: in its unit, all coefficients are at most 1
        let scaled = |(power, value): (usize, &f64)| value.abs().powf(1.0 / power as f64);
        let bound = self.denominator.iter().enumerate().skip(1).map(scaled).fold(0.0, f64::max);
        let scale = if bound > 0.0 { bound } else { 1.0 };
        let order = degree * inputs;
        let mut a = Matrix::zeros(order, order);
        let mut b = Matrix::zeros(order, inputs);
        let mut c = Matrix::zeros(outputs, order);
        let d = self.numerator[0].clone();
        for power in 0..degree {
            let shrink = scale.powi(-(power as i32));
            for input in 0..inputs {
                a[(input, power * inputs + input)] = -self.denominator[power + 1] * shrink;
                if power > 0 {
                    a[(power * inputs + input, (power - 1) * inputs + input)] = scale;
                }
            }
            let strictly_proper = &self.numerator[power + 1] - &d * self.denominator[power + 1];
            c.columns_mut(power * inputs, inputs).copy_from(&(strictly_proper * shrink));
        }
        if degree > 0 {
            b.view_mut((0, 0), (inputs, inputs)).fill_with_identity();
        }
        StateSpace::new(a, b, c, d)
    }

    /// G(z) at a point z of the complex plane, (outputs, inputs).
    pub fn evaluate(&self, point: Complex64) -> nalgebra::DMatrix<Complex64> {
        let denominator = self
            .denominator
            .iter()
            .fold(Complex64::new(0.0, 0.0), |sum, value| sum * point + value);
        let (outputs, inputs) = self.numerator[0].shape();
        nalgebra::DMatrix::from_fn(outputs, inputs, |o, i| {
            let horner = |sum: Complex64, tap: &Matrix| sum * point + tap[(o, i)];
            self.numerator.iter().fold(Complex64::new(0.0, 0.0), horner) / denominator
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let tf = TransferFunction::new(&[0.2, -0.3], &[2.0, -1.0, 0.6]).unwrap();
        let back = TransferFunction::from_state_space(&tf.to_state_space().unwrap()).unwrap();
        for (there, back) in tf.denominator.iter().zip(&back.denominator) {
            assert!((there - back).abs() < 1e-14);
        }
        for (there, back) in tf.numerator.iter().zip(&back.numerator) {
            assert!((there - back).amax() < 1e-14);
        }
    }

    #[test]
    fn improper_and_empty_are_refused() {
        assert!(TransferFunction::new(&[1.0, 2.0], &[1.0]).is_err());
        assert!(TransferFunction::new(&[1.0], &[0.0, 1.0]).is_err());
        assert!(TransferFunction::new(&[1.0], &[]).is_err());
    }
}
