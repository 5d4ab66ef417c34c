//! Operators, in the order the signal meets them: deadzones, plays, their cascade, lags and linear dynamics; and the way
//! back from a reference to the drive.
//!
//! Configuration (half-widths, thresholds, weights) and state are kept apart: one configuration may
//! drive any number of channels. Every operator is a [`Operator::step`] first; the block forms run
//! the same arithmetic over a whole record.

#[cfg(feature = "identify")]
mod block;
mod cascade;
mod deadzones;
mod error;
mod inverse;
mod lags;
mod plays;
mod state_space;
mod storage;

pub use cascade::{Gpi, GpiState};
pub use deadzones::{Deadzones, DeadzonesState, Reading};
pub use error::OperatorError;
pub use inverse::{Compensator, CompensatorState, Curve, InverseGpi, InverseState};
pub use lags::{Lags, LagsState};
pub use plays::{PlayBank, PlayBankState, play};
pub use state_space::StateSpaceStep;
pub use storage::{Sample, Storage};

/// Samples that go through one operator after the other at once: `f64` in and out stay in the processor's second
/// cache. An eighth of them is no power of two, whose multiples would all go to one place of the first cache.
pub(crate) const IN_CACHE: usize = 32_704;

/// A causal map from one sample to one sample, with its memory held by the caller.
///
/// ```
/// use gpi_core::operators::{Operator, PlayBank};
/// let bank = PlayBank::new([0.0, 0.5], [1.0, 1.0])?;
/// let mut state = bank.rest();
/// assert_eq!(bank.step(&mut state, 2.0), 2.0 + 1.5);
/// assert_eq!(bank.step(&mut state, 1.5), 1.5 + 1.5); // the play of half-width 0.5 sticks
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
pub trait Operator {
    /// The number type of the signal, `f32` or `f64`.
    type Sample: Copy;
    /// What the operator remembers between samples.
    type State: Clone;

    /// The state before the first sample of an actuator that was never driven.
    fn rest(&self) -> Self::State;

    /// The output of one sample; `state` moves on to the next.
    fn step(&self, state: &mut Self::State, input: Self::Sample) -> Self::Sample;

    /// The outputs of consecutive samples, written to `output`.
    ///
    /// Returns how many samples were processed, the length of the shorter slice.
    fn block(
        &self,
        state: &mut Self::State,
        input: &[Self::Sample],
        output: &mut [Self::Sample],
    ) -> usize {
        for (value, &sample) in output.iter_mut().zip(input) {
            *value = self.step(state, sample);
        }
        input.len().min(output.len())
    }

    /// Replaces each sample of `signal` by the operator's output.
    fn in_place(&self, state: &mut Self::State, signal: &mut [Self::Sample]) {
        for value in signal {
            *value = self.step(state, *value);
        }
    }
}
