//! Where a change of each unknown enters the chain behind the hysteresis.
//!
//! An unknown theta changes the equation of a few places by `f s(k)` for each unit: s(k) is a recorded signal, f a
//! constant. With the equations `y = C x + D v`, `z = S x + T v`, `w = law(z, r)`, `x+ = A x + B v + E w`:
//!
//! | unknown | place | signal s | factor f |
//! |---|---|---|---|
//! | p_i, g_j, eta_j, r_i, start of a play | v of its input | dv/dtheta ([`super::sensitivity`]) | 1 |
//! | values of a curve through which plays are read | v of its input | dv/dtheta | 1 |
//! | a_j of a section | x_j | x_1 of the section | -1 |
//! | b_ji | x_j | v_i | 1 |
//! | c_oj | y_o | x_j | 1 |
//! | d_oi | y_o | v_i | 1 |
//! | a_j, b_ji, c_oj, d_oi, and E_j, S_j, T_i or the force of a loop | z and x_j, in each step | x_j, v_i, w | see `around_loops` |
//! | ln r of a stop | half-width | 1 | r |
//! | beta, gamma, n of Bouc and Wen's force, a limit | itself | 1 | 1 |
//! | ln d of Dahl's friction, ln of the scale of a damping | itself | 1 | itself |
//! | weight of a stop | w | z - F, the stop | 1 |
//!
//! A is in observer form, so that a_j multiplies the first state only: `dA/da_j = -e_j e_1'`.
//!
//! # The held DC gain
//!
//! Where the DC gain of a column is held, one element of that column of D is no unknown: `d_oi = g_i - sum_s c_o (I - A_s)^-1 b_i` keeps the DC gain g_i from
//! input i to the output o at which it is held. A change of a section therefore changes D as well, which is an
//! injection of v_i at y_o. With the steady state `q = (I - A)^-1 b_i` (order) and `h = c_o (I - A)^-1` (order) of the
//! section,
//!
//! ```text
//! dd_oi/da_j  =  h_j q_1        from  d (I - A)^-1 = (I - A)^-1 dA (I - A)^-1
//! dd_oi/db_ji = -h_j
//! dd_oi/dc_oj = -q_j
//! ```
//!
//! In delta form ([`super::table`]), the first unknown of a pair adds what it did and takes back what the second one adds.
//!
//! Sections in parallel with G have no held gain. Offsets and what is added behind the output stage have no place here
//! (`Stream::added` gives their derivatives), nor have initial states, which start as a unit of one state.

use super::around_loops::AroundLoops;
use super::between::Between;
use super::group::Group;
use super::loops::loops_of;
use super::point::Point;
use super::sensitivity::{Columns, Derivatives};
use super::table::Table;
use crate::Matrix;
use crate::effects::{InnerLoop, Law, Place};
use crate::linear::Section;
use std::ops::Range;

/// What was recorded of a block of samples, where in a column of signals.
pub(crate) struct Signals {
    /// v of each input, then its derivatives.
    pub columns: Vec<Range<usize>>,
    /// Where in the columns of an input its derivatives stand.
    pub hysteresis: Vec<Columns>,
    /// Derivatives of v by the values of each effect that reads the plays.
    pub readings: Vec<Range<usize>>,
    /// By how much later the same of v at the next sample stands, where loops look ahead.
    pub ahead: Option<usize>,
    pub states: Range<usize>,
    /// In each step: w of each loop, then its stops.
    pub loops: Vec<Range<usize>>,
    pub len: usize,
}

/// Always 1.
pub(crate) const ONE: usize = 0;

/// Places in the chain, as rows of the work space of a tile.
pub(crate) struct Places {
    pub v: Range<usize>,
    /// v at the next sample.
    pub next: Range<usize>,
    pub y: Range<usize>,
    /// Of each loop in each step, as is w.
    pub z: Range<usize>,
    pub w: Range<usize>,
    /// What is added to the next state.
    pub states: Range<usize>,
    /// The values of each loop's law to which w does not respond linearly.
    pub shapes: Vec<Range<usize>>,
    pub len: usize,
}

