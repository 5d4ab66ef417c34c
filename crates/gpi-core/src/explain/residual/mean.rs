//! The mean of the residual.
//!
//! The t of [`super::independence`] with the function 1: `t = sum_b g_b / sqrt(sum_b g_b^2)`, g_b the sum of the
//! residual over block b. The residual is taken as it is here, not without its mean as in the other tests.

use super::compared::Compared;
use super::independence::{BlockSums, dependence};
use super::outcome::{ResidualTest, points_to};

/// Whether the residual is zero on average.
pub(super) fn mean(given: &Compared, output: usize, significance: f64) -> ResidualTest {
    let mut sums = BlockSums::new(given.record.scored(), given.policy.blocks);
    for (experiment, k) in given.scored() {
        sums.add(given.residuals[experiment][(k, output)]);
    }
    let points_to = points_to("mean", "an offset that changed");
    dependence("mean", points_to, output, &[sums.t()], significance, given.policy)
}
