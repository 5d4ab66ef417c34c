//! The play operator F and the weighted bank P of plays.

use super::error::{require_finite, require_length, require_not_negative};
use super::storage::sum;
use super::{Operator, OperatorError, Sample, Storage};

/// One step of the play operator, equation (7) of the paper: `F(k) = max(z(k) - r, min(z(k) + r, F(k-1)))`.
///
/// `half_width` is r, half the width of the gap in which the output does not change; `input` is z(k) and `previous` is
/// F(k-1), all in the same unit. A NaN input leaves the output unchanged.
///
/// ```
/// use gpi_core::operators::play;
/// assert_eq!(play(0.3, 1.0, 0.0), 0.7); // upper branch: z - r
/// assert_eq!(play(0.3, 0.5, 0.7), 0.7); // inside the gap: unchanged
/// assert_eq!(play(0.3, 0.0, 0.7), 0.3); // lower branch: z + r
/// ```
#[inline]
pub fn play<T: Sample>(half_width: T, input: T, previous: T) -> T {
    previous.at_most(input + half_width).at_least(input - half_width)
}

/// A weighted bank of plays, equation (11) of the paper: `v(k) = sum_i p_i F_{r_i}[z](k)`.
///
/// `S` is `[T; N]` on firmware or `Vec<T>` on a host; T is `f32` or `f64`.
///
/// ```
/// use gpi_core::operators::{Operator, PlayBank};
/// let bank = PlayBank::new([0.1, 0.2, 0.3, 0.4], [0.25; 4])?;
/// let mut v = [0.0, 0.2, 0.5, 1.1, 1.25, 1.0, 0.2, -1.0];
/// bank.in_place(&mut bank.rest(), &mut v);
/// for (value, expected) in v.iter().zip([0.0, 0.025, 0.25, 0.85, 1.0, 0.9875, 0.45, -0.75]) {
///     assert!((value - expected as f64).abs() < 1e-15);
/// }
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
pub struct PlayBank<S> {
    pub(super) half_widths: S,
    pub(super) weights: S,
}

/// The outputs F_{r_i}(k-1) of the plays of a [`PlayBank`], in the bank's order, in the input's unit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
pub struct PlayBankState<S> {
    pub(super) plays: S,
}

impl<S: Storage> PlayBank<S> {
    /// A bank of plays with half-widths r_i >= 0 and weights p_i of any sign.
    ///
    /// # Errors
    /// The arrays differ in length, an element is not finite, or a half-width is negative.
    pub fn new(half_widths: S, weights: S) -> Result<Self, OperatorError> {
        require_length("weights", weights.values().len(), half_widths.values().len())?;
        require_finite("half_widths", half_widths.values())?;
        require_finite("weights", weights.values())?;
        require_not_negative("half_widths", half_widths.values())?;
        Ok(Self { half_widths, weights })
    }

    /// The half-widths r_i, in the input's unit.
    pub fn half_widths(&self) -> &[S::Item] {
        self.half_widths.values()
    }

    /// The weights p_i, in units of output per unit of input.
    pub fn weights(&self) -> &[S::Item] {
        self.weights.values()
    }

    /// The demagnetized state: every play's output equals `input`, as after a decaying oscillation around `input`.
    pub fn settled(&self, input: S::Item) -> PlayBankState<S> {
        PlayBankState { plays: self.half_widths.filled(input) }
    }

    /// A state from saved play outputs F_{r_i}(k-1), in the bank's order; the next sample clamps each as in (7).
    ///
    /// # Errors
    /// The length differs from the bank's, or an element is not finite.
    pub fn state_from(&self, plays: S) -> Result<PlayBankState<S>, OperatorError> {
        require_length("state", plays.values().len(), self.half_widths.values().len())?;
        require_finite("state", plays.values())?;
        Ok(PlayBankState { plays })
    }
}

#[cfg(feature = "identify")]
impl PlayBank<Vec<f64>> {
    /// [`Operator::block`] on several threads, each with one segment of the record: faster from about 10^6 samples on.
    ///
    /// If z varies by less than twice the largest half-width within a segment, one thread computes everything. The
    /// outputs equal those of [`Operator::block`] up to rounding.
    ///
    /// ```
    /// use gpi_core::operators::{Operator, PlayBank};
    /// let bank = PlayBank::new(vec![0.1, 0.4], vec![1.0, 2.0])?;
    /// let input: Vec<f64> = (0..1000).map(|k| (0.3 * f64::from(k)).sin()).collect();
    /// let (mut alone, mut shared) = (input.clone(), input.clone());
    /// bank.block(&mut bank.rest(), &input, &mut alone);
    /// bank.block_on(2, &mut bank.rest(), &input, &mut shared);
    /// assert!(alone.iter().zip(&shared).all(|(a, b)| (a - b).abs() < 1e-14));
    /// # Ok::<(), gpi_core::operators::OperatorError>(())
    /// ```
    pub fn block_on(
        &self,
        threads: usize,
        state: &mut PlayBankState<Vec<f64>>,
        input: &[f64],
        output: &mut [f64],
    ) -> usize {
        let samples = input.len().min(output.len());
        let (input, output) = (&input[..samples], &mut output[..samples]);
        let parameters = (&self.half_widths[..], &self.weights[..]);
        super::block::threads::run(parameters, &mut state.plays, input, output, threads);
        samples
    }
}

