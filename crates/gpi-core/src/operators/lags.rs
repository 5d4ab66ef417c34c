//! First-order lags in parallel, the model of creep.

use super::error::{require_finite, require_length, require_not_negative};
use super::storage::sum;
use super::{Operator, OperatorError, Sample, Storage};

/// A weighted sum of first-order lags in parallel, each of unit DC gain:
/// `y(k) = sum_i c_i l_i(k)`, `l_i(k+1) = l_i(k) + (1 - a_i) (v(k) - l_i(k))`.
///
/// `a_i = exp(-T / T_i)` is the pole of the time constant T_i at the sampling interval T. In single precision, the
/// increment of a slow lag is smaller than the rounding error of its value. The state therefore also holds the rounding
/// error, which is added to the next increment (compensated summation).
///
/// ```
/// use gpi_core::operators::{Lags, Operator};
/// let creep = Lags::new([0.5], [0.1])?;
/// let mut state = creep.rest();
/// assert_eq!([1.0, 1.0, 1.0].map(|v| creep.step(&mut state, v)), [0.0, 0.05, 0.1 * 0.75]);
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Lags<S> {
    rates: S,
    gains: S,
}

/// The state of [`Lags`].
#[derive(Clone, Debug, PartialEq)]
pub struct LagsState<S> {
    /// l_i, in the unit of v.
    pub lags: S,
    /// The rounding error of each lag, in the unit of v.
    pub carried: S,
}

impl<S: Storage> Lags<S> {
    /// Lags with `rates` `1 - a_i` per sample and gains c_i, in units of y per unit of v.
    ///
    /// # Errors
    /// The arrays differ in length, an element is not finite, or a rate is negative.
    pub fn new(rates: S, gains: S) -> Result<Self, OperatorError> {
        require_length("gains", gains.values().len(), rates.values().len())?;
        require_finite("rates", rates.values())?;
        require_finite("gains", gains.values())?;
        require_not_negative("rates", rates.values())?;
        Ok(Self { rates, gains })
    }

    /// The rates `1 - a_i`, per sample.
    pub fn rates(&self) -> &[S::Item] {
        self.rates.values()
    }

    /// The gains c_i.
    pub fn gains(&self) -> &[S::Item] {
        self.gains.values()
    }

    /// The steady state for a constant v: every lag equals v.
    pub fn settled(&self, v: S::Item) -> LagsState<S> {
        LagsState { lags: self.rates.filled(v), carried: self.rates.filled(S::Item::ZERO) }
    }

    /// y(k), which does not depend on v(k).
    #[inline]
    pub fn output(&self, state: &LagsState<S>) -> S::Item {
        let gains = self.gains.values();
        let lags = &state.lags.values()[..gains.len()];
        sum(gains.len(), |i| gains[i] * lags[i])
    }

    /// Updates the state with v(k).
    #[inline]
    pub fn advance(&self, state: &mut LagsState<S>, v: S::Item) {
        let places = state.lags.values_mut().iter_mut().zip(state.carried.values_mut());
        for (&rate, (lag, carried)) in self.rates.values().iter().zip(places) {
            let wanted = rate * (v - *lag) + *carried;
            let there = *lag + wanted;
            *carried = wanted - (there - *lag);
            *lag = there;
        }
    }
}

impl<S: Storage> Operator for Lags<S> {
    type Sample = S::Item;
    type State = LagsState<S>;

    fn rest(&self) -> LagsState<S> {
        self.settled(S::Item::ZERO)
    }

    #[inline]
    fn step(&self, state: &mut LagsState<S>, v: S::Item) -> S::Item {
        let output = self.output(state);
        self.advance(state, v);
        output
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_followed_exponentially() {
        let lags = Lags::new([0.1, 0.004], [2.0, -1.0]).unwrap();
        let mut state = lags.rest();
        for k in 0..500 {
            let expected = 2.0 * (1.0 - 0.9_f64.powi(k)) - (1.0 - 0.996_f64.powi(k));
            assert!((lags.step(&mut state, 1.0) - expected).abs() < 1e-13);
        }
        assert_eq!(lags.output(&lags.settled(3.0)), 3.0);
    }

    #[test]
    fn slow_lags_do_not_stand_still_in_single_precision() {
        // Miri takes milliseconds for each sample, and looks for undefined behaviour only.
        let (rate, samples) = if cfg!(miri) { (1e-2_f32, 600) } else { (1e-6_f32, 6_000_000) };
        let slow = Lags::new([rate], [1.0]).unwrap();
        let mut state = slow.rest();
        let mut last = 0.0;
        for _ in 0..samples {
            last = slow.step(&mut state, 1.0);
        }
        let expected = 1.0 - (-6.0_f64).exp();
        assert!((f64::from(last) - expected).abs() < 1e-6 + f64::from(rate) / 50.0, "{last}");
    }

    #[test]
    fn wrong_parameters_are_named() {
        let expected = OperatorError::LengthMismatch { parameter: "gains", length: 0, expected: 1 };
        assert_eq!(Lags::new(vec![0.1], vec![]).unwrap_err(), expected);
        let expected = OperatorError::Negative { parameter: "rates", index: 1 };
        assert_eq!(Lags::new([0.1, -0.1], [1.0, 1.0]).unwrap_err(), expected);
        assert!(Lags::new([f64::NAN], [1.0]).is_err());
    }
}
