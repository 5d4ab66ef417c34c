//! What a step may be: one rule for each group of unknowns.
//!
//! The limits are those of the change s of each unknown and contain zero. For a value theta with neighbours theta_- and
//! theta_+, sorted, and the range [low, high] of the input u:
//!
//! | group | limits of theta + s |
//! |---|---|
//! | weight of a play | at least 0 |
//! | threshold | same side of zero; [`INSIDE`] of the range away from zero and from low and high; [`REACH`] of the gap to a neighbour |
//! | half-width | [`REACH`] of the gap to a neighbour, on both sides; the widest: of the gap below |
//! | start of a play | -1 to 1 |
//! | values of an effect, a_1 of its first-order sections | those that the effect gives |
//! | everything else | free |
//!
//! Scales that the output does not determine are held. v does not change if slopes and half-widths are multiplied by a
//! factor and the weights are divided by it. The slope of the identity fixes that factor; where it is free, the
//! half-width of the widest play that has a weight does. The row of C of the reference output fixes the scale of a
//! section's states; the half-width zero and the threshold zero are the linear terms and never move.

use super::point::{Freedom, Point};
use super::table::{Group, Table};
use crate::Record;
use crate::effects::Block;
use crate::optimize::Bounds;

/// What a value may change by.
type Limits = (f64, f64);

const HELD: Limits = (0.0, 0.0);
const FREE: Limits = (f64::NEG_INFINITY, f64::INFINITY);

/// Fraction of a gap to a neighbour that one step may take: below one half, so that two neighbours that move towards
/// each other in the same step do not pass.
const REACH: f64 = 0.4;
/// Fraction of the input's range that a threshold keeps from its ends, so that samples lie on both sides of it.
const INSIDE: f64 = 0.01;

impl Point {
    /// The bounds of a step: weights stay positive, plays stay at z plus or minus their half-width, thresholds on
    /// their side of zero and inside the range of u, half-widths in order.
    pub(crate) fn bounds(&self, table: &Table, record: &Record, freedom: Freedom) -> Bounds {
        let mut bounds = Bounds::none(table.len);
        for (group, range) in table.rows() {
            let limits = self.limits(group, record, freedom);
            for (i, (low, high)) in range.zip(limits) {
                (bounds.lower[i], bounds.upper[i]) = (low.min(0.0), high.max(0.0));
            }
        }
        bounds
    }

    fn limits(&self, group: Group, record: &Record, freedom: Freedom) -> Vec<Limits> {
        let values = group.read(self);
        let held = |condition: bool| if condition { HELD } else { FREE };
        match group {
            Group::Weights { .. } | Group::Slopes { .. } | Group::Offsets { .. }
                if !freedom.weights =>
            {
                vec![HELD; values.len()]
            }
            Group::Weights { .. } => values.iter().map(|weight| (-weight, f64::INFINITY)).collect(),
            Group::Slopes { input } => {
                let is_held = !freedom.identity || self.widest_used(input) == 0;
                (0..values.len()).map(|place| held(place == 0 && is_held)).collect()
            }
            Group::Thresholds { input } => thresholds(&values, range(record, input)),
            Group::HalfWidths { input } => {
                // the widest play that moves sets the scale of z, where the identity does not
                let widest = if freedom.identity { self.widest_used(input) } else { values.len() };
                half_widths(&values, widest)
            }
            Group::Effect { place } => {
                let bounds = self.effects[place].block().map_or_else(Vec::new, Block::bounds);
                let limits = bounds.into_iter().zip(values);
                let limits = limits.map(|((low, high), value)| (low - value, high - value));
                limits.map(|limits| if freedom.weights { limits } else { HELD }).collect()
            }
            Group::ParallelDenominator { place, .. } => match values[..] {
                [a1] => {
                    let own = self.effects[place].place().parallel_sections();
                    let (low, high) = own.map_or(FREE, |own| own.section_bounds(self.rate));
                    vec![(low - a1, high - a1)]
                }
                _ => vec![FREE; values.len()],
            },
            Group::Observer { section } => {
                let reference = self.dynamics.sections[section].reference;
                let output = |place: usize| place % self.dynamics.outputs();
                (0..values.len()).map(|place| held(output(place) == reference)).collect()
            }
            Group::Plays { .. } => {
                // a play of half-width zero has no side
                let side = |(place, side): (usize, &f64)| {
                    if place == 0 { HELD } else { (-1.0 - side, 1.0 - side) }
                };
                values.iter().enumerate().map(side).collect()
            }
            Group::Denominator { .. }
            | Group::Numerator { .. }
            | Group::ParallelNumerator { .. }
            | Group::Feedthrough { .. }
            | Group::Offsets { .. }
            | Group::State { .. } => vec![FREE; values.len()],
        }
    }

    /// How far each unknown can be from its value, whatever the data say; infinite for most. A half-width or a threshold is
    /// known to lie between its neighbours, because the others would take its place there.
    pub(crate) fn spacings(&self, table: &Table) -> Vec<f64> {
        let mut spacings = vec![f64::INFINITY; table.len];
        for (group, range) in table.rows() {
            if let Group::HalfWidths { .. } | Group::Thresholds { .. } = group {
                let values = group.read(self);
                let gap = |place: usize| (values[place] - values[place - 1]).abs();
                for place in 1..values.len() {
                    // the last has a neighbour on one side only
                    let next = if place + 1 < values.len() { gap(place + 1) } else { 0.0 };
                    spacings[range.start + place] = gap(place).max(next);
                }
            }
        }
        spacings
    }

    /// The place of the widest play with a weight.
    fn widest_used(&self, input: usize) -> usize {
        self.channels[input].weights.iter().rposition(|&weight| weight > 0.0).unwrap_or(0)
    }
}

/// The first threshold, zero, is held. The nearest that the others may come to: zero, the ends of the range, their
/// neighbours.
fn thresholds(etas: &[f64], (low, high): (f64, f64)) -> Vec<Limits> {
    let inside = INSIDE * (high - low);
    let limits = |(place, &eta): (usize, &f64)| {
        if place == 0 {
            return HELD;
        }
        let (below, above) = if eta > 0.0 {
            (low.max(0.0) + inside, high - inside)
        } else {
            (low + inside, high.min(0.0) - inside)
        };
        let previous = if place > 1 { etas[place - 1] } else { f64::NEG_INFINITY };
        let next = etas.get(place + 1).copied().unwrap_or(f64::INFINITY);
        let below = below.max(eta + REACH * (previous - eta));
        let above = above.min(eta + REACH * (next - eta));
        (below - eta, above - eta)
    };
    etas.iter().enumerate().map(limits).collect()
}

/// The first half-width, zero, is held, and so are those from the place `widest` on.
fn half_widths(widths: &[f64], widest: usize) -> Vec<Limits> {
    let limits = |place: usize| {
        if place == 0 || place >= widest {
            return HELD;
        }
        let below = widths[place] - widths[place - 1];
        let above = widths.get(place + 1).map_or(below, |next| next - widths[place]);
        (-REACH * below, REACH * above)
    };
    (0..widths.len()).map(limits).collect()
}

/// Smallest and largest input of all experiments.
pub(crate) fn range(record: &Record, input: usize) -> (f64, f64) {
    let columns = record.experiments().iter().map(|e| e.input.column(input));
    columns.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), column| {
        (low.min(column.min()), high.max(column.max()))
    })
}
