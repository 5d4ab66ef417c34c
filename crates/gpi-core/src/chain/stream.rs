//! One experiment streamed through the hysteresis of every input, through G and the output stage, and through all of
//! their derivatives.
//!
//! The simulated output of a point is, with the dead time of G of L samples, the displacement y of [`Motion`] driven by
//! `v(k - L)`, the signals d_1 and d_2 that effects add before and after the output stage H ([`Sensing`]), and the
//! offset with its knots o_m:
//!
//! ```text
//! y_simulated(k) = H(y(k) + d_1(k)) + d_2(k) + sum_m hat_m(k) o_m
//! ```
//!
//! A sample runs in this order: hysteresis and its derivatives (v and dv/dtheta, [`Sensitivity`]); at the first sample
//! the steady state of the sections at this v; at the end of the warm-up the unknown part of the initial state is added
//! to x; y and the loops' w from x and v; the output stage; x to the next sample. Before the first sample nothing
//! moved: the dead time brings in v(0) until sample L, while the hysteresis waits.
//!
//! A block of samples is simulated first, and what its derivatives need is recorded as a [`Trace`]: for each sample one
//! column of [`Signals`] (1, v and dv/dtheta of every input, the derivatives by the values of curves, x, w and the
//! stops of every loop), the marks of the loops and the slopes of the output stage. [`Tangents`] then takes all
//! unknowns through the same block, so that a trace is read while it is in the cache. [`super::adjoint`] needs the
//! traces of all blocks, from the last to the first.

use super::injections::{ONE, Signals};
use super::motion::Motion;
use super::point::{Past, Point};
use super::sensing::Sensing;
use super::sensitivity::{Derivatives, Sensitivity};
use super::table::{Group, Table};
use super::tangents::{Tangents, Trace};
use crate::{Error, Experiment, Matrix};
use std::ops::Range;

/// Samples that are taken through at once: what is recorded of them stays in the cache.
const BLOCK: usize = 256;

/// Residuals and derivatives of a run of scored samples of one experiment.
pub(crate) struct Rows {
    /// For each output, (unknowns, samples).
    pub regressors: Vec<Matrix>,
    /// Measured minus simulated, (outputs, samples).
    pub residuals: Matrix,
}

/// Streams one experiment and hands its rows on block by block.
pub(crate) struct Stream<'a> {
    point: &'a Point,
    table: &'a Table,
    experiment: &'a Experiment,
    index: usize,
    sensitivities: Vec<Sensitivity<'a>>,
    /// v and its derivatives, of each input.
    columns: Vec<Vec<f64>>,
    /// Derivatives of v by the values of effects that read the plays, (values, samples).
    readings: Vec<Matrix>,
    motion: Motion<'a>,
    sensing: Vec<Sensing<'a>>,
    tangents: Tangents<'a>,
    /// The drive that reaches the hysteresis.
    drive: Matrix,
    /// Derivatives by the values of effects, `[effect][value]`.
    effects: Vec<Vec<Matrix>>,
    /// What effects add to the displacement, (samples, outputs).
    displaced: Matrix,
    /// What effects add to the output, (samples, outputs).
    added: Matrix,
    /// Where the unknowns of the offsets and of each effect stand.
    offset_unknowns: usize,
    effect_unknowns: Vec<Range<usize>>,
    /// The sample from which on derivatives are taken along.
    tangents_from: usize,
}

