//! The gradient of the cost by all unknowns at once: one pass through an experiment, and one back.
//!
//! With the residuals `e = y_measured - y`, weighted by `W(e)` ([`Loss`]), the cost J has the gradient
//! `-1/2 dJ/dtheta = sum_k (dy(k)/dtheta)' W e(k)`. The forward pass stores what the linearized chain needs: signals,
//! marks of loops, slopes of the output stage ([`Trace`]). At each sample a change passes through the chain in this
//! order ([`super::tangents`]), where i are the injections at each place and M is the tangent of the output stage:
//!
//! ```text
//! 0.  dv  = i_v
//! 1.  dx  = (I - A)^-1 (B dv + i_x)                   at the first sample only
//! 2.  dx += dx_0                                      at the end of the warm-up only
//! 3.  dy  = C dx + D dv + i_y
//! 4.  dz  = S dx + T dv + i_z
//! 5.  dw  = law'(dz, dr) + i_w
//! 6.  dreading = M dy
//! 7.  dx+ = A dx + B dv + E dw + i_x
//! ```
//!
//! Let a bar denote the derivative of `-J/2` by a quantity. The transposed steps, in the opposite order and from the
//! last sample to the first, with l = bar of dx(k+1) and l = 0 behind the last sample, are
//!
//! ```text
//! 6'  ybar  = M' W e(k)
//! 7'  xbar  = l,   vbar = B' l,   wbar = E' l,   l <- A' l
//! 5'  (zbar, rbar) = law'^T wbar                      rbar: half-widths of stops, beta, gamma, n
//! 4'  l    += S' zbar,   vbar += T' zbar
//! 3'  l    += C' ybar,   vbar += D' ybar
//! 2'  bar of x_0 = l                                  at the end of the warm-up only; then l = 0 if x is an unknown as a whole
//! 1'  m = (I - A)^-T l,   xbar += m,   vbar += B' m   at the first sample only
//! ```
//!
//! Where loops take several steps a sample, 5' and 4' run from the last of them to the first, and 4' also adds to the bars of
//! v at the next sample and of w in the steps before. An unknown that adds `f s(k)` at a place p has the gradient
//! `f sum_k s(k) pbar(k)`. The sums of all places with all signals are the products of two matrices, (places, samples) and (samples, signals), one for each block
//! ([`Back::met`]); the injections of [`super::injections`] then choose from (places, signals). Offsets and effects
//! whose derivatives are differences do not stream through the chain; their part is `sum_k (dy/dtheta) W e` directly.
//!
//! The price of the backward pass is a simulation plus that product, whatever the number of unknowns: steps 1' to 7'
//! have as many multiplications as 1 to 7 have for one unknown. The signals of the whole experiment are kept, so that
//! the memory is samples times signals. The result agrees with [`super::tangents`] up to rounding (a test in
//! `fit::problem` compares them). Source: A. Griewank and A. Walther, *Evaluating Derivatives*, 2008, chapter 3
//! (reverse mode).

