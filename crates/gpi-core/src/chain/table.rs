//! The table of the unknowns: one row for each group, from which everything else follows.
//!
//! The groups of a [`Point`] stand in one fixed order. A group knows how many values it has, reads them from a point
//! and writes them back; its bounds ([`super::bounds`]), its names ([`super::names`]) and the places of the chain where
//! its derivatives enter ([`super::injections`]) are each one `match` over [`Group`]. A step away from a point is
//! therefore a walk over the rows of the [`Table`].
//!
//! The unknown vector theta is the concatenation of the free groups in the order of `groups`: weights, slopes,
//! thresholds and half-widths of all inputs; a, b, c of the sections of G; a, b of parallel sections; free elements of
//! D; values of effects; offsets; starts of the plays and of gaps; initial states. A held group has no row. A held value of a free
//! group keeps its place in theta and is held by the bounds.
//!
//! A step s (unknowns) from a point theta is not always theta + s. With P the projection that `Group::add` and
//! `Point::moved` apply, `theta(s) = P(theta + s)`:
//!
//! - weights are cut off at zero;
//! - the change of a denominator is halved until the poles are inside the unit circle;
//! - after a change of G, D takes what keeps the DC gain of each column: `d_oi += g_i - G_oi(1)`.
//!
//! The first two act on steps beyond the bounds or the region of stability only. The third is smooth, and the
//! derivatives of [`super::injections`] contain it.

use super::hysteresis::Parameters;
use super::point::{DynamicsFreedom, Freedom, Point};
use crate::effects::{Coefficients, Drives};
use crate::linear::{Section, move_poles};
use nalgebra::DVector;
use std::ops::Range;

/// A group of parameters of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    /// Weights of the plays of an input.
    Weights {
        input: usize,
    },
    /// Slopes of the deadzones of an input.
    Slopes {
        input: usize,
    },
    Thresholds {
        input: usize,
    },
    HalfWidths {
        input: usize,
    },
    /// a of a section.
    Denominator {
        section: usize,
    },
    /// b of a section, (order, inputs) by columns.
    Numerator {
        section: usize,
    },
    /// c of a section, (outputs, order) by columns. The row of the reference output is held.
    Observer {
        section: usize,
    },
    /// a of a section of an effect in parallel with G.
    ParallelDenominator {
        place: usize,
        section: usize,
    },
    /// b of the same; one input drives it.
    ParallelNumerator {
        place: usize,
        section: usize,
    },
    /// One element of D.
    Feedthrough {
        input: usize,
        output: usize,
    },
    /// The values of an effect; effects that are sections have none here.
    Effect {
        place: usize,
    },
    /// The additive term of an experiment, (knots, outputs) by columns.
    Offsets {
        experiment: usize,
    },
    /// The initial places of the plays of an input in an experiment.
    Plays {
        experiment: usize,
        input: usize,
    },
    /// Where the readings of [`Point::gapped`] stand at first in an experiment.
    Gaps {
        experiment: usize,
    },
    /// The initial state of the sections in an experiment.
    State {
        experiment: usize,
    },
}

use Group::{
    Denominator, Effect, Feedthrough, Gaps, HalfWidths, Numerator, Observer, Offsets,
    ParallelDenominator, ParallelNumerator, Plays, Slopes, State, Thresholds, Weights,
};

/// The unknowns of a fit: the groups that are free, and where each stands in a step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    rows: Vec<(Group, Range<usize>)>,
    /// Whether loops are closed around G.
    has_loops: bool,
    /// Whether a gap may hold a reading.
    has_gaps: bool,
    /// Unknowns that are the coefficients of z^1 and z^0 of a polynomial of a section.
    pairs: Vec<[usize; 2]>,
    /// How many unknowns there are.
    pub len: usize,
}

impl Table {
    /// The groups of a point that `freedom` sets free.
    pub(crate) fn new(point: &Point, freedom: Freedom) -> Self {
        let mut len = 0;
        let free = groups(point).into_iter().filter(|group| group.is_free(point, freedom));
        let row = |group: Group| {
            let first = len;
            len += group.read(point).len();
            (group, first..len)
        };
        let rows: Vec<_> = free.map(row).collect();
        let pairs =
            rows.iter().flat_map(|(group, range)| group.pairs(point, range.start)).collect();
        let (has_loops, has_gaps) = (point.loops().next().is_some(), !point.gapped().is_empty());
        Self { rows, has_loops, has_gaps, pairs, len }
    }

