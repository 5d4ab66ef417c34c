//! The envelope D: a weighted sum of deadzones.

use super::error::{require_finite, require_length};
use super::storage::sum;
use super::{Operator, OperatorError, Sample, Storage};

/// The deadzone convention: the definition of Z_eta. The paper's text and its equation (3) disagree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "identify", serde(rename_all = "kebab-case"))]
pub enum Reading {
    /// The memoryless deadzone that the paper's text describes:
    /// `max(u - eta, 0)` if eta > 0, `min(u - eta, 0)` if eta < 0, and `u` if eta = 0.
    #[default]
    OneSided,
    /// Equation (3) exactly as printed: `u - eta` if `u > eta` and u increases, `u + eta` if `u < -eta` and u
    /// decreases, and 0 otherwise. It depends on the previous input, so it is not memoryless.
    Directional,
}

impl Reading {
    /// Z_eta for one sample, without its weight; `previous` is u(k-1).
    ///
    /// ```
    /// use gpi_core::operators::Reading;
    /// assert_eq!(Reading::OneSided.zone(1.0, 4.0, 3.0), 2.0);
    /// assert_eq!(Reading::Directional.zone(1.0, 4.0, 3.0), 0.0); // u decreases, but not below -1
    /// ```
    #[inline]
    pub fn zone<T: Sample>(self, threshold: T, previous: T, input: T) -> T {
        let zero = T::ZERO;
        match self {
            Self::OneSided => {
                let beyond = input - threshold;
                if threshold == zero
                    || (threshold > zero && beyond > zero)
                    || (threshold < zero && beyond < zero)
                {
                    beyond
                } else {
                    zero
                }
            }
            Self::Directional => {
                if input > previous && input > threshold {
                    input - threshold
                } else if input < previous && input < -threshold {
                    input + threshold
                } else {
                    zero
                }
            }
        }
    }
}

/// A weighted sum of deadzones, equation (2) of the paper: `z(k) = sum_j g_j Z_{eta_j}[u](k)`.
///
/// Thresholds have the unit of the input. Weights are slopes, in units of z per unit of u. `S` is `[T; N]` on firmware
/// or `Vec<T>` on a host; T is `f32` or `f64`.
///
/// ```
/// use gpi_core::operators::{Deadzones, Operator, Reading};
/// let envelope = Deadzones::new([0.0, 1.0], [1.0, -0.5], Reading::OneSided)?;
/// let mut z = [-2.0, 0.5, 1.0, 3.0];
/// envelope.in_place(&mut envelope.rest(), &mut z);
/// assert_eq!(z, [-2.0, 0.5, 1.0, 2.0]); // slope 1, from u = 1 on slope 0.5
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "identify", serde(try_from = "Parameters<S>"))]
#[cfg_attr(
    feature = "identify",
    serde(bound(deserialize = "S: Storage + serde::Deserialize<'de>"))
)]
pub struct Deadzones<S> {
    pub(super) thresholds: S,
    pub(super) weights: S,
    reading: Reading,
    /// The one-sided deadzone is `u - clamp(u, lower, upper)`. These bounds are computed once, so that `step` does not
    /// branch on the sign of each threshold.
    #[cfg_attr(feature = "identify", serde(skip_serializing))]
    lower: S,
    #[cfg_attr(feature = "identify", serde(skip_serializing))]
    upper: S,
}

/// The part of [`Deadzones`] that is saved in files.
#[cfg(feature = "identify")]
#[derive(serde::Deserialize)]
struct Parameters<S> {
    thresholds: S,
    weights: S,
    reading: Reading,
}

#[cfg(feature = "identify")]
impl<S: Storage> TryFrom<Parameters<S>> for Deadzones<S> {
    type Error = OperatorError;
    fn try_from(read: Parameters<S>) -> Result<Self, OperatorError> {
        Self::new(read.thresholds, read.weights, read.reading)
    }
}

/// The previous input u(k-1), which the [`Reading::Directional`] deadzone compares with.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
pub struct DeadzonesState<T> {
    /// u(k-1), zero at rest.
    pub previous: T,
}

