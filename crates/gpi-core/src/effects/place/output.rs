//! The output stage: from the displacement to the sensor's reading.

use super::moment::Moment;
use crate::effects::block::Block;

/// How a change of the displacement passes to the reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slope {
    /// It is multiplied by this factor.
    Times(f64),
    /// It does not pass: the reading keeps the changes of the sample before.
    Held,
}

/// An effect between the displacement and the reading.
pub trait OutputStage: Block {
    /// The output channel.
    fn output(&self) -> usize;

    /// The state after the displacement has been constant at `first`.
    fn rest(&self, _first: f64) -> Vec<f64> {
        Vec::new()
    }

    /// The reading for one sample of the displacement, and how changes pass.
    fn sense(&self, state: &mut [f64], displacement: f64, moment: Moment) -> (f64, Slope);
}
