//! Derivatives by all unknowns, taken through G, its loops and the output stage side by side (forward mode).
//!
//! For one unknown theta, write d for the derivative by it. The chain behind the hysteresis, linearized along its
//! motion, is a linear system that the injections i of [`super::injections`] drive:
//!
//! ```text
//! dv(k)   = i_v                                        (inputs)
//! dy(k)   = C dx + D dv + i_y                          (outputs)
//! dz(k)   = S dx + T dv + i_z                          (loops)
//! dw(k)   = law'(k) (dz, dr) + i_w                     (loops)
//! dx(k+1) = A dx + B dv + E dw + i_x                   (N)
//! dreading(k) = M(k) dy                                (outputs)
//! ```
//!
//! Where loops take several steps a sample, z and w have one row for each loop in each step, and dz also has a part of v at the next
//! sample and of dw in the steps before ([`super::between`]). law'(k) and M(k) are known from the pass forward: slopes of powers, which plays of stops slide, derivatives of a step
//! of Bouc and Wen's force ([`super::loops`]), slopes of the output stage ([`super::sensing`]). dr are the injections at
//! the half-widths of stops, at beta, gamma and n. At the first
//! sample the state is the steady state of its injections, `dx = (I - A)^-1 (B dv + i_x)`, because the chain was at
//! rest at its first v before the record. These injections are those of the steady state, `x = (I - A)^-1 B v` and w = 0, and not those
//! of the first sample, where an unknown part of the initial state may have been added to x and w may not be zero. The unknown part
//! enters as `dx_j += 1` at the end of the warm-up.
//!
//! Rows of C and S are read together, columns of B and E driven one after the other ([`Weights`]). Eight unknowns are
//! one [`Tile`]: each number above is a vector of eight, so that the coefficients are loaded once for all of them. One
//! pass over K samples costs about `K N (outputs + inputs + 2 loops + 1)` multiplications for each unknown, which is
//! one simulation of the linear part; all unknowns cost as many simulations as there are unknowns, divided by the eight
//! lanes and by the cores. In return, every row `dreading(k)` is known, which Gauss-Newton and covariances need. Where
//! only the gradient is needed, [`super::adjoint`] costs one simulation in total.
//!
//! States below [`FADED`] are set to zero at the end of a block.

use super::between::{Between, Row};
use super::group::Group;
use super::injections::{Places, Signals, injections};
use super::lanes::{LANES, NONE, Weights, add};
use super::motion::{advance_tangent, columns, rows};
use super::point::Point;
use super::table::Table;
use super::tiles::{Entry, Shape, Tile, tiles};
use crate::effects::{InnerLoop, OutputStage, Sees, Slope};
use crate::linear::Section;
use crate::parallel::install;
use crate::{Experiment, Matrix};
use pulp::Simd;
use rayon::prelude::*;
use std::ops::Range;

/// What has decayed so far in a state is nothing.
const FADED: f64 = 1e-100;

/// What the derivatives need of a pass through the chain, for a block of samples.
pub(crate) struct Trace {
    /// Samples of the experiment.
    pub samples: Range<usize>,
    /// Columns of signals, one a sample.
    pub signals: Vec<f64>,
    /// The column of the steady state before the first sample, in which nothing goes around loops; empty in later blocks.
    pub standing: Vec<f64>,
    /// How changes pass each loop's law, loops one after the other, by samples.
    pub marks: Vec<f64>,
    /// How changes pass the effects of the output stage, by samples.
    pub slopes: Vec<Slope>,
    /// The samples that are scored, from the first one of the block.
    pub scored: Vec<usize>,
}

/// Everything linear that a change runs through.
pub(crate) struct Tangents<'a> {
    sections: Vec<Section>,
    /// Rows of C, then of S of all loops.
    seen: Weights,
    /// Columns of B and of E.
    driven: Weights,
    circulating: Weights,
    d: &'a Matrix,
    loops: Vec<&'a InnerLoop>,
    between: Between,
    /// The output that each effect of the output stage acts on.
    sensed: Vec<usize>,
    signals: Signals,
    places: Places,
    /// The sample before which the unknown part of the initial state is added, and whether what was before it is forgotten.
    warmup: usize,
    forgets: bool,
    tiles: Vec<Tile>,
}