impl<S: Storage> Deadzones<S> {
    /// An envelope of deadzones with thresholds eta_j and weights g_j of any sign.
    ///
    /// # Errors
    /// The arrays differ in length, or an element is not finite.
    pub fn new(thresholds: S, weights: S, reading: Reading) -> Result<Self, OperatorError> {
        require_length("weights", weights.values().len(), thresholds.values().len())?;
        require_finite("thresholds", thresholds.values())?;
        require_finite("weights", weights.values())?;
        let (zero, infinity) = (S::Item::ZERO, S::Item::INFINITY);
        let (mut lower, mut upper) = (thresholds.clone(), thresholds.clone());
        for (lower, upper) in lower.values_mut().iter_mut().zip(upper.values_mut()) {
            if *lower > zero {
                *lower = -infinity;
            } else if *upper < zero {
                *upper = infinity;
            }
        }
        Ok(Self { thresholds, weights, reading, lower, upper })
    }

    /// The thresholds eta_j, in the input's unit.
    pub fn thresholds(&self) -> &[S::Item] {
        self.thresholds.values()
    }

    /// The weights g_j, in units of z per unit of u.
    pub fn weights(&self) -> &[S::Item] {
        self.weights.values()
    }

    /// The deadzone convention.
    pub fn reading(&self) -> Reading {
        self.reading
    }

    /// Z_eta for one sample, without its weight; `previous` is u(k-1).
    #[inline]
    pub fn zone(&self, threshold: S::Item, previous: S::Item, input: S::Item) -> S::Item {
        self.reading.zone(threshold, previous, input)
    }
}

impl<S: Storage> Operator for Deadzones<S> {
    type Sample = S::Item;
    type State = DeadzonesState<S::Item>;

    /// The previous input is zero.
    fn rest(&self) -> DeadzonesState<S::Item> {
        DeadzonesState { previous: S::Item::ZERO }
    }

    #[inline]
    fn step(&self, state: &mut DeadzonesState<S::Item>, input: S::Item) -> S::Item {
        let count = self.thresholds.values().len();
        let weights = &self.weights.values()[..count];
        let previous = core::mem::replace(&mut state.previous, input);
        match self.reading {
            Reading::OneSided => {
                let lower = &self.lower.values()[..count];
                let upper = &self.upper.values()[..count];
                sum(count, |j| weights[j] * (input - input.at_most(upper[j]).at_least(lower[j])))
            }
            Reading::Directional => {
                let thresholds = self.thresholds.values();
                sum(count, |j| weights[j] * self.zone(thresholds[j], previous, input))
            }
        }
    }

    /// On a host, a long record is evaluated with one piecewise linear curve for all deadzones, at a cost that hardly
    /// grows with their number. The outputs equal those of [`Operator::step`] up to rounding.
    fn in_place(&self, state: &mut DeadzonesState<S::Item>, signal: &mut [S::Item]) {
        #[cfg(feature = "identify")]
        {
            use super::block::zones;
            let (thresholds, weights) = (self.thresholds.values(), self.weights.values());
            let previous = core::slice::from_mut(&mut state.previous);
            if zones::pays(thresholds.len(), signal.len())
                && let (Some(thresholds), Some(weights), Some([previous]), Some(signal)) = (
                    S::Item::doubles(thresholds),
                    S::Item::doubles(weights),
                    S::Item::doubles_mut(previous),
                    S::Item::doubles_mut(signal),
                )
                && zones::in_place(thresholds, weights, self.reading, previous, signal)
            {
                return;
            }
        }
        for value in signal {
            *value = self.step(state, *value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zones(threshold: f64, reading: Reading, input: &[f64]) -> Vec<f64> {
        let zone = Deadzones::new([threshold], [1.0], reading).unwrap();
        let mut output = input.to_vec();
        zone.in_place(&mut zone.rest(), &mut output);
        output
    }

    #[test]
    fn one_sided_is_the_usual_deadzone() {
        let input = [-3.0, -1.0, 0.0, 1.0, 3.0];
        assert_eq!(zones(2.0, Reading::OneSided, &input), [0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(zones(-2.0, Reading::OneSided, &input), [-1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(zones(0.0, Reading::OneSided, &input), input);
    }

    #[test]
    fn directional_is_equation_3_as_printed() {
        let input = [1.0, 3.0, 3.0, 2.5, -1.0, -3.0, -2.0];
        assert_eq!(zones(2.0, Reading::Directional, &input), [0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
        // a negative threshold lets both branches act at once: the direction decides
        assert_eq!(
            zones(-2.0, Reading::Directional, &input),
            [3.0, 5.0, 0.0, 0.0, -3.0, -5.0, 0.0]
        );
    }
}
