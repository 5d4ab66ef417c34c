//! `static-polynomial`: powers of every input.

use super::regression::{Features, Sums, predict};
use super::{Model, RivalPolicy};
use crate::Record;

/// The name in every answer.
const NAME: &str = "static-polynomial";

/// `u_i(k)^n`, all inputs of one degree together.
struct Powers<'a> {
    record: &'a Record,
    degree: usize,
}

impl Features for Powers<'_> {
    fn count(&self) -> usize {
        self.degree * self.record.inputs().len()
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        let inputs = self.record.inputs().len();
        let input = &self.record.experiments()[experiment].input;
        for i in 0..inputs {
            let mut power = 1.0;
            for degree in 0..self.degree {
                power *= input[(k, i)];
                row[degree * inputs + i] = power;
            }
        }
    }
}

pub(super) fn fit(record: &Record, policy: &RivalPolicy) -> Option<Model> {
    let inputs = record.inputs().len();
    let sums = Sums::of_outputs(&Powers { record, degree: policy.degree }, record, policy);
    let sizes: Vec<usize> = (1..=policy.degree).map(|degree| degree * inputs).collect();
    // powers of so low a degree need no ridge
    let choice = sums.best(&sizes, &policy.ridges[..1])?;
    let coefficients = sums.coefficients(&choice);
    let degree = choice.size / inputs;
    Some(Model {
        name: NAME,
        detail: format!("degree {degree}"),
        simulate: Box::new(move |record| {
            predict(&Powers { record, degree }, &coefficients, record)
        }),
    })
}
