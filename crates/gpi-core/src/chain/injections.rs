//! Where a change of each unknown enters the chain behind the hysteresis.

use crate::Matrix;
use crate::chain::hysteresis::{Derivatives, Sensitivity};
use crate::chain::point::{Layout, Point};
use crate::effects::{InnerLoop, Law, Place, Sees};
use std::ops::Range;

/// What was recorded of a block of samples, where in a column of signals.
pub(crate) struct Signals {
    /// v of each input, then its derivatives.
    pub columns: Vec<Range<usize>>,
    /// Derivatives of v by the values of each effect that reads the plays.
    pub readings: Vec<Range<usize>>,
    pub states: Range<usize>,
    /// w of each loop, then its stops.
    pub loops: Vec<Range<usize>>,
    pub len: usize,
}

/// Always 1.
pub(crate) const ONE: usize = 0;

/// Places in the chain, as rows of the work space of a tile.
pub(crate) struct Places {
    pub v: Range<usize>,
    pub y: Range<usize>,
    pub z: Range<usize>,
    pub w: Range<usize>,
    /// What is added to the next state.
    pub states: Range<usize>,
    /// The half-widths of each loop's stops.
    pub half_widths: Vec<Range<usize>>,
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
        let sizes = point.channels.iter().map(|c| Sensitivity::columns(c, wanted));
        let columns = sizes.map(&mut take).collect();
        let reading = point.play_curves().map(|curves| curves.values().len());
        let readings = reading.map(&mut take).collect();
        let states = take(point.dynamics.order());
        let loops = point.loops().map(|inner| take(1 + inner.law.stops())).collect();
        Self { columns, readings, states, loops, len }
    }
}

impl Places {
    pub(crate) fn new(point: &Point) -> Self {
        let mut len = 0;
        let mut take = |count: usize| {
            len += count;
            len - count..len
        };
        let loops = point.loops().count();
        let (v, y) = (take(point.channels.len()), take(point.dynamics.outputs()));
        let (z, w) = (take(loops), take(loops));
        let states = take(point.dynamics.order());
        let half_widths = point.loops().map(|inner| take(inner.law.stops())).collect();
        Self { v, y, z, w, states, half_widths, len }
    }
}

/// The injections of all unknowns of an experiment, in the order of the unknowns. Those that are added behind the
/// output stage have none.
pub(crate) fn injections(
    point: &Point,
    layout: &Layout,
    experiment: usize,
    signals: &Signals,
    places: &Places,
) -> Vec<Injection> {
    let mut gathered = Gathered { found: Vec::new(), signals, places };
    for (input, columns) in signals.columns.iter().enumerate() {
        // the order in which the sensitivities are streamed
        let mut column = columns.start + 1;
        for unknowns in [
            &layout.weights[input],
            &layout.slopes[input],
            &layout.thresholds[input],
            &layout.half_widths[input],
            &layout.plays[experiment][input],
        ] {
            for unknown in unknowns.clone() {
                gathered.add(unknown, places.v.start + input, column, 1.0);
                column += 1;
            }
        }
        // no unknowns where the start is known, but the columns are there
        debug_assert!(column <= columns.end);
    }
    gathered.add_sections(point, layout);
    let outputs = point.dynamics.outputs();
    for (column, unknown) in layout.feedthrough.iter().enumerate() {
        if let &Some(unknown) = unknown {
            let v = gathered.v(column / outputs);
            gathered.add(unknown, places.y.start + column % outputs, v, 1.0);
        }
    }
    let (mut number, mut readings) = (0, signals.readings.iter());
    for (effect, unknowns) in point.effects.iter().zip(&layout.effects) {
        match effect.place() {
            Place::Curves(own) => {
                let columns = readings.next().cloned().unwrap_or_default();
                for (unknown, column) in unknowns.clone().zip(columns) {
                    gathered.add(unknown, places.v.start + own.input(), column, 1.0);
                }
            }
            Place::Loops(own) => {
                let mut first = unknowns.start;
                for inner in own.loops() {
                    first = gathered.add_loop(inner, number, first);
                    number += 1;
                }
            }
            _ => {}
        }
    }
    let mut found = gathered.found;
    found.sort_by_key(|injection| injection.unknown);
    found
}

struct Gathered<'a> {
    found: Vec<Injection>,
    signals: &'a Signals,
    places: &'a Places,
}

impl Gathered<'_> {
    fn add(&mut self, unknown: usize, place: usize, signal: usize, factor: f64) {
        self.found.push(Injection { unknown, place, signal, factor });
    }

    /// The signal v of an input.
    fn v(&self, input: usize) -> usize {
        self.signals.columns[input].start
    }

    fn add_sections(&mut self, point: &Point, layout: &Layout) {
        let outputs = point.dynamics.outputs();
        let (states, y) = (self.places.states.start, self.places.y.start);
        let mut first = 0;
        for (section, unknowns) in point.dynamics.sections.iter().zip(&layout.sections) {
            let order = section.order();
            // What the held DC gains take back through D; what stands beside G is no part of them.
            let held = point.dynamics.held.iter().map(|held| held.0).enumerate();
            let held: Vec<(usize, usize)> = held.filter(|_| section.beside.is_none()).collect();
            let standing = section.standing(&section.b);
            let gain = &section.c * section.standing(&Matrix::identity(order, order));
            let x = self.signals.states.start + first;
            for (j, unknown) in unknowns.a.clone().enumerate() {
                self.add(unknown, states + first + j, x, -1.0);
                for &(input, output) in &held {
                    let still = gain[(output, j)] * standing[(0, input)];
                    self.add(unknown, y + output, self.v(input), still);
                }
            }
            for (place, unknown) in unknowns.b.clone().enumerate() {
                let (input, j) = (place / order, place % order);
                self.add(unknown, states + first + j, self.v(input), 1.0);
                for &(input, output) in held.iter().filter(|held| held.0 == input) {
                    self.add(unknown, y + output, self.v(input), -gain[(output, j)]);
                }
            }
            for (place, unknown) in unknowns.c.clone().enumerate() {
                let (output, j) = (place % outputs, place / outputs);
                self.add(unknown, y + output, x + j, 1.0);
                for &(input, output) in held.iter().filter(|held| held.1 == output) {
                    self.add(unknown, y + output, self.v(input), -standing[(j, input)]);
                }
            }
            first += order;
        }
    }

    /// The values of a loop, in their order from an unknown on; returns the next unknown.
    fn add_loop(&mut self, inner: &InnerLoop, number: usize, first: usize) -> usize {
        let (places, signals) = (self.places, self.signals);
        let own = signals.loops[number].clone();
        let mut unknown = first;
        let mut add = |place: usize, signal: usize, factor: f64| {
            self.found.push(Injection { unknown, place, signal, factor });
            unknown += 1;
        };
        for j in 0..inner.drives.len() {
            add(places.states.start + j, own.start, 1.0);
        }
        if let Sees::Mixture { states, inputs } = &inner.sees {
            for j in 0..states.len() {
                add(places.z.start + number, signals.states.start + j, 1.0);
            }
            for input in 0..inputs.len() {
                add(places.z.start + number, signals.columns[input].start, 1.0);
            }
        }
        if let Law::Stops { half_widths, weights } = &inner.law {
            for (stop, r) in half_widths.iter().enumerate() {
                // by its logarithm
                add(places.half_widths[number].start + stop, ONE, *r);
            }
            for stop in 0..weights.len() {
                add(places.w.start + number, own.start + 1 + stop, 1.0);
            }
        }
        unknown
    }
}
