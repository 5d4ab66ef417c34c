//! What the candidates of the catalogue are placed by.

use super::{Effect, InnerLoop};
use crate::linear::Sections;
use crate::{Matrix, Record};

/// A base model on its record.
pub(crate) struct Situation<'a> {
    pub record: &'a Record,
    /// The drive of each experiment after the input stage, (samples, inputs).
    pub drives: &'a [Matrix],
    /// v of each experiment, (samples, inputs).
    pub intermediates: &'a [Matrix],
    /// What G makes of them, (samples, outputs), before the output stage.
    pub displacements: &'a [Matrix],
    /// Measured minus simulated.
    pub residuals: &'a [Matrix],
    /// G alone.
    pub dynamics: &'a Sections,
    /// Loops that are closed around it.
    pub loops: Vec<&'a InnerLoop>,
    /// Half-width of the widest play of each input.
    pub widest: Vec<f64>,
    /// The range of the plays' input, one an input.
    pub places: Vec<(f64, f64)>,
}

/// A block that the search tries: its columns are what the output gains by each probe.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Without effect, unless there is one finite probe.
    pub block: Effect,
    /// Small changes of the block, in which the output changes linearly; or one finite block.
    pub probes: Vec<Effect>,
    /// Whether the block's values are those of the probes, weighted.
    pub linear: bool,
}

impl Candidate {
    /// The same in the other place of the chain where it may stand.
    pub(crate) fn elsewhere(&self) -> Option<Self> {
        let moved = |effect: &Effect| effect.block().elsewhere();
        let probes: Option<Vec<Effect>> = self.probes.iter().map(moved).collect();
        Some(Self { block: moved(&self.block)?, probes: probes?, linear: self.linear })
    }

    /// A block whose values, at these places, are linear in the output: probes move them by its steps.
    pub(crate) fn linear(
        block: impl Into<Effect>,
        places: impl IntoIterator<Item = usize>,
    ) -> Self {
        let block = block.into();
        let steps = block.block().steps();
        let probe = |place: usize| {
            let mut probe = block.clone();
            let mut values = probe.block().values();
            values[place] += steps[place];
            probe.block_mut().set(&values);
            probe
        };
        Self { probes: places.into_iter().map(probe).collect(), linear: true, block }
    }

    /// A block that is compared as a whole with its absence.
    pub(crate) fn finite(block: impl Into<Effect>) -> Self {
        let block = block.into();
        Self { probes: vec![block.clone()], linear: false, block }
    }

    /// The block that a least squares fit of the probes' columns asks for.
    pub(crate) fn start(&self, coefficients: &[f64]) -> Effect {
        let mut block = self.block.clone();
        if self.linear {
            let mut values = block.block().values();
            let zero = values.clone();
            for (probe, coefficient) in self.probes.iter().zip(coefficients) {
                for ((value, zero), moved) in
                    values.iter_mut().zip(&zero).zip(probe.block().values())
                {
                    *value += coefficient * (moved - zero);
                }
            }
            block.block_mut().set(&values);
        }
        block
    }
}

impl Situation<'_> {
    pub(crate) fn inputs(&self) -> std::ops::Range<usize> {
        0..self.record.inputs().len()
    }

    pub(crate) fn outputs(&self) -> std::ops::Range<usize> {
        0..self.record.outputs().len()
    }

    /// Smallest and largest value of a column in any experiment.
    pub(crate) fn range(signals: &[Matrix], column: usize) -> (f64, f64) {
        signals.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), signal| {
            let column = signal.column(column);
            (low.min(column.min()), high.max(column.max()))
        })
    }

    /// The span of an output's displacement.
    pub(crate) fn span(&self, output: usize) -> f64 {
        let (low, high) = Self::range(self.displacements, output);
        high - low
    }

    /// Seconds of the longest experiment.
    pub(crate) fn duration(&self) -> f64 {
        let longest = self.record.experiments().iter().map(|e| e.input.nrows()).max();
        longest.unwrap_or(0) as f64 / self.record.rate()
    }

    /// Absolute steps of a drive from sample to sample, sorted, zeros apart.
    pub(crate) fn steps(&self, input: usize) -> Vec<f64> {
        let mut steps = Vec::new();
        for drive in self.drives {
            let column = drive.column(input);
            let pairs = column.iter().zip(column.iter().skip(1));
            steps.extend(pairs.map(|(a, b)| (b - a).abs()).filter(|&step| step > 0.0));
        }
        steps.sort_by(f64::total_cmp);
        steps
    }
}