    /// All rows in the order of the unknowns.
    pub(crate) fn rows(&self) -> impl Iterator<Item = (Group, Range<usize>)> {
        self.rows.iter().cloned()
    }

    /// Where a group stands; an empty range if it is held.
    pub(crate) fn range(&self, group: Group) -> Range<usize> {
        let found = self.rows.iter().find(|(own, _)| *own == group);
        found.map_or(0..0, |(_, range)| range.clone())
    }

    /// The table of the unknowns that the output of an experiment depends on, and their places in this one, ascending:
    /// all but the offsets and initial states of other experiments.
    pub(crate) fn of_experiment(&self, index: usize) -> (Self, Vec<usize>) {
        let (mut rows, mut places) = (Vec::new(), Vec::new());
        for (group, range) in self.rows.iter().filter(|(group, _)| group.is_of(index)) {
            rows.push((*group, places.len()..places.len() + range.len()));
            places.extend(range.clone());
        }
        let len = places.len();
        let Self { has_loops, has_gaps, .. } = *self;
        (Self { rows, has_loops, has_gaps, pairs: Vec::new(), len }, places)
    }

    /// The unknowns of each experiment that move no other one's output. The only experiment has none: nothing else
    /// shares the unknowns.
    pub(crate) fn own(&self) -> Vec<Vec<usize>> {
        let mut own: Vec<Vec<usize>> = Vec::new();
        for (group, range) in &self.rows {
            if let Some(experiment) = group.experiment() {
                own.resize(own.len().max(experiment + 1), Vec::new());
                own[experiment].extend(range.clone());
            }
        }
        if own.len() > 1 { own } else { Vec::new() }
    }

    /// The group of an unknown, and the unknown's place within it.
    pub(crate) fn at(&self, unknown: usize) -> Option<(Group, usize)> {
        let row = self.rows.partition_point(|(_, range)| range.end <= unknown);
        self.rows.get(row).map(|(group, range)| (*group, unknown - range.start))
    }

    /// Whether the output is linear in an unknown while all others are kept. That is exact without an output stage, and otherwise
    /// what the solver assumes when it leaves these unknowns undamped. v goes around loops, and so do the states. A gap hides an initial
    /// state that is small, and does not hide a larger one.
    pub(crate) fn is_linear(&self, unknown: usize) -> bool {
        match self.at(unknown) {
            Some((Offsets { .. }, _)) => true,
            Some((Weights { .. }, _)) => !self.has_loops,
            Some((State { .. }, _)) => !self.has_loops && !self.has_gaps,
            _ => false,
        }
    }

    /// Pairs of unknowns p and q of a polynomial `.. + p z + q`.
    pub(crate) fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// The value of every unknown.
    pub(crate) fn values(&self, point: &Point) -> Vec<f64> {
        self.rows.iter().flat_map(|(group, _)| group.read(point)).collect()
    }
}

/// All groups of a point.
fn groups(point: &Point) -> Vec<Group> {
    let (inputs, outputs) = (0..point.channels.len(), 0..point.dynamics.outputs());
    let experiments = 0..point.pasts.len();
    let mut all = Vec::new();
    all.extend(inputs.clone().map(|input| Weights { input }));
    all.extend(inputs.clone().map(|input| Slopes { input }));
    all.extend(inputs.clone().map(|input| Thresholds { input }));
    all.extend(inputs.clone().map(|input| HalfWidths { input }));
    for section in 0..point.dynamics.sections.len() {
        all.extend([Denominator { section }, Numerator { section }, Observer { section }]);
    }
    for place in 0..point.effects.len() {
        for section in 0..sections(point, place).len() {
            all.push(ParallelDenominator { place, section });
            all.push(ParallelNumerator { place, section });
        }
    }
    for input in inputs.clone() {
        all.extend(outputs.clone().map(|output| Feedthrough { input, output }));
    }
    all.extend((0..point.effects.len()).map(|place| Effect { place }));
    all.extend(experiments.clone().map(|experiment| Offsets { experiment }));
    for experiment in experiments.clone() {
        all.extend(inputs.clone().map(|input| Plays { experiment, input }));
    }
    all.extend(experiments.clone().map(|experiment| Gaps { experiment }));
    all.extend(experiments.map(|experiment| State { experiment }));
    all
}

/// The places of both states of each section of two poles, of sections of such orders from a place on.
fn paired(orders: impl IntoIterator<Item = usize>, first: usize) -> Vec<[usize; 2]> {
    let mut next = first;
    let mut pairs = Vec::new();
    for order in orders {
        if order == 2 {
            pairs.push([next, next + 1]);
        }
        next += order;
    }
    pairs
}