use super::between::{Between, Row};
use super::injections::{Injection, Places, injections};
use super::motion::{advance_adjoint, columns, rows};
use super::point::{Freedom, Point};
use super::stream::Stream;
use super::table::Table;
use super::tangents::{Trace, forgets, memories, sensed, starts};
use crate::effects::{InnerLoop, Sees, Slope};
use crate::linear::{Section, dot};
use crate::optimize::Loss;
use crate::parallel::install;
use crate::{Error, Experiment, Matrix, Record};
use nalgebra::{DMatrixView, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Half the steepest descent of the cost of a record, `-1/2 dJ/dtheta` (unknowns), and the cost J.
///
/// Experiments are independent: each is passed forward and back on a core of its own, as many at once as there are cores,
/// because each keeps its traces. With Huber's loss the weight is that of the residual itself, so that the result is the
/// exact gradient and not that of reweighted squares.
pub(crate) fn descent(
    point: &Point,
    table: &Table,
    freedom: Freedom,
    loss: &Loss,
    record: &Record,
    check: &mut dyn FnMut() -> Result<(), Error>,
) -> Result<(DVector<f64>, f64), Error> {
    let mut sum = (DVector::zeros(table.len), 0.0);
    let all: Vec<(usize, &Experiment)> = record.experiments().iter().enumerate().collect();
    for some in all.chunks(install(rayon::current_num_threads)) {
        check()?;
        let of = |&(index, experiment): &(usize, &Experiment)| {
            descent_of(point, table, freedom, loss, experiment, index)
        };
        let found: Vec<_> = install(|| some.par_iter().map(of).collect());
        for one in found {
            let (descent, cost) = one?;
            sum = (sum.0 + descent, sum.1 + cost);
        }
    }
    Ok(sum)
}

/// The same of one experiment.
fn descent_of(
    point: &Point,
    table: &Table,
    freedom: Freedom,
    loss: &Loss,
    experiment: &Experiment,
    index: usize,
) -> Result<(DVector<f64>, f64), Error> {
    let mut stream = Stream::new(point, table, freedom.derivatives, experiment, index)?;
    let mut descent = DVector::zeros(table.len);
    let mut blocks = stream.traces();
    let cost = weigh(&mut blocks, experiment, loss);
    for (trace, residuals) in &blocks {
        for (column, k) in residuals.column_iter().zip(&trace.scored) {
            for (output, &sensitivity) in column.iter().enumerate() {
                stream.added(output, trace.samples.start + k, |unknown, derivative| {
                    descent[unknown] += derivative * sensitivity;
                });
            }
        }
    }
    let signals = stream.signals();
    let places = Places::new(point);
    let injections = injections(point, table, index, signals, &places);
    let forgets = forgets(point, table, index);
    let mut back = Back::new(point, &places, signals.len, (experiment.warmup, forgets));
    for (trace, residuals) in blocks.iter().rev() {
        back.run(trace, residuals);
    }
    for Injection { unknown, place, signal, factor } in injections {
        descent[unknown] += factor * back.met[(place, signal)];
    }
    for (unknown, state, change) in starts(table, index) {
        descent[unknown] += change * back.start[state];
    }
    Ok((descent, cost))
}

/// Turns the residuals (outputs, scored samples) of all blocks into what enters the gradient by them, and returns the cost.
fn weigh(blocks: &mut [(Trace, Matrix)], experiment: &Experiment, loss: &Loss) -> f64 {
    let mut cost = 0.0;
    for output in 0..loss.scales.len() {
        let rows = blocks.iter().map(|(_, residuals)| residuals.row(output));
        let mut values: Vec<f64> =
            rows.flat_map(|row| row.iter().copied().collect::<Vec<_>>()).collect();
        let mut rest = &mut values[..];
        for run in experiment.scored_runs() {
            let (own, behind) = rest.split_at_mut(run.len());
            cost += loss.weigh(output, own);
            rest = behind;
        }
        let mut weighed = values.into_iter();
        for (_, residuals) in blocks.iter_mut() {
            residuals
                .row_mut(output)
                .iter_mut()
                .zip(&mut weighed)
                .for_each(|(own, value)| *own = value);
        }
    }
    cost
}

/// The chain backwards in time: what the cost makes of a change at each place.
struct Back<'a> {
    sections: Vec<Section>,
    /// Rows of C by outputs, columns of B by inputs.
    c: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    d: &'a Matrix,
    loops: Vec<&'a InnerLoop>,
    between: Between,
    /// Where the memory of each loop stands in `plays`.
    memories: Vec<Range<usize>>,
    /// The output that each effect of the output stage acts on.
    sensed: Vec<usize>,
    places: &'a Places,
    warmup: usize,
    /// Whether what was before the end of the warm-up is forgotten.
    forgets: bool,
    /// Of the state behind the sample.
    x: Vec<f64>,
    /// Of what each effect of the output stage holds.
    held: Vec<f64>,
    /// Of where each loop's plays stand.
    plays: Vec<f64>,
    /// Of the state at the end of the warm-up.
    start: Vec<f64>,
    /// (places, signals): sums over all samples of a place's change times a signal.
    met: Matrix,
}

impl<'a> Back<'a> {
    fn new(
        point: &'a Point,
        places: &'a Places,
        signals: usize,
        (warmup, forgets): (usize, bool),
    ) -> Self {
        let dynamics = &point.dynamics;
        let loops: Vec<&InnerLoop> = point.loops().collect();
        let sections = point.sections();
        let (outputs, inputs) = dynamics.d.shape();
        let sensed = sensed(point);
        let b = columns(&sections, inputs);
        Self {
            between: Between::of_sections(dynamics, point.loops(), point.intersample),
            memories: memories(&loops),
            c: rows(&sections, outputs),
            b,
            sections,
            d: &dynamics.d,
            plays: vec![0.0; loops.iter().map(|inner| inner.law.memories()).sum()],
            loops,
            held: vec![0.0; sensed.len()],
            sensed,
            places,
            warmup,
            forgets,
            x: vec![0.0; point.order()],
            start: vec![0.0; point.order()],
            met: Matrix::zeros(places.len, signals),
        }
    }

