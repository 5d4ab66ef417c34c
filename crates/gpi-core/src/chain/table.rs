//! The table of the unknowns: one row for each group, from which everything else follows.
//!
//! The groups of a [`Point`] stand in one fixed order ([`super::group`]). A step away from a point is a walk over the rows of the [`Table`].
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
//!
//! # Delta form
//!
//! Two coefficients of a polynomial `.. + p z + q` of poles near one hardly differ in what they do: of their derivatives, all but a part
//! of the size of `|pole - 1|` is common, and a Gram matrix, which squares that part, loses it to rounding. A table in delta form has the
//! coefficients of powers of z - 1 as its unknowns instead,
//!
//! ```text
//! p z + q = p (z - 1) + (p + q)       d/dp -> d/dp - d/dq       d/d(p + q) = d/dq
//! ```
//!
//! and the difference is taken where the change enters the chain ([`super::injections`]), before anything is rounded. Source: R. H.
//! Middleton and G. C. Goodwin, Digital Control and Estimation: A Unified Approach, 1990.
//!
//! # Whole states
//!
//! An unknown initial state is the difference of the state x at the end of the warm-up from what a steady state before the record has become
//! by then. With loops around G, this steady state is none, because nothing goes around them in it, and where G nearly integrates, it is
//! far away and depends strongly on the coefficients: a step of these would be a long way from linear. A solver therefore has x as a whole
//! among its unknowns there: coefficients change nothing of x, and behind a step the differences are set so that it is true
//! ([`Point::keep_whole_states`]).

use super::group::{Group, groups};
use super::point::{Freedom, Point};
use crate::Matrix;
use crate::optimize::{Bounds, Linearization};
use nalgebra::DVector;
use std::ops::Range;

/// The unknowns of a fit: the groups that are free, and where each stands in a step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    rows: Vec<(Group, Range<usize>)>,
    /// Whether loops are closed around G.
    has_loops: bool,
    /// Whether a gap may hold a reading.
    has_gaps: bool,
    /// Pairs of unknowns that are coefficients of powers of z - 1.
    pairs: Vec<[usize; 2]>,
    /// Whether unknown initial states are whole states.
    has_whole_states: bool,
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
        let (has_loops, has_gaps) = (point.loops().next().is_some(), !point.gapped().is_empty());
        let (pairs, has_whole_states) = (Vec::new(), false);
        Self { rows, has_loops, has_gaps, pairs, has_whole_states, len }
    }

    /// The same with unknowns as a solver needs them: in delta form, but for those that have a bound, and with whole states where loops
    /// are closed.
    pub(crate) fn for_solver(mut self, point: &Point, bounds: &Bounds) -> Self {
        let is_free = |&i: &usize| bounds.lower[i].is_infinite() && bounds.upper[i].is_infinite();
        let rows = self.rows.iter();
        let pairs = rows.flat_map(|(group, range)| group.pairs(point, range.start));
        self.pairs = pairs.filter(|pair| pair.iter().all(is_free)).collect();
        self.has_whole_states = self.has_loops;
        self
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
        let Self { has_loops, has_gaps, has_whole_states, .. } = *self;
        let own = |[p, q]: &[usize; 2]| {
            Some([places.binary_search(p).ok()?, places.binary_search(q).ok()?])
        };
        let pairs = self.pairs.iter().filter_map(own).collect();
        (Self { rows, has_loops, has_gaps, pairs, has_whole_states, len }, places)
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
            Some((Group::Offsets { .. }, _)) => true,
            Some((Group::Weights { .. }, _)) => !self.has_loops,
            Some((Group::State { .. }, _)) => !self.has_loops && !self.has_gaps,
            _ => false,
        }
    }

    /// Pairs of unknowns that are the coefficients p and p + q of `p z + q = p (z - 1) + (p + q)`.
    pub(crate) fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Whether the unknown initial states of experiments are whole states.
    pub(crate) fn has_whole_states(&self) -> bool {
        self.has_whole_states
    }

    /// The value of every unknown.
    pub(crate) fn values(&self, point: &Point) -> Vec<f64> {
        let mut values: Vec<f64> =
            self.rows.iter().flat_map(|(group, _)| group.read(point)).collect();
        self.pairs.iter().for_each(|&[p, q]| values[q] += values[p]);
        values
    }

    /// What some unknowns are multiplied by for the coefficients of powers of z.
    pub(crate) fn coefficients(&self, range: &Range<usize>) -> Matrix {
        let mut matrix = Matrix::identity(range.len(), range.len());
        for [p, q] in self.pairs.iter().filter(|[p, _]| range.contains(p)) {
            matrix[(q - range.start, p - range.start)] = -1.0;
        }
        matrix
    }

    /// A quadratic model in delta form as one of the coefficients of powers of z, and the table of these.
    pub(crate) fn undo_delta_form(mut self, model: &mut Linearization) -> Self {
        for [p, q] in self.pairs.drain(..) {
            model.gram.join(p, q);
            model.descent[p] += model.descent[q];
        }
        self
    }
}

impl Point {
    /// The point one step away.
    pub(crate) fn moved(&self, step: &DVector<f64>, table: &Table) -> Self {
        let mut moved = self.clone();
        let mut step = step.clone();
        table.pairs.iter().for_each(|&[p, q]| step[q] -= step[p]);
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
    use crate::chain::point::DynamicsFreedom;
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
        let bounds = Bounds::none(table.len);
        let table = table.for_solver(&point, &bounds);
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
        // a bound is one of the coefficients of powers of z
        let mut bounds = bounds;
        let [p, q] = table.pairs()[1];
        bounds.lower[q] = -0.3;
        let others = table.clone().for_solver(&point, &bounds);
        assert!(others.pairs().len() + 1 == wanted.len() && !others.pairs().contains(&[p, q]));
    }
}
