//! The input stage: from the commanded input to the drive of the hysteresis.

use crate::effects::block::Block;

/// An effect that changes the drive before the hysteresis.
pub trait InputStage: Block {
    /// The input channel.
    fn input(&self) -> usize;

    /// The state after the input has been constant at `first`.
    fn rest(&self, first: f64) -> Vec<f64>;

    /// The drive that reaches the hysteresis, for one sample of the input; `rate` is the sampling rate in
    /// Hz.
    fn drive(&self, state: &mut [f64], input: f64, rate: f64) -> f64;

    /// The delay in samples.
    fn late(&self) -> f64 {
        0.0
    }

    /// The largest slope that passes unchanged, in units of the input per second.
    fn fastest(&self) -> f64 {
        f64::INFINITY
    }
}
