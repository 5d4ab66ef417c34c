//! Operators in the order of the signal flow: deadzones, plays, their cascade, first-order lags and linear dynamics;
//! then the inverse operators, which compute the drive for a reference, and the monitor of a model's residual.
//!
//! Configuration (half-widths, thresholds, weights) and state are separate: one configuration may serve any number of
//! channels. [`Operator::step`] defines an operator. The block forms compute the same outputs for a whole record.

#[cfg(feature = "identify")]
mod block;
mod cascade;
mod deadzones;
mod error;
mod inverse;
mod lags;
mod monitor;
mod plays;
mod state_space;
mod storage;

pub use cascade::{Gpi, GpiState};
pub use deadzones::{Deadzones, DeadzonesState, Reading};
pub use error::OperatorError;
pub use inverse::{Compensator, CompensatorState, Curve, Faults, InverseGpi, InverseState};
pub use lags::{Lags, LagsState};
#[cfg(feature = "identify")]
pub(crate) use monitor::POSSIBLE;
pub use monitor::{
    Agreed, Limits, Merge, Moments, Regression, ResidualMonitor, ResidualMonitorState, Windows,
};
pub use plays::{PlayBank, PlayBankState, play};
pub use state_space::StateSpaceStep;
pub use storage::{Sample, Storage};

/// Block length, in samples, of a cascade of operators: the block's inputs and outputs (`f64`) fit into the second-level
/// cache. An eighth of it is not a power of two, because addresses at multiples of one share a set of the first cache.
pub(crate) const IN_CACHE: usize = 32_704;

/// A causal map from one input sample to one output sample. The caller holds its state.
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
    /// The memory of the operator between samples.
    type State: Clone;

    /// The initial state of an actuator that has never been driven.
    fn rest(&self) -> Self::State;

    /// The output for one sample; updates `state` for the next one.
    fn step(&self, state: &mut Self::State, input: Self::Sample) -> Self::Sample;

    /// Writes the outputs for consecutive samples to `output`; updates `state`.
    ///
    /// Returns the number of processed samples, the length of the shorter slice.
    fn block(
        &self,
        state: &mut Self::State,
        input: &[Self::Sample],
        output: &mut [Self::Sample],
    ) -> usize {
        for (output, input) in output.chunks_mut(IN_CACHE).zip(input.chunks(IN_CACHE)) {
            let samples = input.len().min(output.len());
            output[..samples].copy_from_slice(&input[..samples]);
            self.in_place(state, &mut output[..samples]);
        }
        input.len().min(output.len())
    }

    /// Replaces each sample of `signal` by the operator's output; updates `state`.
    fn in_place(&self, state: &mut Self::State, signal: &mut [Self::Sample]) {
        for value in signal {
            *value = self.step(state, *value);
        }
    }
}