impl<S: Storage> PlayBankState<S> {
    /// The play outputs F_{r_i}(k-1), to be saved.
    pub fn plays(&self) -> &[S::Item] {
        self.plays.values()
    }
}

impl<S: Storage> Operator for PlayBank<S> {
    type Sample = S::Item;
    type State = PlayBankState<S>;

    /// All play outputs are zero; the first sample then gives F(0) = clamp(0, z(0) - r, z(0) + r).
    fn rest(&self) -> PlayBankState<S> {
        PlayBankState { plays: self.half_widths.filled(S::Item::ZERO) }
    }

    #[inline]
    fn step(&self, state: &mut PlayBankState<S>, input: S::Item) -> S::Item {
        let count = self.half_widths.values().len();
        let (half_widths, weights) = (self.half_widths.values(), self.weights.values());
        let (weights, places) = (&weights[..count], &mut state.plays.values_mut()[..count]);
        sum(count, |i| {
            places[i] = play(half_widths[i], input, places[i]);
            weights[i] * places[i]
        })
    }

    fn block(
        &self,
        state: &mut PlayBankState<S>,
        input: &[S::Item],
        output: &mut [S::Item],
    ) -> usize {
        let samples = input.len().min(output.len());
        let (input, output) = (&input[..samples], &mut output[..samples]);
        if !self.at_length(state, Some(input), output) {
            for (value, &sample) in output.iter_mut().zip(input) {
                *value = self.step(state, sample);
            }
        }
        samples
    }

    /// On a host, a long record is computed from the turning points of z, or, if z reverses often, in several segments
    /// of time in parallel. The outputs equal those of [`Operator::step`] up to rounding.
    fn in_place(&self, state: &mut PlayBankState<S>, signal: &mut [S::Item]) {
        if !self.at_length(state, None, signal) {
            for value in signal {
                *value = self.step(state, *value);
            }
        }
    }
}

impl<S: Storage> PlayBank<S> {
    /// The outputs for a long record on a host, from `input` or in place; otherwise does nothing and returns `false`.
    #[cfg_attr(not(feature = "identify"), expect(unused_variables, clippy::unused_self))]
    fn at_length(
        &self,
        state: &mut PlayBankState<S>,
        input: Option<&[S::Item]>,
        signal: &mut [S::Item],
    ) -> bool {
        #[cfg(feature = "identify")]
        if super::block::bank::pays(self.half_widths.values().len(), signal.len())
            && let (Some(widths), Some(weights), Some(places), Some(signal)) = (
                S::Item::doubles(self.half_widths.values()),
                S::Item::doubles(self.weights.values()),
                S::Item::doubles_mut(state.plays.values_mut()),
                S::Item::doubles_mut(signal),
            )
        {
            let input = input.and_then(S::Item::doubles);
            super::block::bank::run((widths, weights), places, input, signal);
            return true;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_mismatch_is_named() {
        let error = PlayBank::new(vec![0.0, 1.0], vec![1.0]).unwrap_err();
        assert_eq!(
            error,
            OperatorError::LengthMismatch { parameter: "weights", length: 1, expected: 2 }
        );
    }

    #[test]
    fn negative_half_width_is_named() {
        let error = PlayBank::new([0.0, -1.0], [1.0, 1.0]).unwrap_err();
        assert_eq!(error, OperatorError::Negative { parameter: "half_widths", index: 1 });
        assert!(PlayBank::new([f64::NAN], [1.0]).is_err());
        assert!(PlayBank::new([0.0], [f64::INFINITY]).is_err());
    }

    #[test]
    fn nan_holds_the_plays() {
        let bank = PlayBank::new([0.0, 0.5], [1.0, 1.0]).unwrap();
        let mut state = bank.rest();
        let before = bank.step(&mut state, 2.0);
        assert_eq!(bank.step(&mut state, f64::NAN), before);
    }

    #[test]
    fn saved_state_continues() {
        let bank = PlayBank::new([0.1_f32, 0.4], [1.0, 2.0]).unwrap();
        let input = [0.3_f32, 1.0, 0.2, -0.7, 0.1];
        let mut whole = [0.0; 5];
        bank.block(&mut bank.rest(), &input, &mut whole);
        let mut state = bank.rest();
        let mut parts = [0.0; 5];
        assert_eq!(bank.block(&mut state, &input[..2], &mut parts[..2]), 2);
        let mut saved = [0.0; 2];
        saved.copy_from_slice(state.plays());
        let mut restored = bank.state_from(saved).unwrap();
        bank.block(&mut restored, &input[2..], &mut parts[2..]);
        assert_eq!(whole, parts);
    }
}