/// The sections of an effect.
fn sections(point: &Point, place: usize) -> Vec<Coefficients> {
    let own = point.effects[place].place().parallel_sections();
    own.map_or_else(Vec::new, |own| own.sections(point.rate))
}

impl Group {
    fn is_free(self, point: &Point, freedom: Freedom) -> bool {
        let Freedom { derivatives, dynamics, .. } = freedom;
        match self {
            Weights { .. } | Slopes { .. } | Offsets { .. } => true,
            Thresholds { .. } => derivatives.thresholds,
            HalfWidths { .. } => derivatives.half_widths,
            Denominator { .. } | ParallelDenominator { .. } => {
                dynamics == DynamicsFreedom::Everything
            }
            Numerator { .. } | ParallelNumerator { .. } => dynamics != DynamicsFreedom::Nothing,
            Observer { .. } => dynamics != DynamicsFreedom::Nothing && point.dynamics.outputs() > 1,
            // a held DC gain sets one element of the column, else the whole column is held
            Feedthrough { input, output } => {
                let held = point.dynamics.held[input];
                dynamics != DynamicsFreedom::Nothing && held.is_some_and(|held| held.0 != output)
            }
            Effect { place } => point.effects[place].place().parallel_sections().is_none(),
            Plays { experiment, .. } => {
                derivatives.starts && point.pasts[experiment].plays.is_some()
            }
            Gaps { experiment } => {
                let is_free = freedom.states && point.pasts[experiment].has_unknown_state;
                is_free && !point.gapped().is_empty()
            }
            State { experiment } => freedom.states && point.pasts[experiment].has_unknown_state,
        }
    }

    /// Those of its unknowns, counted from the first one's place, that are coefficients `.. + p z + q` of a section of two poles. In the
    /// observer form of the sections, so are what is driven of their states, and initial states.
    fn pairs(self, point: &Point, first: usize) -> Vec<[usize; 2]> {
        let of_g = || point.dynamics.sections.iter().map(Section::order);
        match self {
            Denominator { section } => paired([point.dynamics.sections[section].order()], first),
            Numerator { section } => {
                let section = &point.dynamics.sections[section];
                paired(section.b.column_iter().map(|_| section.order()), first)
            }
            ParallelDenominator { place, section } | ParallelNumerator { place, section } => {
                paired([sections(point, place)[section].0.len()], first)
            }
            Effect { place } => {
                let closed = point.effects[place].place().closed_loops();
                let loops = closed.map_or(&[][..], |closed| closed.loops());
                let mut first = first;
                let mut pairs = Vec::new();
                for inner in loops {
                    if let Drives::States(column) = &inner.drives {
                        let is_driven = |pair: &[usize; 2]| pair[1] < first + column.len();
                        pairs.extend(paired(of_g(), first).into_iter().filter(is_driven));
                    }
                    first += inner.linear_values() + inner.law.values();
                }
                pairs
            }
            State { .. } => paired(point.sections().iter().map(Section::order), first),
            _ => Vec::new(),
        }
    }

    /// The experiment whose output alone the group moves.
    fn experiment(self) -> Option<usize> {
        match self {
            Offsets { experiment }
            | Plays { experiment, .. }
            | Gaps { experiment }
            | State { experiment } => Some(experiment),
            _ => None,
        }
    }

    /// Whether the output of an experiment depends on the group.
    fn is_of(self, experiment: usize) -> bool {
        self.experiment().is_none_or(|own| own == experiment)
    }

    /// The values of the group in a point.
    pub(crate) fn read(self, point: &Point) -> Vec<f64> {
        match self {
            Weights { input } => point.channels[input].weights.clone(),
            Slopes { input } => point.channels[input].slopes.clone(),
            Thresholds { input } => point.channels[input].thresholds.clone(),
            HalfWidths { input } => point.channels[input].half_widths.clone(),
            Denominator { section } => point.dynamics.sections[section].a.clone(),
            Numerator { section } => point.dynamics.sections[section].b.as_slice().to_vec(),
            Observer { section } => point.dynamics.sections[section].c.as_slice().to_vec(),
            ParallelDenominator { place, section } => sections(point, place).swap_remove(section).0,
            ParallelNumerator { place, section } => sections(point, place).swap_remove(section).1,
            Feedthrough { input, output } => vec![point.dynamics.d[(output, input)]],
            Effect { place } => point.effects[place].values(),
            Offsets { experiment } => point.offsets[experiment].as_slice().to_vec(),
            Plays { experiment, input } => {
                let plays = point.pasts[experiment].plays.as_ref();
                plays.map_or_else(Vec::new, |plays| plays[input].clone())
            }
            Gaps { experiment } => {
                let gaps = &point.pasts[experiment].gaps;
                point.gapped().into_iter().map(|output| gaps[output]).collect()
            }
            State { experiment } => point.pasts[experiment].state.as_slice().to_vec(),
        }
    }

