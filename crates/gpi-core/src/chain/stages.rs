//! The stages before the hysteresis and after the linear dynamics, over blocks of samples.
//!
//! ```text
//! u -> input stage -> drive   ...   displacement -> (+) -> output stage -> (+) -> y
//! ```
//!
//! Models and estimated points run through these definitions. `memories` has one state an effect of the chain; an empty
//! one is filled when the effect sees its first sample, before which its input was constant.
//!
//! With the input effects I_1, I_2, .. on an input, the effects H_1, H_2, .. on an output, and the added signals d,
//! each in the order of the chain and each with a state of its own,
//!
//! ```text
//! drive   = .. I_2(I_1(u)) ..                                             (samples, inputs)
//! reading = .. H_2(H_1(displacement + sum_before d)) .. + sum_after d     (samples, outputs)
//! ```
//!
//! The three parts of a reading run over the whole block one after the other, which gives the same as sample by sample,
//! because no part depends on a later one. A block begins at sample `first` of the record, so that functions of time
//! continue: t = (first + k) / rate.

use crate::Matrix;
use crate::effects::{Added, Effect, Moment, Place};

/// The effects of a chain, and its clock.
#[derive(Clone, Copy)]
pub(crate) struct Stages<'a> {
    pub effects: &'a [Effect],
    /// Sampling rate in Hz.
    pub rate: f64,
    /// The number of the block's first sample.
    pub first: usize,
}

impl<'a> Stages<'a> {
    /// Nothing is remembered yet.
    pub(crate) fn memories(&self) -> Vec<Vec<f64>> {
        vec![Vec::new(); self.effects.len()]
    }

    pub(crate) fn moment<'b>(&self, k: usize, covariates: &'b [f64]) -> Moment<'b> {
        Moment { time: (self.first + k) as f64 / self.rate, rate: self.rate, covariates }
    }

    /// The effects that `choose` selects, with their states.
    pub(crate) fn at<'b, T>(
        &self,
        memories: &'b mut [Vec<f64>],
        choose: impl Fn(Place<'a>) -> Option<T>,
    ) -> impl Iterator<Item = (T, &'b mut Vec<f64>)>
    where
        'a: 'b,
    {
        let pairs = self.effects.iter().zip(memories);
        pairs.filter_map(move |(effect, memory)| Some((choose(effect.place())?, memory)))
    }

    /// Turns inputs (samples, inputs) into the drives that reach the hysteresis.
    pub(crate) fn drive(&self, memories: &mut [Vec<f64>], signal: &mut Matrix) {
        for (effect, memory) in self.at(memories, Place::input_stage) {
            let mut column = signal.column_mut(effect.input());
            if memory.is_empty() {
                *memory = effect.rest(column[0]);
            }
            for value in column.iter_mut() {
                *value = effect.drive(memory, *value, self.rate);
            }
        }
    }

    /// Turns displacements (samples, outputs) into readings: what is added before the output stage, the output stage,
    /// and what is added after it. `covariates` are (samples, columns).
    pub(crate) fn read(&self, memories: &mut [Vec<f64>], covariates: &Matrix, signal: &mut Matrix) {
        self.add(memories, true, covariates, signal);
        self.sense(memories, &|_| None, signal);
        self.add(memories, false, covariates, signal);
    }

    /// The output stage. `side` tells where the gap of an output stands at first ([`crate::effects::OutputStage::rest`]).
    pub(crate) fn sense(
        &self,
        memories: &mut [Vec<f64>],
        side: &dyn Fn(usize) -> Option<f64>,
        signal: &mut Matrix,
    ) {
        for (effect, memory) in self.at(memories, Place::output_stage) {
            let mut column = signal.column_mut(effect.output());
            if memory.is_empty() {
                *memory = effect.rest(column[0], side(effect.output()));
            }
            for (k, value) in column.iter_mut().enumerate() {
                *value = effect.sense(memory, *value, self.moment(k, &[])).0;
            }
        }
    }

    /// Adds the signals before the output stage (true) or after it.
    pub(crate) fn add(
        &self,
        memories: &mut [Vec<f64>],
        moves_stage: bool,
        covariates: &Matrix,
        signal: &mut Matrix,
    ) {
        for (effect, memory) in self.at(memories, Place::added) {
            if effect.moves_stage() == moves_stage {
                self.add_one(effect, memory, covariates, 1.0, signal);
            }
        }
    }

    /// Adds one signal, so many times.
    pub(crate) fn add_one(
        &self,
        effect: &dyn Added,
        memory: &mut Vec<f64>,
        covariates: &Matrix,
        times: f64,
        signal: &mut Matrix,
    ) {
        let rows = covariates.transpose();
        let width = rows.nrows();
        let at = |k: usize| &rows.as_slice()[k * width..(k + 1) * width];
        if memory.is_empty() {
            *memory = effect.rest(self.moment(0, at(0)));
        }
        for (k, value) in signal.column_mut(effect.output()).iter_mut().enumerate() {
            *value += times * effect.add(memory, self.moment(k, at(k)));
        }
    }
}