    /// A block of samples, from its last to its first; `residuals` (outputs, scored samples) are weighted.
    fn run(&mut self, trace: &Trace, residuals: &Matrix) {
        let samples = trace.samples.len();
        let mut work = Matrix::zeros(self.places.len, samples);
        let marks = trace.marks.len() / samples;
        let slopes = self.sensed.len();
        let mut scored = trace.scored.iter().enumerate().rev().peekable();
        for (k, mut work) in work.column_iter_mut().enumerate().rev() {
            let work = work.as_mut_slice();
            let own = scored.next_if(|(_, scored)| **scored == k);
            if let Some((column, _)) = own {
                work[self.places.y.clone()].copy_from_slice(residuals.column(column).as_slice());
            }
            self.sense(work, &trace.slopes[k * slopes..(k + 1) * slopes]);
            self.advance(work);
            self.circulate(work, &trace.marks[k * marks..(k + 1) * marks]);
            self.observe(work);
            let sample = trace.samples.start + k;
            if sample == self.warmup {
                self.start.clone_from(&self.x);
                if self.forgets {
                    self.x.fill(0.0);
                }
            }
            if sample == 0 {
                let mut standing = DVector::zeros(self.places.len);
                self.stand(standing.as_mut_slice());
                self.met.ger(1.0, &standing, &DVector::from_column_slice(&trace.standing), 1.0);
            }
        }
        let len = self.met.ncols();
        let signals = DMatrixView::from_slice(&trace.signals, len, samples);
        self.met.gemm(1.0, &work, &signals.transpose(), 1.0);
    }

    /// The output stage.
    fn sense(&mut self, work: &mut [f64], slopes: &[Slope]) {
        let stages = self.sensed.iter().zip(slopes).zip(&mut self.held);
        for ((&output, slope), held) in stages.rev() {
            slope.adjoint(&mut work[self.places.y.start + output], held);
        }
    }

    /// What moves the state on.
    fn advance(&mut self, work: &mut [f64]) {
        let Places { v, w, states, .. } = self.places;
        work[states.clone()].copy_from_slice(&self.x);
        for (place, b) in v.clone().zip(&self.b) {
            work[place] += dot(b, &self.x);
        }
        for (place, drives) in w.clone().zip(&self.between.drives) {
            work[place] += dot(drives, &self.x[..drives.len()]);
        }
        let mut first = 0;
        for section in &self.sections {
            advance_adjoint(&section.a, &mut self.x[first..first + section.order()]);
            first += section.order();
        }
    }

    /// The loops.
    fn circulate(&mut self, work: &mut [f64], mut marks: &[f64]) {
        let Places { v, next, z, w, shapes, .. } = self.places;
        for (step, row) in self.between.seen.iter().enumerate().rev() {
            let number = step % self.loops.len();
            let Row { states, inputs, next: ahead, earlier } = row;
            let law = &self.loops[number].law;
            let (others, own) = marks.split_at(marks.len() - law.marks());
            let around = work[w.start + step];
            let shapes = &mut work[shapes[number].clone()];
            let plays = &mut self.plays[self.memories[number].clone()];
            let sensitivity = law.adjoint(around, shapes, own, plays);
            work[z.start + step] = sensitivity;
            add(&mut self.x, sensitivity, states);
            if let Sees::Output(output) = self.loops[number].sees {
                // what is in parallel with G
                add(&mut self.x[states.len()..], sensitivity, &self.c[output][states.len()..]);
            }
            add(&mut work[v.clone()], sensitivity, inputs);
            add(&mut work[next.clone()], sensitivity, ahead);
            add(&mut work[w.clone()], sensitivity, earlier);
            marks = others;
        }
    }

    /// The displacement.
    fn observe(&mut self, work: &mut [f64]) {
        let Places { v, y, .. } = self.places;
        for (output, c) in self.c.iter().enumerate() {
            let sensitivity = work[y.start + output];
            add(&mut self.x, sensitivity, c);
            for input in v.clone() {
                work[input] += self.d[(output, input - v.start)] * sensitivity;
            }
        }
    }

    /// The steady state before the record.
    fn stand(&mut self, work: &mut [f64]) {
        let Places { v, states, .. } = self.places;
        let mut first = 0;
        for section in &self.sections {
            let order = section.order();
            let standing = section.standing(&Matrix::identity(order, order));
            let sensitivity =
                standing.tr_mul(&DVector::from_column_slice(&self.x[first..first + order]));
            add(&mut work[states.start + first..][..order], 1.0, sensitivity.as_slice());
            for (place, b) in v.clone().zip(&self.b) {
                work[place] += dot(&b[first..first + order], sensitivity.as_slice());
            }
            first += order;
        }
    }
}

fn add(sum: &mut [f64], factor: f64, values: &[f64]) {
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
}