impl<'a> Tangents<'a> {
    pub(crate) fn new(
        point: &'a Point,
        table: &Table,
        signals: Signals,
        experiment: &Experiment,
        index: usize,
    ) -> Self {
        let places = Places::new(point);
        let (dynamics, sections) = (&point.dynamics, point.sections());
        let loops: Vec<&InnerLoop> = point.loops().collect();
        let sensed = sensed(point);
        let injections = injections(point, table, index, &signals, &places);
        let starts = starts(table, index);
        let shape =
            Shape { places: &places, sections: &sections, loops: &loops, sensed: sensed.len() };
        let tiles = tiles(&shape, injections, &starts, table.len);
        let between = Between::of_sections(dynamics, loops.iter().copied(), point.intersample);
        let order = point.order();
        let c = rows(&sections, dynamics.outputs());
        let mut seen = c.clone();
        // sections in parallel with G stand still between samples
        seen.extend(between.seen.iter().zip(loops.iter().cycle()).map(|(row, inner)| {
            let mut all = padded(&row.states, order);
            if let Sees::Output(output) = inner.sees {
                let own = row.states.len();
                all[own..].copy_from_slice(&c[output][own..]);
            }
            all
        }));
        let b = columns(&sections, dynamics.inputs());
        let drives: Vec<Vec<f64>> =
            between.drives.iter().map(|drives| padded(drives, order)).collect();
        Self {
            seen: Weights::new(&seen),
            driven: Weights::new(&b),
            circulating: Weights::new(&drives),
            d: &dynamics.d,
            loops,
            between,
            tiles,
            sensed,
            signals,
            places,
            warmup: experiment.warmup,
            forgets: forgets(point, table, index),
            sections,
        }
    }

    pub(crate) fn signals(&self) -> &Signals {
        &self.signals
    }

    /// Takes all changes through a block; adds those of the scored samples to `regressors`, for each
    /// output (unknowns, samples).
    pub(crate) fn run(&mut self, trace: &Trace, regressors: &mut [Matrix]) {
        /// Work, in tiles times samples times states, that pays for a second thread.
        const PARALLEL: usize = 200_000;
        let mut tiles = std::mem::take(&mut self.tiles);
        let this = &*self;
        let advance = |tile: &mut Tile| {
            pulp::Arch::new().dispatch(Advance { tangents: this, tile, trace });
        };
        if tiles.len() * trace.samples.len() * self.places.len > PARALLEL {
            install(|| tiles.par_iter_mut().for_each(advance));
        } else {
            tiles.iter_mut().for_each(advance);
        }
        for tile in &tiles {
            for (regressor, rows) in regressors.iter_mut().zip(&tile.rows) {
                let count = LANES.min(regressor.nrows() - tile.first);
                for (mut column, row) in regressor.column_iter_mut().zip(rows) {
                    column.as_mut_slice()[tile.first..tile.first + count]
                        .copy_from_slice(&row[..count]);
                }
            }
        }
        self.tiles = tiles;
    }

    /// One tile through a block.
    #[inline(always)]
    fn advance<S: Simd>(&self, simd: S, tile: &mut Tile, trace: &Trace) {
        let Places { v, next, y, z, w, states, shapes, .. } = &self.places;
        let seen = y.start..z.end;
        let memories = memories(&self.loops);
        let mut scored = trace.scored.iter().peekable();
        tile.rows.iter_mut().for_each(Vec::clear);
        let marks = trace.marks.len() / trace.samples.len();
        for k in 0..trace.samples.len() {
            let signals = &trace.signals[k * self.signals.len..(k + 1) * self.signals.len];
            let sample = trace.samples.start + k;
            if sample == 0 {
                inject(simd, tile, &trace.standing);
                self.stand(tile);
            }
            inject(simd, tile, signals);
            if sample == self.warmup {
                if self.forgets {
                    tile.x.fill(NONE);
                }
                let starts = tile.starts.iter();
                starts.for_each(|&(lane, state, change)| tile.x[state][lane] += change);
            }
            let work = &mut tile.work[..];
            let x = &tile.x[tile.states.clone()];
            self.seen.gather(simd, &mut work[seen.clone()], tile.states.start, x);
            if tile.drives {
                for output in 0..y.len() {
                    for input in v.clone() {
                        let (factor, change) = (self.d[(output, input - v.start)], work[input]);
                        add(simd, &mut work[y.start + output], factor, &change);
                    }
                }
            }
            let mut marks = &trace.marks[k * marks..(k + 1) * marks];
            for (step, row) in self.between.seen.iter().enumerate() {
                let number = step % self.loops.len();
                let law = &self.loops[number].law;
                let Row { inputs, next: ahead, earlier, .. } = row;
                let mut sum = work[z.start + step];
                if tile.drives {
                    let seen = inputs.iter().zip(&work[v.clone()]);
                    for (factor, change) in seen.chain(ahead.iter().zip(&work[next.clone()])) {
                        add(simd, &mut sum, *factor, change);
                    }
                }
                for (factor, change) in earlier.iter().zip(&work[w.clone()]) {
                    add(simd, &mut sum, *factor, change);
                }
                let (own, others) = marks.split_at(law.marks());
                let places = &mut tile.plays[memories[number].clone()];
                let shapes = &work[shapes[number].clone()];
                let around = law.tangent(simd, sum, shapes, own, places);
                add(simd, &mut work[w.start + step], 1.0, &around);
                marks = others;
            }
            let scores = scored.next_if(|&&scored| scored == k).is_some();
            if scores || !self.sensed.is_empty() {
                let slopes = &trace.slopes[k * self.sensed.len()..(k + 1) * self.sensed.len()];
                for ((&output, slope), held) in self.sensed.iter().zip(slopes).zip(&mut tile.held) {
                    let row = &mut work[y.start + output];
                    slope.tangent(row, held);
                }
            }
            if scores {
                let rows = tile.rows.iter_mut().zip(&work[y.clone()]);
                rows.for_each(|(rows, row)| rows.push(*row));
            }
            let (before, rest) = work.split_at_mut(states.start);
            let driven = &mut rest[..states.len()];
            if tile.drives {
                self.driven.scatter(simd, driven, &before[v.clone()]);
            }
            self.circulating.scatter(simd, driven, &before[w.clone()]);
            let mut first = tile.states.start;
            for section in &self.sections[tile.sections.clone()] {
                let order = section.order();
                let next = &work[states.start + first..states.start + first + order];
                advance_tangent(simd, &section.a, &mut tile.x[first..first + order], next);
                first += order;
            }
        }
        // denormal numbers would take a hundred times as long, here and in the products of the rows
        let faded = tile.x.iter_mut().flatten().filter(|value| value.abs() < FADED);
        faded.for_each(|value| *value = 0.0);
    }

