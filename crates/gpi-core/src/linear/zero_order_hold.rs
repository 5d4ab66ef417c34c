//! From continuous to discrete time.

use super::StateSpace;
use crate::{Error, Matrix};

/// Samples the continuous model `dx/dt = A x + B v`, `y = C x + D v` every `period` seconds, with v
/// held in between: `A_d = e^{A T}`, `B_d = int_0^T e^{A t} dt B`.
///
/// ```
/// use gpi_core::linear::{TransferFunction, zero_order_hold};
/// // (48) of the paper, sampled every 10 ms, gives (49)
/// let continuous =
///     TransferFunction::new(&[3.391e10], &[1.0, 3759.0, 2.063e7, 7.514e10])?.to_state_space()?;
/// let discrete = TransferFunction::from_state_space(&zero_order_hold(&continuous, 1e-2)?)?;
/// assert!((discrete.numerator[1][0] - 0.255_977).abs() < 1e-6);
/// assert!((discrete.denominator[1] + 0.574_648).abs() < 1e-6);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A period that is not positive.
pub fn zero_order_hold(continuous: &StateSpace, period: f64) -> Result<StateSpace, Error> {
    if !(period.is_finite() && period > 0.0) {
        return Err(Error::parameter("period", period, "the sampling period must be positive"));
    }
    let (order, inputs) = continuous.b().shape();
    let mut augmented = Matrix::zeros(order + inputs, order + inputs);
    augmented.view_mut((0, 0), (order, order)).copy_from(&(continuous.a() * period));
    augmented.view_mut((0, order), (order, inputs)).copy_from(&(continuous.b() * period));
    let exponential = augmented.exp();
    let a = exponential.view((0, 0), (order, order)).into_owned();
    let b = exponential.view((0, order), (order, inputs)).into_owned();
    StateSpace::new(a, b, continuous.c().clone(), continuous.d().clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;

    fn paper_example(period: f64) -> TransferFunction {
        let continuous = TransferFunction::new(&[3.391e10], &[1.0, 3759.0, 2.063e7, 7.514e10])
            .unwrap()
            .to_state_space()
            .unwrap();
        TransferFunction::from_state_space(&zero_order_hold(&continuous, period).unwrap()).unwrap()
    }

    #[test]
    fn ten_milliseconds_give_equation_49() {
        let tf = paper_example(1e-2);
        for (power, expected) in [(1, 0.255_977), (2, 0.024_389_9), (3, 0.134_935)] {
            assert!((tf.numerator[power][0] / expected - 1.0).abs() < 3e-6);
        }
        for (power, expected) in [(1, -0.574_648), (2, 0.494_901)] {
            assert!((tf.denominator[power] / expected - 1.0).abs() < 3e-6);
        }
        assert!(tf.denominator[3].abs() < 1e-15);
    }

    #[test]
    fn ten_microseconds_do_not() {
        let tf = paper_example(1e-5);
        for (power, expected) in [(1, 5.598e-6), (2, 2.218e-5), (3, 5.494e-6)] {
            assert!((tf.numerator[power][0] / expected - 1.0).abs() < 3e-4);
        }
        for (power, expected) in [(1, -2.961_05), (2, 2.924_23), (3, -0.963_108)] {
            assert!((tf.denominator[power] / expected - 1.0).abs() < 3e-6);
        }
    }
}
