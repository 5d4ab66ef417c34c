//! The residual and what it is compared with.
//!
//! Sums and means run over the scored samples of all experiments, in the order of time, and products are never formed
//! across the border of two experiments. A mean is that of an output over all experiments together.

use super::policy::ResidualPolicy;
use crate::{Matrix, Record};

/// A residual with the signals that it is compared with, each (samples, channels), one an experiment.
#[derive(Clone, Copy)]
pub(super) struct Compared<'a> {
    pub policy: &'a ResidualPolicy,
    pub record: &'a Record,
    pub residuals: &'a [Matrix],
    /// The simulated output.
    pub simulated: &'a [Matrix],
    /// The model's v, from rest.
    pub intermediate: &'a [Matrix],
}

impl Compared<'_> {
    /// Experiment and place of every scored sample.
    pub(super) fn scored(&self) -> impl Iterator<Item = (usize, usize)> {
        let experiments = self.record.experiments().iter().enumerate();
        experiments.flat_map(|(index, e)| e.scored_runs().flatten().map(move |k| (index, k)))
    }

    /// A signal of the residuals' shape without the mean of each output's scored samples.
    pub(super) fn centred(&self, signals: &[Matrix]) -> Vec<Matrix> {
        let mut centred = signals.to_vec();
        for output in 0..self.record.outputs().len() {
            let sum: f64 = self.scored().map(|(index, k)| signals[index][(k, output)]).sum();
            let mean = sum / self.record.scored() as f64;
            centred.iter_mut().for_each(|m| m.column_mut(output).add_scalar_mut(-mean));
        }
        centred
    }
}
