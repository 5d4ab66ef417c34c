//! What a step may be: one rule for each group of unknowns.
//!
//! The limits are those of the change s of each unknown and contain zero. For a value theta with neighbours theta_- and
//! theta_+, sorted, and the range [low, high] of the input u:
//!
//! | group | limits of theta + s |
//! |---|---|
//! | weight of a play | at least 0; at most [`STEEPEST`] times the mean slope of v over z, less for a play that slides over less than [`RARE`] of the movement |
//! | slope behind a threshold | up or down at most [`STEEPEST`] times the mean slope of z over u where less than [`RARE`] of the path of u lies behind the threshold, less where it is less |
//! | threshold | same side of zero; [`INSIDE`] of the range away from zero and from low and high; [`SHOWN`] of the path of u behind it; [`REACH`] of the gap to a neighbour |
//! | half-width | [`REACH`] of the gap to a neighbour, on both sides; the widest: of the gap below |
//! | start of a play | -1 to 1 |
//! | values of an effect, a_1 of its first-order sections | those that the effect gives |
//! | everything else | free |
//!
//! The bounds on weights and slopes stand for what is known of any actuator. A play that hardly moves in the record, or a
//! segment of the envelope in which u hardly is, may otherwise get a slope of any size: it imitates a drift or an outlier
//! there, and the model is far off on the next record.
//!
//! Scales that the output does not determine are held. v does not change if slopes and half-widths are multiplied by a
//! factor and the weights are divided by it. The slope of the identity fixes that factor; where it is free, the
//! half-width of the widest play that has a weight does. The row of C of the reference output fixes the scale of a
//! section's states; the half-width zero and the threshold zero are the linear terms and never move.

use super::group::Group;
use super::hysteresis::Elements;
use super::movement::{Path, scored};
use super::point::{Freedom, Point};
use super::table::Table;
use crate::Record;
use crate::effects::Block;
use crate::linear::LARGEST_POLE;
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
/// Part of the path of the input that must lie behind a threshold: of some thousand samples, a few.
const SHOWN: f64 = 1e-3;
/// Largest weight of a play over the mean slope of v over z, `sum_i w_i (1 - 2 r_i / Z)` where z moves by Z. It is reached by an
/// actuator that consists of this play alone, if its gap takes 80 % of the movement of z.
const STEEPEST: f64 = 5.0;
/// Part of the path of u behind a threshold, or of the movement of z over which a play slides, from which a slope may be
/// steep. By hand: less is seen at the ends of the movement only.
const RARE: f64 = 0.05;

/// The largest slope of a part of the hysteresis, divided by the mean slope. It rises from 1 at `shown = 0`, where the record
/// does not show the part, to [`STEEPEST`] at `shown = 1` and above.
fn steepness(shown: f64) -> f64 {
    let shown = if shown > 0.0 { shown.min(1.0) } else { 0.0 };
    1.0 + (STEEPEST - 1.0) * shown
}

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
            Group::Weights { .. } | Group::Slopes { .. } if !freedom.weights => {
                vec![HELD; values.len()]
            }
            Group::Offsets { .. } => vec![held(!freedom.offsets); values.len()],
            Group::Weights { input } => {
                let moved = self.envelope_span(record, input);
                let widths = &self.channels[input].half_widths;
                let slides = |r: f64| 1.0 - 2.0 * r / moved;
                let elements = self.channels[input].elements;
                let v: f64 = match elements {
                    Elements::Plays => {
                        values.iter().zip(widths).map(|(w, &r)| w * slides(r).max(0.0)).sum()
                    }
                    // behind a reversal, where all stops move
                    Elements::Stops => values[0],
                };
                // nothing is known of a bank without any weight
                let mean = if v > 0.0 { v } else { f64::INFINITY };
                let most = |r: f64| mean * steepness(slides(r) / RARE);
                let limits = |(place, (&weight, &r)): (usize, (&f64, &f64))| {
                    let ends = [-1.0, 1.0].map(|end| elements.nearest(place, end * most(r)));
                    (ends[0] - weight, ends[1] - weight)
                };
                let mut limits: Vec<Limits> =
                    values.iter().zip(widths).enumerate().map(limits).collect();
                if self.dynamics.held[input].is_none() {
                    // it sets the scale of v
                    limits[0] = HELD;
                }
                limits
            }
            Group::Slopes { input } => {
                let is_held = !freedom.identity || self.widest_used(input) == 0;
                let path = Path::of(record, input);
                let mean = self.envelope_span(record, input) / path.span();
                let etas = &self.channels[input].thresholds;
                let limits = |(place, &slope): (usize, &f64)| match path.behind(etas[place]) {
                    _ if place == 0 => held(is_held),
                    part if part < RARE => {
                        let most = mean * steepness(part / RARE);
                        (-most - slope, most - slope)
                    }
                    _ => FREE,
                };
                values.iter().enumerate().map(limits).collect()
            }
            Group::Thresholds { input } if self.channels[input].prior.slopes > 0.0 => {
                vec![HELD; values.len()]
            }
            Group::Thresholds { input } => {
                let visited = Path::of(record, input).visited(SHOWN);
                thresholds(&values, range(record, input), visited)
            }
            Group::HalfWidths { input } if self.channels[input].prior.weights > 0.0 => {
                vec![HELD; values.len()]
            }
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
            Group::Gaps { .. } => values.iter().map(|side| (-1.0 - side, 1.0 - side)).collect(),
            // a pole that integrates stands at the unit circle; others are kept inside by their step
            Group::Denominator { section }
                if values.len() == 1 && self.dynamics.sections[section].growth > 1.0 =>
            {
                vec![(-LARGEST_POLE - values[0], LARGEST_POLE - values[0])]
            }
            Group::Denominator { .. }
            | Group::Numerator { .. }
            | Group::ParallelNumerator { .. }
            | Group::Feedthrough { .. }
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

    /// Largest minus smallest z.
    fn envelope_span(&self, record: &Record, input: usize) -> f64 {
        let u = scored(record, |e| &e.input, input).flatten();
        let (low, high) = self.channels[input].envelope_range(u);
        high - low
    }

    /// The place of the widest play with a weight.
    fn widest_used(&self, input: usize) -> usize {
        self.channels[input].weights.iter().rposition(|&weight| weight != 0.0).unwrap_or(0)
    }
}

