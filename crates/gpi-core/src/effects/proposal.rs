//! Blocks that the search tries on a base model.

use super::block::Block;

/// A block with the probes by which the score test judges it: every probe gives one column, the change of the
/// output when the probe is added to the model.
#[derive(Clone, Debug)]
pub(crate) struct Proposal<B> {
    /// With zero contribution to the output, unless there is one finite probe.
    pub block: B,
    /// The block with one value each changed by its step; or one finite block.
    pub probes: Vec<B>,
    /// Whether the block's values are those of the probes, weighted.
    pub linear: bool,
}

impl<B: Block + Clone> Proposal<B> {
    /// A block to whose values at these places the output responds linearly: probes change them by its steps.
    pub(crate) fn linear(block: B, places: impl IntoIterator<Item = usize>) -> Self {
        let (values, steps) = (block.values(), block.steps());
        let probe = |place: usize| {
            let (mut probe, mut values) = (block.clone(), values.clone());
            values[place] += steps[place];
            probe.set(&values);
            probe
        };
        Self { probes: places.into_iter().map(probe).collect(), linear: true, block }
    }

    /// A block to all of whose values the output responds linearly.
    pub(crate) fn linear_in_all(block: B) -> Self {
        let count = block.values().len();
        Self::linear(block, 0..count)
    }

    /// A block that is compared as a whole with its absence.
    pub(crate) fn finite(block: B) -> Self {
        Self { probes: vec![block.clone()], linear: false, block }
    }
}