impl<'a> Stream<'a> {
    pub(crate) fn new(
        point: &'a Point,
        table: &'a Table,
        wanted: Derivatives,
        experiment: &'a Experiment,
        index: usize,
    ) -> Result<Self, Error> {
        let Past { plays, .. } = &point.pasts[index];
        let channels = point.channels.iter().enumerate();
        let sensitivities = channels.map(|(input, channel)| {
            let start = plays.as_ref().map(|plays| &plays[input][..]);
            Sensitivity::new(channel, start, wanted, point.plays(input))
        });
        let signals = Signals::new(point, wanted);
        let drive = point.drive(experiment);
        let stages = point.stages();
        let added = |moves_stage| {
            let mut added = Matrix::zeros(experiment.input.nrows(), point.dynamics.outputs());
            stages.add(&mut stages.memories(), moves_stage, &experiment.covariates, &mut added);
            added
        };
        Ok(Self {
            sensitivities: sensitivities.collect(),
            columns: signals.columns.iter().map(|own| vec![0.0; own.len()]).collect(),
            readings: point.reading_slopes(&drive, &point.pasts[index]),
            motion: Motion::new(point),
            sensing: Vec::new(),
            tangents: Tangents::new(point, table, signals, experiment, index),
            drive,
            effects: point.effect_columns(experiment, index)?,
            displaced: added(true),
            added: added(false),
            offset_unknowns: table.range(Group::Offsets { experiment: index }).start,
            effect_unknowns: (0..point.effects.len())
                .map(|place| table.range(Group::Effect { place }))
                .collect(),
            tangents_from: 0,
            point,
            table,
            experiment,
            index,
        })
    }

    /// Takes derivatives along from so many samples before the first scored one only: what they were before
    /// has decayed. The simulation itself runs from the first sample, so that the residuals are exact. The derivatives of
    /// v keep their whole history too; only their responses in G, loops and output stage are cut, in whole blocks.
    pub(crate) fn with_memory(mut self, samples: usize) -> Self {
        let first = self.experiment.scored_runs().next().map_or(0, |run| run.start);
        self.tangents_from = first.saturating_sub(samples);
        self
    }

    /// Hands the rows of all scored samples on.
    pub(crate) fn run(
        &mut self,
        consume: &mut dyn FnMut(Rows) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let outputs = self.point.dynamics.outputs();
        let is_scored = self.scored();
        let last = is_scored.iter().rposition(|&scored| scored).map_or(0, |last| last + 1);
        for first in self.blocks().take_while(|&first| first < last) {
            let (trace, residuals) = self.pass(first, &is_scored);
            if trace.samples.end <= self.tangents_from {
                continue;
            }
            let mut regressors = vec![Matrix::zeros(self.table.len, trace.scored.len()); outputs];
            self.tangents.run(&trace, &mut regressors);
            if trace.scored.is_empty() {
                continue;
            }
            for (output, regressor) in regressors.iter_mut().enumerate() {
                for (mut row, k) in regressor.column_iter_mut().zip(&trace.scored) {
                    self.added(output, first + k, |unknown, derivative| row[unknown] = derivative);
                }
            }
            consume(Rows { regressors, residuals })?;
        }
        Ok(())
    }

    /// The traces of all blocks, and the residuals (outputs, scored samples) of each.
    pub(crate) fn traces(&mut self) -> Vec<(Trace, Matrix)> {
        let is_scored = self.scored();
        self.blocks().map(|first| self.pass(first, &is_scored)).collect()
    }

    /// What the traces hold.
    pub(crate) fn signals(&self) -> &Signals {
        self.tangents.signals()
    }

    /// The first samples of all blocks.
    fn blocks(&self) -> impl Iterator<Item = usize> + use<> {
        (0..self.experiment.input.nrows()).step_by(BLOCK)
    }

    /// Which samples are scored.
    fn scored(&self) -> Vec<bool> {
        let mut scored = vec![false; self.experiment.input.nrows()];
        for run in self.experiment.scored_runs() {
            scored[run].fill(true);
        }
        scored
    }

