//! `fir`: a finite impulse response from each input.

use super::regression::{Features, Sums, predict};
use super::{Model, RivalPolicy};
use crate::Record;

/// The name in every answer.
const NAME: &str = "fir";

/// `u_i(k - l)`, all inputs of one lag together; u has its first value before the first sample.
pub(super) struct Lags<'a> {
    pub record: &'a Record,
    pub lags: usize,
}

impl Features for Lags<'_> {
    fn count(&self) -> usize {
        self.lags * self.record.inputs().len()
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        let inputs = self.record.inputs().len();
        for (i, column) in self.record.experiments()[experiment].input.column_iter().enumerate() {
            for lag in 0..self.lags {
                row[lag * inputs + i] = column[k.saturating_sub(lag)];
            }
        }
    }
}

pub(super) fn fit(record: &Record, policy: &RivalPolicy) -> Option<Model> {
    let inputs = record.inputs().len();
    let fits = |length: &usize| length * inputs <= policy.most_lags.max(inputs * policy.lengths[0]);
    let sizes: Vec<usize> =
        policy.lengths.iter().copied().filter(fits).map(|length| length * inputs).collect();
    let lags = sizes.last()? / inputs;
    let sums = Sums::of_outputs(&Lags { record, lags }, record, policy);
    let choice = sums.best(&sizes, &policy.ridges)?;
    let coefficients = sums.coefficients(&choice);
    let lags = choice.size / inputs;
    Some(Model {
        name: NAME,
        detail: format!("{lags} lags, ridge {:e}", choice.ridge),
        simulate: Box::new(move |record| predict(&Lags { record, lags }, &coefficients, record)),
    })
}
