//! What every unknown is called in results: one rule for each group.
//!
//! A group of a matrix is stored by columns, so that the place of a value within its group splits by the remainder:
//! b_ji of a section of order n stands at `n i + j`, c_oj with q outputs at `q j + o`, knot m of output o at
//! `knots o + m`. Sections in parallel with G are numbered behind those of G, in the order of the chain. Thresholds are
//! numbered by their rank, because the point puts the threshold 0 first and the model sorts them.

use super::group::Group;
use super::point::Point;
use super::table::Table;
use crate::Record;
use crate::effects::Units;

impl Table {
    /// A name for every unknown, such as `u.weights[3]`. Play weights, deadzone weights, thresholds and half-widths
    /// are numbered as in the model, experiments and knots from 0.
    pub(crate) fn names(&self, point: &Point, record: &Record) -> Vec<String> {
        let named = |(group, range): (Group, std::ops::Range<usize>)| {
            range.clone().map(move |i| name(group, i - range.start, point, record))
        };
        self.rows().flat_map(named).collect()
    }
}

impl Table {
    /// The unit of every unknown, empty for a pure number or where it is unknown, and whether zero means absence.
    pub(crate) fn described(&self, point: &Point, record: &Record) -> Vec<(String, bool)> {
        let of = |(group, range): (Group, std::ops::Range<usize>)| {
            range.clone().map(move |i| described(group, i - range.start, point, record))
        };
        self.rows().flat_map(of).collect()
    }
}

/// The envelope and the plays are in the input's unit; the play weights bring them to that of the only output. G is scaled
/// to unit DC gain.
fn described(group: Group, place: usize, point: &Point, record: &Record) -> (String, bool) {
    let u = |input: usize| record.inputs()[input].unit.clone();
    let y = |output: usize| record.outputs()[output].unit.clone();
    let outputs = record.outputs().len();
    match group {
        Group::Weights { input } if outputs == 1 => (Units::ratio(&y(0), &u(input)), true),
        Group::HalfWidths { input } | Group::Thresholds { input } => (u(input), false),
        Group::Offsets { experiment } => {
            let knots = point.offsets[experiment].nrows();
            (y(place / knots), false)
        }
        Group::Weights { .. }
        | Group::Slopes { .. }
        | Group::Numerator { .. }
        | Group::ParallelNumerator { .. }
        | Group::Feedthrough { .. } => (String::new(), true),
        Group::Denominator { .. }
        | Group::ParallelDenominator { .. }
        | Group::Observer { .. }
        | Group::Effect { .. }
        | Group::Plays { .. }
        | Group::Gaps { .. }
        | Group::State { .. } => (String::new(), false),
    }
}

/// The name of the value at a place of a group.
fn name(group: Group, place: usize, point: &Point, record: &Record) -> String {
    let u = |input: usize| &record.inputs()[input].name;
    let y = |output: usize| &record.outputs()[output].name;
    // the model's deadzones stand in the order of their thresholds
    let rank = |input: usize| {
        let thresholds = &point.channels[input].thresholds;
        thresholds.iter().filter(|&&eta| eta < thresholds[place]).count()
    };
    let order = |section: usize| point.dynamics.sections[section].order();
    // sections in parallel with G are numbered after its own
    let number = |effect: usize, section: usize| {
        let parallel = point.effects[..effect].iter().filter_map(|e| e.place().parallel_sections());
        let before: usize = parallel.map(|own| own.sections(point.rate).len()).sum();
        point.dynamics.sections.len() + before + section
    };
    let outputs = point.dynamics.outputs();
    match group {
        Group::Weights { input } => format!("{}.weights[{place}]", u(input)),
        Group::HalfWidths { input } => format!("{}.half_widths[{place}]", u(input)),
        Group::Slopes { input } => format!("{}.deadzone_weights[{}]", u(input), rank(input)),
        Group::Thresholds { input } => format!("{}.thresholds[{}]", u(input), rank(input)),
        Group::Denominator { section } => format!("section[{section}].a{}", place + 1),
        Group::Numerator { section } => {
            let (input, state) = (place / order(section), place % order(section));
            format!("section[{section}].b{}[{}]", state + 1, u(input))
        }
        Group::Observer { section } => {
            format!("section[{section}].c{}[{}]", place / outputs + 1, y(place % outputs))
        }
        Group::ParallelDenominator { place: effect, section } => {
            format!("section[{}].a{}", number(effect, section), place + 1)
        }
        Group::ParallelNumerator { place: effect, section } => {
            let input = point.effects[effect].place().input().unwrap_or(0);
            format!("section[{}].b{}[{}]", number(effect, section), place + 1, u(input))
        }
        Group::Feedthrough { input, output } => {
            format!("feedthrough[{}, {}]", y(output), u(input))
        }
        Group::Effect { place: effect } => {
            format!("{}.value[{place}]", point.effects[effect].name())
        }
        Group::Offsets { experiment } => match point.offsets[experiment].nrows() {
            1 => format!("offset[{experiment}].{}", y(place)),
            knots => format!("offset[{experiment}].{}[{}]", y(place / knots), place % knots),
        },
        Group::Plays { experiment, input } => format!("start[{experiment}].{}[{place}]", u(input)),
        Group::Gaps { experiment } => {
            format!("start[{experiment}].gap[{}]", y(point.gapped()[place]))
        }
        Group::State { experiment } => format!("start[{experiment}].state[{place}]"),
    }
}