    /// Runs the model through a block from a sample on: what its derivatives need, and the residuals of its
    /// scored samples.
    fn pass(&mut self, first: usize, is_scored: &[bool]) -> (Trace, Matrix) {
        let block = first..is_scored.len().min(first + BLOCK);
        let scored: Vec<usize> =
            block.clone().filter(|&k| is_scored[k]).map(|k| k - first).collect();
        let mut residuals = Matrix::zeros(self.point.dynamics.outputs(), scored.len());
        let Signals { columns, readings, states, loops, len, .. } = self.tangents.signals();
        let mut trace = Trace {
            signals: vec![0.0; len * block.len()],
            samples: block,
            marks: Vec::new(),
            slopes: Vec::new(),
            scored,
        };
        let Past { state, has_unknown_state, .. } = &self.point.pasts[self.index];
        let mut scored = trace.scored.iter().enumerate().peekable();
        let mut v = vec![0.0; self.sensitivities.len()];
        for (place, k) in trace.samples.clone().enumerate() {
            let signals = &mut trace.signals[place * len..(place + 1) * len];
            signals[ONE] = 1.0;
            let at = k.saturating_sub(self.point.dynamics.delay);
            for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                // what the delay brings in first is the time in which nothing moved
                if at > 0 || k == 0 {
                    sensitivity.step(self.drive[(at, input)], &mut self.columns[input]);
                }
                v[input] = self.columns[input][0];
                signals[columns[input].clone()].copy_from_slice(&self.columns[input]);
            }
            for (slopes, own) in self.readings.iter().zip(readings) {
                signals[own.clone()].copy_from_slice(slopes.column(at).as_slice());
            }
            if k == 0 {
                self.motion.stand(&v);
            }
            if k == self.experiment.warmup && *has_unknown_state {
                self.motion.state.iter_mut().zip(state.iter()).for_each(|(x, own)| *x += own);
            }
            self.motion.observe(&v);
            signals[states.clone()].copy_from_slice(&self.motion.state);
            for (own, around) in loops.iter().zip(&self.motion.loops.signals) {
                signals[own.start] = around.w;
                let stops = &mut signals[own.start + 1..own.end];
                stops.iter_mut().zip(&around.places).for_each(|(s, place)| *s = around.z - place);
                trace.marks.extend(&around.marks);
            }
            let displaced: Vec<f64> = (0..self.displaced.ncols())
                .map(|output| self.motion.displacement[output] + self.displaced[(k, output)])
                .collect();
            if k == 0 {
                let stages = displaced.iter().enumerate();
                self.sensing = stages
                    .map(|(output, &first)| Sensing::new(self.point, output, first))
                    .collect();
            }
            let own = scored.next_if(|(_, scored)| **scored == place);
            let moment = self.point.stages().moment(k, &[]);
            for (output, &displaced) in displaced.iter().enumerate() {
                let sensed = self.sensing[output].step(displaced, moment, &mut trace.slopes);
                if let Some((column, _)) = own {
                    let simulated = sensed + self.added[(k, output)] + self.offset(output, k);
                    residuals[(output, column)] = self.experiment.output[(k, output)] - simulated;
                }
            }
            self.motion.advance(&v);
        }
        (trace, residuals)
    }

    /// The slowly varying offset of an output.
    fn offset(&self, output: usize, k: usize) -> f64 {
        let knots = &self.point.offsets[self.index];
        let hats = hats(k, self.experiment.input.nrows(), knots.nrows());
        hats.map(|(knot, weight)| weight * knots[(knot, output)]).sum()
    }

    /// Calls `each` with the derivatives of what is added behind the output stage, and by the values of effects
    /// whose own do not stream along.
    pub(crate) fn added(&self, output: usize, k: usize, mut each: impl FnMut(usize, f64)) {
        let knots = self.point.offsets[self.index].nrows();
        let first = self.offset_unknowns + output * knots;
        for (knot, weight) in hats(k, self.experiment.input.nrows(), knots) {
            each(first + knot, weight);
        }
        for (columns, unknowns) in self.effects.iter().zip(&self.effect_unknowns) {
            for (column, unknown) in columns.iter().zip(unknowns.clone()) {
                each(unknown, column[(k, output)]);
            }
        }
    }
}

/// The knots next to sample k of `samples`, with their weights in linear interpolation.
///
/// With M knots from the first sample to the last, k stands at `p = k (M - 1) / (samples - 1)` between the knots
/// `m = floor(p)` and m + 1, which have the weights 1 - (p - m) and p - m. One knot has the weight 1 everywhere.
pub(crate) fn hats(k: usize, samples: usize, knots: usize) -> impl Iterator<Item = (usize, f64)> {
    let place = k as f64 / (samples.max(2) - 1) as f64 * (knots - 1) as f64;
    let left = (place as usize).min(knots.saturating_sub(2));
    let right = place - left as f64;
    [(left, 1.0 - right), (left + 1, right)].into_iter().take(knots.min(2))
}
