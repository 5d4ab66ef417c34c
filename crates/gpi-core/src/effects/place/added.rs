//! Signals that are added to the displacement or to the reading.

use super::moment::Moment;
use crate::effects::block::Block;

/// A signal that does not depend on the input.
pub trait Added: Block {
    /// The output channel.
    fn output(&self) -> usize;

    /// Whether it is a disturbance at the plant's output, before the sensor, and not only in the reading.
    fn moves_stage(&self) -> bool;

    /// Puts it before the output stage (true) or after it.
    fn set_moves_stage(&mut self, moves_stage: bool);

    /// The state before the first sample.
    fn rest(&self, _first: Moment) -> Vec<f64> {
        Vec::new()
    }

    /// The signal at one sample.
    fn add(&self, state: &mut [f64], moment: Moment) -> f64;
}
