//! What is found in the residual.

use crate::effects::quantity::{Quantity, Units};

/// A description of the residual. It has no estimated values, and nothing is simulated.
pub trait Finding {
    /// The output channel, where it describes one alone.
    fn output(&self) -> Option<usize>;

    /// What was found, with its units.
    fn quantities(&self, units: Units) -> Vec<Quantity>;
}
