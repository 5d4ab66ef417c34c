//! Isolated wrong samples.

use super::chance::at_least;
use super::{Beside, ResidualTest};
use crate::uncertainty::outliers;

/// How many samples stand apart from their neighbours by more than six robust standard deviations.
pub(super) fn wrong_samples(beside: &Beside, output: usize) -> ResidualTest {
    /// The chance of a normal number beyond six standard deviations.
    const SIX: f64 = 2e-9;
    /// More than chance, but too few to look for a cause.
    const ALLOWED: f64 = 2.0;
    let places = outliers::places(beside.residuals, beside.record, 0);
    let count: usize = places.iter().map(|experiment| experiment[output].len()).sum();
    ResidualTest {
        name: "outliers",
        output,
        statistic: count as f64,
        threshold: ALLOWED,
        p_value: at_least(count, SIX * beside.record.scored() as f64),
        points_to: "outliers",
    }
}
