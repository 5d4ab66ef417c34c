//! Isolated wrong samples.
//!
//! Of K scored samples of Gaussian noise, `2e-9 K` lie beyond six standard deviations, so that the count is Poisson
//! with that mean. The threshold is a number of samples, not a probability: one or two wrong samples of a record need
//! no cause.

use super::compared::Compared;
use super::outcome::{ResidualTest, points_to};
use crate::uncertainty::outliers;

const NAME: &str = "outliers";

/// How many samples stand apart from their neighbours by more than six robust standard deviations.
pub(super) fn wrong_samples(given: &Compared, output: usize) -> ResidualTest {
    let places = outliers::places(given.residuals, given.record, 0);
    let count: usize = places.iter().map(|experiment| experiment[output].len()).sum();
    ResidualTest {
        name: NAME,
        output,
        statistic: count as f64,
        threshold: given.policy.wrong_samples,
        // so few are allowed for their number, not for their probability
        significance: None,
        points_to: points_to(NAME, ""),
    }
}
