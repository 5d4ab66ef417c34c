//! What every effect that acts in the chain has: values that are estimated, and their meaning.

use super::quantity::{Quantity, Units};

/// An effect that acts in the signal chain. How it acts is said by the trait of its place, see
/// [`Place`](super::Place).
pub trait Block {
    /// The estimated values. [`Block::quantities`] follow from them.
    fn values(&self) -> Vec<f64>;

    /// Takes other values, as many as [`Block::values`] returns.
    fn set(&mut self, values: &[f64]);

    /// Takes every second knot of a smooth curve through evenly spaced knots; `false` if there is no such
    /// curve, or an odd number of knots after the first.
    fn coarsen(&mut self) -> bool {
        false
    }

    /// Smallest and largest sensible value of each.
    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(f64::NEG_INFINITY, f64::INFINITY); self.values().len()]
    }

    /// A small change of each value, over which the output changes linearly.
    fn steps(&self) -> Vec<f64>;

    /// The parameters as an engineer reads them, with their units.
    fn quantities(&self, units: Units) -> Vec<Quantity>;

    /// Why these parameters are invalid although all values are finite; `None` where they are valid.
    fn flaw(&self) -> Option<String> {
        None
    }

    /// Whether any machine can have these values. What is not possible is never named.
    fn is_possible(&self) -> bool {
        true
    }

    /// Whether a machine can have these values and a record of `duration` seconds can show them.
    fn is_plausible(&self, _duration: f64) -> bool {
        true
    }

    /// Forgets in which state the record began that it was fitted to: another record begins in another one.
    fn forget_start(&mut self) {}

    /// Drops the terms of a sum that make these values implausible; `false` if there are none, or if no term would be left.
    fn drop_implausible(&mut self, _duration: f64) -> bool {
        false
    }
}