    /// The steady state for what is injected at the first sample.
    #[inline(always)]
    fn stand(&self, tile: &mut Tile) {
        let Places { v, states, .. } = &self.places;
        let mut first = 0;
        for section in &self.sections {
            let order = section.order();
            let drive = Matrix::from_fn(order, LANES, |j, lane| {
                let driven = v.clone().enumerate();
                let driven =
                    driven.map(|(column, place)| section.b[(j, column)] * tile.work[place][lane]);
                tile.work[states.start + first + j][lane] + driven.sum::<f64>()
            });
            let standing = section.standing(&drive);
            for j in 0..order {
                tile.x[first + j] = std::array::from_fn(|lane| standing[(j, lane)]);
            }
            first += order;
        }
    }
}

/// What the unknowns of a tile add at their places, and nothing else there.
#[inline(always)]
fn inject<S: Simd>(simd: S, tile: &mut Tile, signals: &[f64]) {
    tile.work.fill(NONE);
    for Entry { place, signals: own, factors } in &tile.entries {
        let change = std::array::from_fn(|lane| factors[lane] * signals[own[lane]]);
        add(simd, &mut tile.work[*place], 1.0, &change);
    }
}

/// A tile and a block, for the widest vectors that the processor has.
struct Advance<'a, 'b> {
    tangents: &'a Tangents<'b>,
    tile: &'a mut Tile,
    trace: &'a Trace,
}

impl pulp::WithSimd for Advance<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tangents, tile, trace } = self;
        tangents.advance(simd, tile, trace);
    }
}

/// Whether the state of an experiment at the end of its warm-up is an unknown as a whole, and depends on no other unknown.
pub(super) fn forgets(point: &Point, table: &Table, experiment: usize) -> bool {
    table.has_whole_states() && point.pasts[experiment].has_unknown_state
}

/// Changes of the state of an experiment at the end of its warm-up: the unknown, the state and its change.
pub(super) fn starts(table: &Table, experiment: usize) -> Vec<(usize, usize, f64)> {
    let own = table.range(Group::State { experiment });
    let mut starts: Vec<_> = own.clone().zip(0..).map(|(unknown, j)| (unknown, j, 1.0)).collect();
    let pairs = table.pairs().iter().filter(|[p, _]| own.contains(p));
    starts.extend(pairs.map(|&[p, q]| (p, q - own.start, -1.0)));
    starts
}

/// The output that each effect of the output stage acts on, in the order in which they act.
pub(super) fn sensed(point: &Point) -> Vec<usize> {
    let mut sensed: Vec<usize> = point.output_stages().map(OutputStage::output).collect();
    sensed.sort_unstable();
    sensed
}

/// Where the memory of each loop stands among those of all.
pub(super) fn memories(loops: &[&InnerLoop]) -> Vec<Range<usize>> {
    let mut last = 0;
    let own = loops.iter().map(|inner| {
        last += inner.law.memories();
        last - inner.law.memories()..last
    });
    own.collect()
}

/// Values for the states of G, with zeros for those of sections in parallel.
fn padded(values: &[f64], order: usize) -> Vec<f64> {
    let mut all = values.to_vec();
    all.resize(order, 0.0);
    all
}
