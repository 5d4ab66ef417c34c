//! The residual's mean.

use super::independence::{BlockSums, dependence};
use super::{Beside, ResidualTest};

/// Whether the residual is zero on average.
pub(super) fn mean(beside: &Beside, output: usize, chance: f64) -> ResidualTest {
    let mut sums = BlockSums::new(beside.record.scored());
    for (experiment, k) in beside.scored() {
        sums.add(beside.residuals[experiment][(k, output)]);
    }
    dependence("mean", "an offset that moved, drift", output, &[sums.t()], chance)
}
