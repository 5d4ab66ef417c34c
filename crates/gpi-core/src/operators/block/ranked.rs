//! The half-widths of a bank in ascending order, with cumulative sums.

use super::curve::Curve;

/// Plays in ascending order of half-widths.
pub(super) struct Ranked {
    /// Index in the bank of each play.
    pub order: Vec<usize>,
    /// r, ascending.
    pub half_widths: Vec<f64>,
    /// Cumulative sums of p, starting with the sum of no play.
    pub weights: Vec<f64>,
    /// Cumulative sums of p r, starting with the sum of no play.
    pub moments: Vec<f64>,
    /// `sum_i p_i max(x - r_i, 0)`.
    curve: Curve,
}

impl Ranked {
    pub(super) fn new(half_widths: &[f64], weights: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..half_widths.len()).collect();
        order.sort_by(|&i, &j| half_widths[i].total_cmp(&half_widths[j]));
        let sorted: Vec<f64> = order.iter().map(|&i| half_widths[i]).collect();
        let moments = sums(order.iter().map(|&i| weights[i] * half_widths[i]));
        let weights = sums(order.iter().map(|&i| weights[i]));
        let lines = weights.iter().zip(&moments).map(|(&weight, &moment)| (weight, -moment));
        Self {
            curve: Curve::new(sorted.clone(), lines.collect()),
            weights,
            moments,
            half_widths: sorted,
            order,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// The number of half-widths at or below x.
    #[inline(always)]
    pub(super) fn at_most(&self, x: f64) -> usize {
        self.curve.at_most(x)
    }

    /// `sum_i p_i max(x - r_i, 0)`.
    #[inline(always)]
    pub(super) fn beyond(&self, x: f64) -> f64 {
        self.curve.at(x)
    }
}

/// Cumulative sums, starting with the sum of no term.
pub(super) fn sums(terms: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    let later = terms.map(|term| {
        sum += term;
        sum
    });
    std::iter::once(0.0).chain(later).collect()
}