/// `factor` times a signal is added at a place when an unknown changes by one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Injection {
    pub unknown: usize,
    pub place: usize,
    pub signal: usize,
    pub factor: f64,
}

impl Signals {
    pub(crate) fn new(point: &Point, wanted: Derivatives) -> Self {
        let mut len = ONE + 1;
        let mut take = |count: usize| {
            len += count;
            len - count..len
        };
        let hysteresis: Vec<Columns> =
            point.channels.iter().map(|channel| Columns::new(channel, wanted)).collect();
        let columns = hysteresis.iter().map(|own| take(own.len)).collect();
        let reading = point.play_curves().map(|curves| curves.values().len());
        let readings: Vec<Range<usize>> = reading.map(&mut take).collect();
        let looks_ahead = point.loops().next().is_some() && point.intersample.looks_ahead();
        let once = hysteresis.iter().map(|own| own.len).sum::<usize>()
            + readings.iter().map(ExactSizeIterator::len).sum::<usize>();
        let ahead = looks_ahead.then(|| take(once).len());
        let states = take(point.order());
        let mut loops = Vec::new();
        for _ in 0..point.intersample.substeps {
            loops.extend(point.loops().map(|inner| take(1 + inner.law.weights())));
        }
        Self { columns, hysteresis, readings, ahead, states, loops, len }
    }
}

impl Places {
    pub(crate) fn new(point: &Point) -> Self {
        let mut len = 0;
        let mut take = |count: usize| {
            len += count;
            len - count..len
        };
        let loops = point.loops().count() * point.intersample.substeps;
        let inputs = point.channels.len();
        let (v, next, y) = (take(inputs), take(inputs), take(point.dynamics.outputs()));
        let (z, w) = (take(loops), take(loops));
        let states = take(point.order());
        let shapes = point.loops().map(|inner| take(inner.law.shapes())).collect();
        Self { v, next, y, z, w, states, shapes, len }
    }
}

/// The injections of all unknowns of an experiment, in the order of the unknowns. Those that are added behind the
/// output stage have none, nor do initial states, which are no signal.
pub(crate) fn injections(
    point: &Point,
    table: &Table,
    experiment: usize,
    signals: &Signals,
    places: &Places,
) -> Vec<Injection> {
    let around = AroundLoops::new(point);
    let mut entries = Entries { found: Vec::new(), point, signals, places };
    for (group, unknowns) in table.rows() {
        entries.of(group, unknowns.clone(), experiment);
        for (unknown, changes) in unknowns.zip(around.by(group)) {
            entries.around(unknown, &changes);
        }
    }
    let mut found = entries.found;
    for &[p, q] in table.pairs() {
        let of_q = found.iter().filter(|one| one.unknown == q);
        let against: Vec<Injection> =
            of_q.map(|one| Injection { unknown: p, factor: -one.factor, ..*one }).collect();
        found.extend(against);
    }
    // tiles take them in the order of the unknowns
    found.sort_by_key(|one| one.unknown);
    found
}

struct Entries<'a> {
    found: Vec<Injection>,
    point: &'a Point,
    signals: &'a Signals,
    places: &'a Places,
}

