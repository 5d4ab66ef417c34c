//! Signals of loops around a G with several inputs and outputs.

use super::{Sees, Situation};
use crate::Matrix;

/// `z = S x + T v`.
#[derive(Clone)]
pub(super) struct LoopSignal {
    /// A row of S.
    states: Matrix,
    /// A row of T.
    inputs: Matrix,
    /// z of all experiments, one after the other.
    values: Matrix,
}

impl LoopSignal {
    pub(super) fn sees(&self) -> Sees {
        let row = |matrix: &Matrix| matrix.iter().copied().collect();
        Sees::Mixture { states: row(&self.states), inputs: row(&self.inputs) }
    }

    /// Standard deviation.
    pub(super) fn rms(&self) -> f64 {
        self.values.column(0).variance().sqrt()
    }
}

/// The kind of law of the loops.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Hysteresis.
    Stops,
    /// A force that differs between the two directions.
    Square,
}

/// The families of loops that were not tried yet: the next signals for hysteresis, and squares.
pub(super) fn families(situation: &Situation) -> Vec<(Shape, Vec<LoopSignal>)> {
    let displaced = displaced(situation);
    let (apart, together) = (pairs(&displaced, -1.0), pairs(&displaced, 1.0));
    let count = |has_stops: bool| {
        situation.loops.iter().filter(|inner| inner.law.has_memory() == has_stops).count()
    };
    // a family follows when all loops of the one before are in the model
    let mut known = 0;
    let next =
        [displaced.clone(), driven(situation), apart, together].into_iter().find(|signals| {
            known += signals.len();
            count(true) < known
        });
    let squares = (count(false) == 0).then_some((Shape::Square, displaced));
    next.map(|signals| (Shape::Stops, signals)).into_iter().chain(squares).collect()
}

/// The v that gives each displacement in steady state: `G(1)^-1 (C x + D v)`.
fn displaced(situation: &Situation) -> Vec<LoopSignal> {
    /// Combinations of outputs with a smaller gain, relative to the largest, are left out.
    const RANK: f64 = 1e-6;
    let dynamics = situation.dynamics;
    let dc = dynamics.dc_gain();
    let Ok(inverse) = dc.clone().pseudo_inverse(RANK * dc.norm()) else { return Vec::new() };
    let (states, inputs) = (&inverse * dynamics.c(), &inverse * &dynamics.d);
    let values = stacked(situation.displacements) * inverse.transpose();
    signals(&states, &inputs, &values)
}

/// Each v, the drive of the mechanics.
fn driven(situation: &Situation) -> Vec<LoopSignal> {
    let count = situation.inputs().len();
    let states = Matrix::zeros(count, situation.dynamics.order());
    signals(&states, &Matrix::identity(count, count), &stacked(situation.intermediates))
}

/// Sums or differences of neighbours; the last one's neighbour is the first.
fn pairs(signals: &[LoopSignal], sign: f64) -> Vec<LoopSignal> {
    let count = signals.len();
    // two signals have one pair
    let pairs = if count > 2 { count } else { count / 2 };
    let pair = |i: usize| {
        let (one, other) = (&signals[i], &signals[(i + 1) % count]);
        LoopSignal {
            states: &one.states + sign * &other.states,
            inputs: &one.inputs + sign * &other.inputs,
            values: &one.values + sign * &other.values,
        }
    };
    (0..pairs).map(pair).collect()
}

fn signals(states: &Matrix, inputs: &Matrix, values: &Matrix) -> Vec<LoopSignal> {
    let signal = |i: usize| LoopSignal {
        states: states.rows(i, 1).into_owned(),
        inputs: inputs.rows(i, 1).into_owned(),
        values: values.columns(i, 1).into_owned(),
    };
    (0..values.ncols()).map(signal).collect()
}

/// All experiments, one below the other.
fn stacked(signals: &[Matrix]) -> Matrix {
    let rows = signals.iter().map(Matrix::nrows).sum();
    let mut stacked = Matrix::zeros(rows, signals.first().map_or(0, Matrix::ncols));
    let mut first = 0;
    for signal in signals {
        stacked.rows_mut(first, signal.nrows()).copy_from(signal);
        first += signal.nrows();
    }
    stacked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{model, record, run};
    use crate::chain::point::{DynamicsFreedom, Freedom};
    use crate::chain::sensitivity::Derivatives;
    use crate::effects::Effect;
    use crate::explain::base::Base;
    use crate::fit::preparation::Prepared;
    use crate::optimize::Loss;

    fn next(model: &Model) -> Vec<(bool, Vec<f64>)> {
        let record = record(model, vec![run(1.5, 0.0, 100, vec![])]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let point = prepared.point_of(model).unwrap();
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives: Derivatives { thresholds: false, half_widths: false, starts: false },
            states: false,
            identity: true,
            dynamics: DynamicsFreedom::Everything,
        };
        let loss = Loss::squares(2);
        let base = Base::new(&point, &prepared.record, freedom, &loss).unwrap();
        base.situation(|situation| {
            let inputs = |signal: &LoopSignal| signal.inputs.row(0).iter().copied().collect();
            let found = families(situation).into_iter();
            found.map(|(shape, signals)| (shape == Shape::Stops, inputs(&signals[1]))).collect()
        })
    }

    #[test]
    fn displacements_come_first_and_squares_once() {
        let model = model();
        let plain = model.clone().with_effects(vec![]).unwrap();
        let found = next(&plain);
        assert_eq!(found.iter().map(|family| family.0).collect::<Vec<_>>(), [true, false]);
        assert_eq!(found[0].1, found[1].1, "both of the displacements");
        // with two loops that have a memory and one of a power, the next signals are v
        let mut effects = model.effects().to_vec();
        for effect in &mut effects {
            if let Effect::Stiffness(own) = effect {
                own.loops.truncate(3);
            }
        }
        let three = model.with_effects(effects).unwrap();
        assert_eq!(next(&three), [(true, vec![0.0, 1.0])]);
    }
}
