//! `plays`: a linear term and plays of many half-widths, all with one delay.

use super::regression::{Choice, Features, Sums, predict};
use super::{Model, RivalPolicy};
use crate::Record;
use crate::operators::play;

/// The name in every answer.
const NAME: &str = "plays";

/// Of each input `u_i(k - d)` and its plays; each play starts at the first value of u.
pub(crate) struct Plays {
    /// The values of each experiment, those of one sample together.
    tables: Vec<Vec<f64>>,
    width: usize,
    delay: usize,
}

impl Plays {
    /// `count` plays of each input, whose half-widths are uniform over half of its `spans`.
    pub(crate) fn of(record: &Record, spans: &[f64], count: usize) -> Self {
        let width = (count + 1) * spans.len();
        let half_width = |span: f64, j: usize| 0.5 * span * j as f64 / (count + 1) as f64;
        let table = |experiment: &crate::Experiment| {
            let samples = experiment.input.nrows();
            let mut table = vec![0.0; samples * width];
            for (i, (column, &span)) in experiment.input.column_iter().zip(spans).enumerate() {
                let half_widths: Vec<f64> = (0..=count).map(|j| half_width(span, j)).collect();
                let mut places = vec![column[0]; count + 1];
                for (k, &u) in column.iter().enumerate() {
                    let start = k * width + i * (count + 1);
                    let row = &mut table[start..=start + count];
                    for ((value, place), half_width) in
                        row.iter_mut().zip(&mut places).zip(&half_widths)
                    {
                        *place = play(*half_width, u, *place);
                        *value = *place;
                    }
                }
            }
            table
        };
        let tables = record.experiments().iter().map(table).collect();
        Self { tables, width, delay: 0 }
    }
}

impl Features for Plays {
    fn count(&self) -> usize {
        self.width
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        let start = k.saturating_sub(self.delay) * self.width;
        row.copy_from_slice(&self.tables[experiment][start..start + self.width]);
    }
}

pub(super) fn fit(record: &Record, policy: &RivalPolicy) -> Option<Model> {
    // the unit of every input is half of its span on the training data
    let spans = vec![2.0; record.inputs().len()];
    let count = policy.plays;
    let mut features = Plays::of(record, &spans, count);
    let longest = longest_delay(record, policy);
    let mut tried: Vec<(usize, Choice)> = Vec::new();
    let mut attempt = |delay: usize, tried: &mut Vec<(usize, Choice)>| -> Option<()> {
        features.delay = delay;
        let sums = Sums::of_outputs(&features, record, policy);
        tried.push((delay, sums.best(&[features.width], &policy.ridges)?));
        Some(())
    };
    for &delay in policy.delays.iter().filter(|delay| **delay <= longest) {
        attempt(delay, &mut tried)?;
    }
    // halves the distance to the neighbours until there is none
    while let Some(next) = between(&tried) {
        attempt(next, &mut tried)?;
    }
    let (delay, choice) = best(&tried)?;
    features.delay = delay;
    let coefficients = Sums::of_outputs(&features, record, policy).coefficients(choice);
    Some(Model {
        name: NAME,
        detail: format!("{count} plays, delay of {delay} samples, ridge {:e}", choice.ridge),
        simulate: Box::new(move |record| {
            let features = Plays { delay, ..Plays::of(record, &spans, count) };
            predict(&features, &coefficients, record)
        }),
    })
}

fn longest_delay(record: &Record, policy: &RivalPolicy) -> usize {
    let shortest = record.experiments().iter().map(|e| e.input.nrows()).min().unwrap_or(0);
    (policy.delayed * shortest as f64) as usize
}

fn best(tried: &[(usize, Choice)]) -> Option<(usize, &Choice)> {
    let least = tried.iter().min_by(|a, b| a.1.score().total_cmp(&b.1.score()))?;
    Some((least.0, &least.1))
}

/// A delay that was not tried, in the middle between the best one and a neighbour.
fn between(tried: &[(usize, Choice)]) -> Option<usize> {
    let (best, _) = best(tried)?;
    let below = tried.iter().map(|one| one.0).filter(|delay| *delay < best).max();
    let above = tried.iter().map(|one| one.0).filter(|delay| *delay > best).min();
    let middles = [below, above].into_iter().flatten().map(|other| usize::midpoint(best, other));
    middles.into_iter().find(|middle| tried.iter().all(|one| one.0 != *middle))
}
