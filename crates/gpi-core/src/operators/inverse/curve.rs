//! A sum of one-sided deadzones as a piecewise linear curve.

use crate::operators::storage::sort_by_key;
use crate::operators::{Deadzones, Operator, Sample, Storage};

/// `height_j + slope_j (z - knot_j)`, where j is the last knot at or below z; below all knots, j is the first knot with
/// the slope [`Curve::below`]. The search among n knots takes log2 n comparisons; the sum of deadzones has n terms.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve<S: Storage> {
    knots: S,
    heights: S,
    slopes: S,
    below: S::Item,
}

impl<S: Storage> Curve<S> {
    /// The curve of one-sided deadzones.
    pub(super) fn new(zones: &Deadzones<S>) -> Self {
        let zero = S::Item::ZERO;
        let (mut knots, mut weights) = (zones.thresholds.clone(), zones.weights.clone());
        sort_by_key(&mut knots, [&mut weights]);
        let below = knots.values().iter().zip(weights.values());
        let below = below.fold(zero, |sum, (&eta, &g)| if eta <= zero { sum + g } else { sum });
        let (mut heights, mut slopes, mut slope) = (knots.clone(), weights.clone(), below);
        let rows = heights.values_mut().iter_mut().zip(slopes.values_mut());
        for ((height, own), &eta) in rows.zip(knots.values()) {
            *height = zones.step(&mut zones.rest(), eta);
            // beyond a threshold, the upper deadzone contributes and the lower one no longer does
            if eta > zero {
                slope = slope + *own;
            } else if eta < zero {
                slope = slope - *own;
            }
            *own = slope;
        }
        Self { knots, heights, slopes, below }
    }

    /// The knots in ascending order, in the unit of z.
    pub fn knots(&self) -> &[S::Item] {
        self.knots.values()
    }

    /// The value at each knot.
    pub fn heights(&self) -> &[S::Item] {
        self.heights.values()
    }

    /// The slope above each knot.
    pub fn slopes(&self) -> &[S::Item] {
        self.slopes.values()
    }

    /// The slope below the first knot.
    pub fn below(&self) -> S::Item {
        self.below
    }

    /// The value at z.
    #[inline]
    pub fn at(&self, z: S::Item) -> S::Item {
        let passed = self.knots().partition_point(|&knot| knot <= z);
        let last = passed.saturating_sub(1);
        let piece =
            self.knots().get(last).zip(self.heights().get(last)).zip(self.slopes().get(last));
        piece.map_or(z, |((&knot, &height), &slope)| {
            height + if passed == 0 { self.below } else { slope } * (z - knot)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::Reading;

    #[test]
    fn as_the_sum_of_deadzones() {
        let thresholds = [2.0, -1.0, 0.0, 0.5, -3.0, 2.0, 0.0];
        let weights = [0.3, 0.2, 0.7, -0.4, 0.6, -0.1, 0.4];
        let zones = Deadzones::new(thresholds, weights, Reading::OneSided).unwrap();
        let curve = Curve::new(&zones);
        for k in -500..500 {
            let z = 0.01 * f64::from(k);
            let expected = zones.step(&mut zones.rest(), z);
            assert!((curve.at(z) - expected).abs() < 1e-14, "{z}");
        }
        assert_eq!((curve.knots()[0], curve.below()), (-3.0, 0.7 + 0.4 + 0.2 + 0.6));
        assert!((curve.slopes()[6] - 0.9).abs() < 1e-15);
        assert!(curve.at(f64::NAN).is_nan());
    }
}