impl Entries<'_> {
    fn add(&mut self, unknown: usize, place: usize, signal: usize, factor: f64) {
        self.found.push(Injection { unknown, place, signal, factor });
    }

    /// The signal v of an input.
    fn v(&self, input: usize) -> usize {
        self.signals.columns[input].start
    }

    fn of(&mut self, group: Group, unknowns: Range<usize>, experiment: usize) {
        match group {
            Group::Weights { input } => self.hysteresis(input, unknowns, |c| &c.weights),
            Group::Slopes { input } => self.hysteresis(input, unknowns, |c| &c.slopes),
            Group::Thresholds { input } => self.hysteresis(input, unknowns, |c| &c.thresholds),
            Group::HalfWidths { input } => self.hysteresis(input, unknowns, |c| &c.half_widths),
            Group::Plays { experiment: own, input } if own == experiment => {
                self.hysteresis(input, unknowns, |c| &c.starts);
            }
            Group::Denominator { section } => self.denominator(section, unknowns),
            Group::Numerator { section } => self.numerator(section, unknowns),
            Group::Observer { section } => self.observer(section, unknowns),
            Group::ParallelDenominator { place, section } => {
                let (first, _) = self.parallel(place, section);
                let (state, place) = (self.signals.states.start, self.places.states.start);
                for (j, unknown) in unknowns.enumerate() {
                    self.add(unknown, place + first + j, state + first, -1.0);
                }
            }
            Group::ParallelNumerator { place, section } => {
                let (first, input) = self.parallel(place, section);
                let (v, place) = (self.v(input), self.places.states.start);
                for (j, unknown) in unknowns.enumerate() {
                    self.add(unknown, place + first + j, v, 1.0);
                }
            }
            Group::Feedthrough { input, output } => {
                self.add(unknowns.start, self.places.y.start + output, self.v(input), 1.0);
            }
            Group::Effect { place } => self.effect(place, unknowns),
            Group::Plays { .. }
            | Group::Gaps { .. }
            | Group::Offsets { .. }
            | Group::State { .. } => {}
        }
    }

    /// The derivatives of v by a group of a hysteresis are signals.
    fn hysteresis(
        &mut self,
        input: usize,
        unknowns: Range<usize>,
        own: fn(&Columns) -> &Range<usize>,
    ) {
        let first = self.v(input) + own(&self.signals.hysteresis[input]).start;
        for (unknown, signal) in unknowns.zip(first..) {
            self.enter(unknown, input, signal);
        }
    }

    /// A derivative of v enters at its own sample, and at the next one where loops look ahead.
    fn enter(&mut self, unknown: usize, input: usize, signal: usize) {
        self.add(unknown, self.places.v.start + input, signal, 1.0);
        if let Some(ahead) = self.signals.ahead {
            self.add(unknown, self.places.next.start + input, signal + ahead, 1.0);
        }
    }

    /// The first state of an effect's section, and the input that drives it.
    fn parallel(&self, place: usize, section: usize) -> (usize, usize) {
        let effect = self.point.effects[place].place();
        let sections = effect.parallel_sections().map(|own| own.sections(self.point.rate));
        let before = sections.iter().flatten().take(section).map(|(a, _)| a.len()).sum::<usize>();
        (self.point.states_before(place) + before, effect.input().unwrap_or(0))
    }

    /// The first state of a section of G, and what the held DC gains take back through D: input, output, the steady
    /// states for an input of one (order, inputs), and the DC gains from its states (outputs, order).
    fn section(&self, section: usize) -> (usize, Vec<(usize, usize)>, Matrix, Matrix) {
        let dynamics = &self.point.dynamics;
        let own = &dynamics.sections[section];
        let first = dynamics.sections[..section].iter().map(Section::order).sum();
        let held = dynamics.held.iter().enumerate();
        let held = held.filter_map(|(input, held)| Some((input, (*held)?.0))).collect();
        let gain = &own.c * own.steady(&Matrix::identity(own.order(), own.order()));
        (first, held, own.steady(&own.b), gain)
    }

    fn denominator(&mut self, section: usize, unknowns: Range<usize>) {
        let (first, held, standing, gain) = self.section(section);
        let (y, states) = (self.places.y.start, self.places.states.start + first);
        for (j, unknown) in unknowns.enumerate() {
            self.add(unknown, states + j, self.signals.states.start + first, -1.0);
            for &(input, output) in &held {
                let still = gain[(output, j)] * standing[(0, input)];
                self.add(unknown, y + output, self.v(input), still);
            }
        }
    }

    fn numerator(&mut self, section: usize, unknowns: Range<usize>) {
        let (first, held, standing, gain) = self.section(section);
        let (y, states) = (self.places.y.start, self.places.states.start + first);
        for (place, unknown) in unknowns.enumerate() {
            let (input, j) = (place / standing.nrows(), place % standing.nrows());
            self.add(unknown, states + j, self.v(input), 1.0);
            for &(input, output) in held.iter().filter(|held| held.0 == input) {
                self.add(unknown, y + output, self.v(input), -gain[(output, j)]);
            }
        }
    }

    fn observer(&mut self, section: usize, unknowns: Range<usize>) {
        let (first, held, standing, gain) = self.section(section);
        let y = self.places.y.start;
        for (place, unknown) in unknowns.enumerate() {
            let (output, j) = (place % gain.nrows(), place / gain.nrows());
            self.add(unknown, y + output, self.signals.states.start + first + j, 1.0);
            for &(input, output) in held.iter().filter(|held| held.1 == output) {
                self.add(unknown, y + output, self.v(input), -standing[(j, input)]);
            }
        }
    }

    fn effect(&mut self, place: usize, unknowns: Range<usize>) {
        let before = &self.point.effects[..place];
        match self.point.effects[place].place() {
            Place::Curves(curves) => {
                let others = before.iter().filter_map(|effect| effect.place().play_curves());
                let number = others.count();
                for (unknown, signal) in unknowns.zip(self.signals.readings[number].clone()) {
                    self.enter(unknown, curves.input(), signal);
                }
            }
            Place::Loops(closed) => {
                let mut first = unknowns.start;
                for (inner, number) in closed.loops().iter().zip(loops_of(before).count()..) {
                    first += inner.linear_values();
                    first = self.law(inner, number, first);
                }
            }
            _ => {}
        }
    }

    /// The values of a loop's law, in their order from an unknown on; returns the next unknown.
    fn law(&mut self, inner: &InnerLoop, number: usize, first: usize) -> usize {
        let (places, signals) = (self.places, self.signals);
        let shapes = places.shapes[number].clone();
        let factors = match &inner.law {
            Law::Power { .. } | Law::Speed => Vec::new(),
            // by their logarithms
            Law::Dahl { distance: scale, .. } | Law::Damping { scale } => vec![*scale],
            Law::Stops { half_widths, .. } => half_widths.clone(),
            Law::BoucWen { .. } | Law::Excess { .. } => vec![1.0; shapes.len()],
        };
        let mut unknown = first;
        for (place, factor) in shapes.zip(factors) {
            self.add(unknown, place, ONE, factor);
            unknown += 1;
        }
        let loops = self.point.loops().count();
        for stop in 0..inner.law.weights() {
            for step in (number..places.w.len()).step_by(loops) {
                self.add(unknown, places.w.start + step, signals.loops[step].start + 1 + stop, 1.0);
            }
            unknown += 1;
        }
        unknown
    }

    /// What an unknown changes of what loops see and drive.
    fn around(&mut self, unknown: usize, changes: &Between) {
        let (places, signals) = (self.places, self.signals);
        let v: Vec<usize> = signals.columns.iter().map(|own| own.start).collect();
        let mut add = |place: usize, signal: usize, factor: f64| {
            if factor != 0.0 {
                self.found.push(Injection { unknown, place, signal, factor });
            }
        };
        for (step, (row, drives)) in changes.seen.iter().zip(&changes.drives).enumerate() {
            let z = places.z.start + step;
            for (state, factor) in row.states.iter().enumerate() {
                add(z, signals.states.start + state, *factor);
            }
            for (v, factor) in v.iter().zip(&row.inputs) {
                add(z, *v, *factor);
            }
            for (v, factor) in v.iter().zip(&row.next) {
                add(z, v + signals.ahead.unwrap_or(0), *factor);
            }
            for (own, factor) in signals.loops.iter().zip(&row.earlier) {
                add(z, own.start, *factor);
            }
            for (state, factor) in drives.iter().enumerate() {
                add(places.states.start + state, signals.loops[step].start, *factor);
            }
        }
    }
}
