//! Discretization of a continuous-time model by a zero-order hold.

use super::StateSpace;
use crate::{Error, Matrix};

/// Discretizes the continuous-time model `dx/dt = A x + B v`, `y = C x + D v` with the sampling period T (`period`, in
/// seconds), for an input v that is constant between samples: `A_d = e^{A T}`, `B_d = int_0^T e^{A t} dt B`.
///
/// Both follow from one matrix exponential, `exp([A, B; 0, 0] T) = [A_d, B_d; 0, I]`.
///
/// ```
/// use gpi_core::linear::{TransferFunction, zero_order_hold};
/// // equation (48) of the paper, sampled every 10 ms, gives equation (49)
/// let continuous =
///     TransferFunction::new(&[3.391e10], &[1.0, 3759.0, 2.063e7, 7.514e10])?.to_state_space()?;
/// let discrete = TransferFunction::from_state_space(&zero_order_hold(&continuous, 1e-2)?)?;
/// assert!((discrete.numerator[1][0] - 0.255_977).abs() < 1e-6);
/// assert!((discrete.denominator[1] + 0.574_648).abs() < 1e-6);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// The period is not positive.
pub fn zero_order_hold(continuous: &StateSpace, period: f64) -> Result<StateSpace, Error> {
    Error::require_positive("period", period, "the sampling period must be positive")?;
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

    #[test]
    fn ten_milliseconds_give_equation_49_and_ten_microseconds_do_not() {
        let example = TransferFunction::new(&[3.391e10], &[1.0, 3759.0, 2.063e7, 7.514e10]);
        let continuous = example.unwrap().to_state_space().unwrap();
        let at_10_ms = ([0.255_977, 0.024_389_9, 0.134_935], [-0.574_648, 0.494_901, 0.0]);
        let at_10_us = ([5.598e-6, 2.218e-5, 5.494e-6], [-2.961_05, 2.924_23, -0.963_108]);
        for (period, tolerance, (b, a)) in [(1e-2, 3e-6, at_10_ms), (1e-5, 3e-4, at_10_us)] {
            let discrete = zero_order_hold(&continuous, period).unwrap();
            let tf = TransferFunction::from_state_space(&discrete).unwrap();
            for i in 0..3 {
                assert!((tf.numerator[i + 1][0] - b[i]).abs() < tolerance * b[i]);
                assert!((tf.denominator[i + 1] - a[i]).abs() <= 3e-6 * a[i].abs() + 1e-15);
            }
        }
    }
}
