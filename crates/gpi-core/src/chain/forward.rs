//! The values of a point along one experiment, and what its derivatives need of them.
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
//! to x; y from x and v; the output stage; the loops' w and x to the next sample. Before the first sample nothing
//! moved: the dead time brings in v(0) until sample L, while the hysteresis waits.
//!
//! What derivatives need of a block of samples is recorded as a [`Trace`]: for each sample one column of [`Signals`]
//! (1, v and dv/dtheta of every input, the derivatives by the values of curves, the same at the next sample where loops look
//! ahead, x, w and the stops of every loop in every step), the
//! marks of the loops and the slopes of the output stage.

use super::injections::{ONE, Signals};
use super::motion::Motion;
use super::point::{Past, Point};
use super::sensing::Sensing;
use super::sensitivity::{Derivatives, Sensitivity};
use super::tangents::Trace;
use crate::{Experiment, Matrix};

/// Samples that are taken through at once: what is recorded of them stays in the cache.
const BLOCK: usize = 256;

/// A point in motion along one experiment.
pub(super) struct Forward<'a> {
    point: &'a Point,
    experiment: &'a Experiment,
    index: usize,
    sensitivities: Vec<Sensitivity<'a>>,
    /// v and its derivatives, of each input.
    columns: Vec<Vec<f64>>,
    /// Derivatives of v by the values of effects that read the plays, (values, samples).
    readings: Vec<Matrix>,
    motion: Motion<'a>,
    sensing: Vec<Sensing<'a>>,
    signals: Signals,
    /// The drive that reaches the hysteresis.
    drive: Matrix,
    /// What effects add to the displacement, (samples, outputs).
    displaced: Matrix,
    /// What effects add to the output, (samples, outputs).
    added: Matrix,
    is_scored: Vec<bool>,
}

impl<'a> Forward<'a> {
    pub(super) fn new(
        point: &'a Point,
        wanted: Derivatives,
        experiment: &'a Experiment,
        index: usize,
    ) -> Self {
        let Past { plays, .. } = &point.pasts[index];
        let channels = point.channels.iter().enumerate();
        let sensitivities = channels.map(|(input, channel)| {
            let start = plays.as_ref().map(|plays| &plays[input][..]);
            Sensitivity::new(channel, start, wanted, point.plays(input))
        });
        let signals = Signals::new(point, wanted);
        let drive = point.drive(experiment);
        let [displaced, added] = point.added(experiment);
        let mut is_scored = vec![false; experiment.input.nrows()];
        for run in experiment.scored_runs() {
            is_scored[run].fill(true);
        }
        Self {
            sensitivities: sensitivities.collect(),
            columns: signals.columns.iter().map(|own| vec![0.0; own.len()]).collect(),
            readings: point.reading_slopes(&drive, &point.pasts[index]),
            motion: Motion::new(point),
            sensing: Vec::new(),
            signals,
            drive,
            displaced,
            added,
            is_scored,
            point,
            experiment,
            index,
        }
    }

    /// The first samples of all blocks up to the last scored sample.
    pub(super) fn scored_blocks(&self) -> impl ExactSizeIterator<Item = usize> + Send + use<> {
        let last = self.is_scored.iter().rposition(|&scored| scored).map_or(0, |last| last + 1);
        (0..last).step_by(BLOCK)
    }

    /// The first samples of all blocks.
    pub(super) fn blocks(&self) -> impl Iterator<Item = usize> + use<> {
        (0..self.is_scored.len()).step_by(BLOCK)
    }

    /// Runs the model through a block from a sample on: what its derivatives need, and the residuals of its
    /// scored samples.
    pub(super) fn pass(&mut self, first: usize) -> (Trace, Matrix) {
        let is_scored = &self.is_scored;
        let block = first..is_scored.len().min(first + BLOCK);
        let scored: Vec<usize> =
            block.clone().filter(|&k| is_scored[k]).map(|k| k - first).collect();
        let mut residuals = Matrix::zeros(self.point.dynamics.outputs(), scored.len());
        let Signals { columns, readings, states, loops, len, ahead, .. } = &self.signals;
        let mut trace = Trace {
            signals: vec![0.0; len * block.len()],
            standing: Vec::new(),
            samples: block,
            marks: Vec::new(),
            slopes: Vec::new(),
            scored,
        };
        let Past { state, has_unknown_state, .. } = &self.point.pasts[self.index];
        let mut scored = trace.scored.iter().enumerate().peekable();
        let delay = self.point.dynamics.delay;
        let last = self.is_scored.len() - 1;
        let mut v = vec![0.0; self.sensitivities.len()];
        let mut next = v.clone();
        for (place, k) in trace.samples.clone().enumerate() {
            let signals = &mut trace.signals[place * len..(place + 1) * len];
            signals[ONE] = 1.0;
            if k == 0 {
                for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                    sensitivity.step(self.drive[(0, input)], &mut self.columns[input]);
                }
            }
            let take = |known: &[Vec<f64>], at: usize, signals: &mut [f64]| {
                for (own, column) in columns.iter().zip(known) {
                    signals[own.clone()].copy_from_slice(column);
                }
                for (slopes, own) in self.readings.iter().zip(readings) {
                    signals[own.clone()].copy_from_slice(slopes.column(at).as_slice());
                }
            };
            v.iter_mut().zip(&self.columns).for_each(|(v, column)| *v = column[0]);
            take(&self.columns, k.saturating_sub(delay), signals);
            // what the delay brings in first is the time in which nothing moved
            let behind = (k + 1).saturating_sub(delay).min(last);
            if behind > 0 && k < last {
                for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                    sensitivity.step(self.drive[(behind, input)], &mut self.columns[input]);
                }
            }
            next.iter_mut().zip(&self.columns).for_each(|(next, column)| *next = column[0]);
            if let Some(ahead) = ahead {
                take(&self.columns, behind, &mut signals[*ahead..]);
            }
            if k == 0 {
                self.motion.stand(&v);
                trace.standing = signals.to_vec();
                trace.standing[states.clone()].copy_from_slice(&self.motion.state);
            }
            if k == self.experiment.warmup && *has_unknown_state {
                self.motion.state.iter_mut().zip(state.iter()).for_each(|(x, own)| *x += own);
            }
            self.motion.observe(&v);
            signals[states.clone()].copy_from_slice(&self.motion.state);
            let displaced: Vec<f64> = (0..self.displaced.ncols())
                .map(|output| self.motion.displacement[output] + self.displaced[(k, output)])
                .collect();
            if k == 0 {
                let stages = displaced.iter().enumerate();
                self.sensing = stages
                    .map(|(output, &first)| Sensing::new(self.point, self.index, output, first))
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
            self.motion.advance(&v, &next);
            for (own, around) in loops.iter().zip(&self.motion.loops.signals) {
                signals[own.start] = around.w;
                signals[own.start + 1..own.end].copy_from_slice(&around.stops);
                trace.marks.extend(&around.marks);
            }
        }
        (trace, residuals)
    }

    /// The slowly varying offset of an output.
    fn offset(&self, output: usize, k: usize) -> f64 {
        let knots = &self.point.offsets[self.index];
        let hats = hats(k, self.experiment.input.nrows(), knots.nrows());
        hats.map(|(knot, weight)| weight * knots[(knot, output)]).sum()
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