    /// Adds a change of the group's values to a point. Weights keep the sign of their elements; a section whose poles
    /// would leave the unit circle goes as far as they stay inside.
    fn add(self, point: &mut Point, change: &[f64]) {
        let add = |values: &mut [f64]| {
            values.iter_mut().zip(change).for_each(|(value, change)| *value += change);
        };
        match self {
            Weights { input } => {
                let Parameters { weights, elements, .. } = &mut point.channels[input];
                add(weights);
                for (place, weight) in weights.iter_mut().enumerate() {
                    *weight = elements.nearest(place, *weight);
                }
            }
            Slopes { input } => add(&mut point.channels[input].slopes),
            Thresholds { input } => add(&mut point.channels[input].thresholds),
            HalfWidths { input } => add(&mut point.channels[input].half_widths),
            Denominator { section } => move_poles(&mut point.dynamics.sections[section].a, change),
            Numerator { section } => add(point.dynamics.sections[section].b.as_mut_slice()),
            Observer { section } => add(point.dynamics.sections[section].c.as_mut_slice()),
            ParallelDenominator { place, section } => {
                point.change_sections(place, |all| move_poles(&mut all[section].0, change));
            }
            ParallelNumerator { place, section } => {
                point.change_sections(place, |all| add(&mut all[section].1));
            }
            Feedthrough { input, output } => point.dynamics.d[(output, input)] += change[0],
            Effect { place } => {
                let mut values = self.read(point);
                add(&mut values);
                point.effects[place].set(&values);
            }
            Offsets { experiment } => add(point.offsets[experiment].as_mut_slice()),
            Plays { experiment, input } => {
                let plays = point.pasts[experiment].plays.as_mut();
                plays.into_iter().for_each(|plays| add(&mut plays[input]));
            }
            Gaps { experiment } => {
                for (output, change) in point.gapped().into_iter().zip(change) {
                    point.pasts[experiment].gaps[output] += change;
                }
            }
            State { experiment } => add(point.pasts[experiment].state.as_mut_slice()),
        }
    }

    /// Whether G depends on the group, so that its held DC gain has to be restored after a step.
    fn is_dynamics(self) -> bool {
        matches!(self, Denominator { .. } | Numerator { .. } | Observer { .. } | Feedthrough { .. })
    }
}

impl Point {
    /// The point one step away.
    pub(crate) fn moved(&self, step: &DVector<f64>, table: &Table) -> Self {
        let mut moved = self.clone();
        for (group, range) in table.rows() {
            group.add(&mut moved, &step.as_slice()[range]);
        }
        if table.rows().any(|(group, _)| group.is_dynamics()) {
            moved.dynamics.hold_gain();
        }
        moved.bound_limits();
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{model, record, run};
    use crate::chain::sensitivity::Derivatives;
    use crate::fit::preparation::Prepared;

    #[test]
    fn the_coefficients_of_two_poles_are_pairs() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.3, 0, vec![])]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::scoring_all(&record, channels).unwrap();
        let point = prepared.point_of(&model).unwrap();
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives: Derivatives { thresholds: true, half_widths: true, starts: true },
            states: true,
            identity: true,
            dynamics: DynamicsFreedom::Everything,
        };
        let table = Table::new(&point, freedom);
        let names = table.names(&point, &record);
        let found: Vec<String> =
            table.pairs().iter().map(|[p, q]| format!("{} {}", names[*p], names[*q])).collect();
        // two poles and one; of eight loops, one drives where the input does
        let drives = [0, 12, 15, 23, 26, 30, 34];
        let drives = drives.map(|i| format!("stiffness.value[{i}] stiffness.value[{}]", i + 1));
        let mut wanted = vec![
            "section[0].a1 section[0].a2".to_owned(),
            "section[0].b1[u0] section[0].b2[u0]".to_owned(),
            "section[0].b1[u1] section[0].b2[u1]".to_owned(),
        ];
        wanted.extend(drives);
        wanted.push("start[0].state[0] start[0].state[1]".to_owned());
        assert_eq!(found, wanted);
    }
}
