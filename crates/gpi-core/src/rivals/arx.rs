//! `arx`: a difference equation that is fitted one step ahead and judged by its free run.
//!
//! Each output has its own past and all inputs. The sums are gathered once for the highest orders, from samples whose whole
//! past is scored. Lower orders are parts of them. Of the stable ones, that with the smallest simulation error is taken.

use super::{Model, RivalPolicy};
use crate::linear::{NormalEquations, bounded};
use crate::{Experiment, Matrix, Record};
use nalgebra::DVector;

/// The name in every answer.
const NAME: &str = "arx";

/// Rows that are gathered before their products are summed.
const AT_ONCE: usize = 512;

/// The equation of one output.
#[derive(Clone, Debug)]
struct Equation {
    output: usize,
    offset: f64,
    /// a_l, for the lags from 1.
    past: Vec<f64>,
    /// b_{i,l}, inputs of one lag together, for the lags from 0.
    driven: Vec<f64>,
}

impl Equation {
    /// The output from the measured first outputs on, without any later one.
    fn simulate(&self, experiment: &Experiment) -> Vec<f64> {
        let measured = experiment.output.column(self.output);
        let inputs = experiment.input.ncols();
        let mut simulated: Vec<f64> = measured.iter().copied().take(self.past.len()).collect();
        for k in simulated.len()..experiment.input.nrows() {
            let mut y = self.offset;
            for (a, lag) in self.past.iter().zip(1..) {
                y += a * simulated[k - lag];
            }
            for (n, b) in self.driven.iter().enumerate() {
                y += b * experiment.input[(k.saturating_sub(n / inputs), n % inputs)];
            }
            simulated.push(y);
        }
        simulated
    }

    /// Whether all poles lie inside the unit circle: every reflection coefficient is below one (Schur and Cohn).
    fn is_stable(&self) -> bool {
        let mut a: Vec<f64> = self.past.iter().map(|a| -a).collect();
        while let Some(last) = a.pop() {
            if last.is_nan() || last.abs() >= 1.0 {
                return false;
            }
            let scale = 1.0 / (1.0 - last * last);
            let reversed: Vec<f64> = a.iter().rev().copied().collect();
            for (a, mirrored) in a.iter_mut().zip(reversed) {
                *a = scale * (*a - last * mirrored);
            }
        }
        true
    }
}

pub(super) fn fit(record: &Record, policy: &RivalPolicy) -> Option<Model> {
    let outputs = record.outputs().len();
    let equations: Vec<Equation> =
        (0..outputs).map(|output| best(record, output, policy)).collect::<Option<_>>()?;
    let orders = |one: &Equation| {
        let lags = one.driven.len() / record.inputs().len() - 1;
        format!("{} past outputs, {lags} past inputs", one.past.len())
    };
    let detail = equations.iter().map(orders).collect::<Vec<_>>().join("; ");
    Some(Model {
        name: NAME,
        detail,
        simulate: Box::new(move |record| {
            let one = |experiment: &Experiment| {
                let columns = equations.iter().map(|e| DVector::from_vec(e.simulate(experiment)));
                Matrix::from_columns(&columns.collect::<Vec<_>>())
            };
            record.experiments().iter().map(one).collect()
        }),
    })
}

/// The equation of an output with the smallest simulation error on the training data.
fn best(record: &Record, output: usize, policy: &RivalPolicy) -> Option<Equation> {
    let inputs = record.inputs().len();
    let most = [&policy.past_outputs[..], &policy.past_inputs].map(|all| all.iter().copied().max());
    let (most_outputs, most_inputs) = (most[0]?, most[1]?);
    let (sums, samples) = one_step(record, output, most_outputs, most_inputs);
    let mut found: Option<(f64, Equation)> = None;
    for &past in &policy.past_outputs {
        for &driven in &policy.past_inputs {
            let unknowns = 1 + past + (driven + 1) * inputs;
            if samples < policy.for_each * unknowns {
                continue;
            }
            let kept: Vec<usize> = (0..=past)
                .chain((0..(driven + 1) * inputs).map(|n| 1 + most_outputs + n))
                .collect();
            let gram = Matrix::from_fn(unknowns, unknowns, |i, j| sums.gram[(kept[i], kept[j])]);
            let right = DVector::from_fn(unknowns, |i, _| sums.rhs[(kept[i], 0)]);
            let free = DVector::from_element(unknowns, f64::INFINITY);
            let x = bounded(&gram.into(), &right, &-&free, &free);
            let equation = Equation {
                output,
                offset: x[0],
                past: x.rows(1, past).iter().copied().collect(),
                driven: x.rows(1 + past, unknowns - 1 - past).iter().copied().collect(),
            };
            if !equation.is_stable() {
                continue;
            }
            let squares = training_squares(record, &equation);
            // worse than a constant: it says nothing
            let least = found.as_ref().map_or(record.scored() as f64, |(least, _)| *least);
            if squares < (1.0 - policy.higher_order) * least {
                found = Some((squares, equation));
            }
        }
    }
    found.map(|(_, equation)| equation)
}

/// Sums over the samples whose past is scored: 1, past outputs, present and past inputs; and how many samples there are.
fn one_step(
    record: &Record,
    output: usize,
    outputs: usize,
    lags: usize,
) -> (NormalEquations, usize) {
    let inputs = record.inputs().len();
    let width = 1 + outputs + (lags + 1) * inputs;
    let mut sums = NormalEquations::zeros(width, 1);
    let mut samples = 0;
    for experiment in record.experiments() {
        let measured = experiment.output.column(output);
        for run in experiment.scored_runs() {
            let places: Vec<usize> = run.skip(outputs.max(lags)).collect();
            for places in places.chunks(AT_ONCE) {
                let regressor = Matrix::from_fn(width, places.len(), |row, n| match row {
                    0 => 1.0,
                    row if row <= outputs => measured[places[n] - row],
                    row => {
                        let place = row - 1 - outputs;
                        experiment.input[(places[n] - place / inputs, place % inputs)]
                    }
                });
                let target = Matrix::from_fn(1, places.len(), |_, n| measured[places[n]]);
                sums.add(&regressor, &target);
                samples += places.len();
            }
        }
    }
    (sums, samples)
}

fn training_squares(record: &Record, equation: &Equation) -> f64 {
    let of = |experiment: &Experiment| {
        let simulated = equation.simulate(experiment);
        let measured = experiment.output.column(equation.output);
        let error = |k: usize| (measured[k] - simulated[k]).powi(2);
        experiment.scored_runs().flatten().map(error).sum::<f64>()
    };
    record.experiments().iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stability_is_that_of_the_poles() {
        let equation = |past: &[f64]| Equation {
            output: 0,
            offset: 0.0,
            past: past.to_vec(),
            driven: vec![1.0],
        };
        // a pair of poles with radius r and angle 0.4, and a real pole
        let pair = |r: f64| [2.0 * r * 0.4_f64.cos(), -r * r];
        let with_pole = |[a, b]: [f64; 2], pole: f64| [a + pole, b - a * pole, -b * pole];
        assert!(equation(&pair(0.999)).is_stable());
        assert!(!equation(&pair(1.001)).is_stable());
        assert!(equation(&with_pole(pair(0.9), -0.99)).is_stable());
        assert!(!equation(&with_pole(pair(0.9), 1.01)).is_stable());
        assert!(!equation(&[1.0]).is_stable(), "an integrator");
    }
}