/// The first threshold, zero, is held. The nearest that the others may come to: zero, the ends of the range, their
/// neighbours.
fn thresholds(etas: &[f64], (low, high): (f64, f64), (least, most): (f64, f64)) -> Vec<Limits> {
    let inside = INSIDE * (high - low);
    let (low, high) = (low.max(least - inside), high.min(most + inside));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Intersample;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::point::{DynamicsFreedom, Past};
    use crate::chain::sensitivity::Derivatives;
    use crate::linear::Sections;
    use crate::operators::Reading;
    use crate::{Channel, Experiment, Matrix};

    /// A drive between -1 and 1 with one visit of 1.5, and an output of twice its size.
    fn record() -> Record {
        let visit = |k: usize| if k == 700 { 1.5 } else { (0.05 * k as f64).sin() };
        let u = Matrix::from_fn(200_000, 1, |k, _| visit(k));
        let channel = |name| vec![Channel::new(name, "")];
        let run = vec![Experiment::new(u.clone(), 2.0 * u)];
        Record::new(run, 1.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    fn limits(point: &Point, group: Group) -> Vec<Limits> {
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives: Derivatives::default(),
            states: false,
            identity: false,
            dynamics: DynamicsFreedom::Nothing,
        };
        point.limits(group, &record(), freedom)
    }

    fn point(thresholds: Vec<f64>, half_widths: Vec<f64>) -> Point {
        let channel = Parameters::identity(Reading::OneSided, thresholds, half_widths);
        Point {
            pasts: vec![Past::rest(0, 1)],
            channels: vec![channel],
            dynamics: Sections::delayed_gain(&Matrix::from_element(1, 1, 1.0), 0),
            intersample: Intersample::default(),
            effects: Vec::new(),
            rate: 1.0,
            offsets: vec![Matrix::zeros(1, 1)],
        }
    }

    #[test]
    fn a_slope_where_the_input_hardly_is_stays_small() {
        let point = point(vec![0.5, 1.2], vec![0.0]);
        let slopes = limits(&point, Group::Slopes { input: 0 });
        assert_eq!(slopes[..2], [HELD, FREE]);
        let (down, up) = slopes[2];
        assert!(down == -up && (1.0..1.05).contains(&up), "{slopes:?}");
        let thresholds = limits(&point, Group::Thresholds { input: 0 });
        // a threshold beyond moves back only, and none comes there
        assert!(thresholds[2].1 <= 0.0 && 0.5 + thresholds[1].1 < 1.0, "{thresholds:?}");
    }

    #[test]
    fn no_play_is_much_steeper_than_the_stage() {
        // z moves by 2.5, and so does v
        let point = point(vec![], vec![0.0, 0.5, 1.2, 1.25, 1.3]);
        let limits = limits(&point, Group::Weights { input: 0 });
        let most: Vec<f64> =
            limits.iter().zip(&point.channels[0].weights).map(|((_, high), w)| w + high).collect();
        let expected = [5.0, 5.0, 1.0 + 4.0 * 0.1 / (2.5 * 0.05), 1.0, 1.0];
        for (found, expected) in most.iter().zip(expected) {
            assert!((found - expected).abs() < 0.01, "{most:?}");
        }
    }
}
