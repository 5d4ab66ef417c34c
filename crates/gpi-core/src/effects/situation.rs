//! The signals of a base model on its record, from which effects take the scales of their proposals.

use super::inner_loop::InnerLoop;
use crate::linear::Sections;
use crate::{Matrix, Record};

/// What comes out of the hysteresis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputKind {
    /// A displacement, which lags behind its cause: plays.
    Displacement,
    /// The force of elements that slip, which leads the displacement that causes it: stops without deadzones.
    Force,
    /// Stops behind deadzones: a field that saturates, for example.
    Other,
}

/// A base model on its record: `u -> drive -> v -> displacement`, one matrix an experiment.
pub(crate) struct Situation<'a> {
    pub record: &'a Record,
    /// The drive after the input stage, (samples, inputs).
    pub drives: &'a [Matrix],
    /// v, (samples, inputs).
    pub intermediates: &'a [Matrix],
    /// G v, (samples, outputs), before the output stage.
    pub displacements: &'a [Matrix],
    /// Measured minus simulated outputs, (samples, outputs).
    pub residuals: &'a [Matrix],
    /// G alone.
    pub dynamics: &'a Sections,
    /// Loops that are closed around it.
    pub loops: Vec<&'a InnerLoop>,
    /// What the output of the hysteresis is.
    pub kind: OutputKind,
    /// Half-width of the widest play of each input.
    pub widest: Vec<f64>,
    /// The range of the plays' input, one an input.
    pub places: Vec<(f64, f64)>,
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

    /// The standard deviation of an output's displacement.
    pub(crate) fn rms(&self, output: usize) -> f64 {
        let samples = self.displacements.iter().map(Matrix::nrows).sum::<usize>() as f64;
        let columns = || self.displacements.iter().map(|signal| signal.column(output));
        let mean = columns().map(|column| column.sum()).sum::<f64>() / samples;
        let squares = columns().map(|column| column.add_scalar(-mean).norm_squared());
        (squares.sum::<f64>() / samples).sqrt()
    }

    /// Seconds of the longest experiment.
    pub(crate) fn duration(&self) -> f64 {
        self.record.longest() as f64 / self.record.rate()
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
