//! What loops around G with several inputs and outputs may go through.

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

    /// Root mean square, without the mean.
    pub(super) fn rms(&self) -> f64 {
        self.values.column(0).variance().sqrt()
    }
}

/// The families of signals to be tried, one after the other.
pub(super) fn families(situation: &Situation) -> [Vec<LoopSignal>; 4] {
    let displaced = displaced(situation);
    let (apart, together) = (pairs(&displaced, -1.0), pairs(&displaced, 1.0));
    [displaced, driven(situation), apart, together]
}

/// The v that would hold each displacement still: `G(1)^-1 (C x + D v)`.
fn displaced(situation: &Situation) -> Vec<LoopSignal> {
    /// Combinations of outputs with less gain than this part of the largest are not seen.
    const RANK: f64 = 1e-6;
    let dynamics = situation.dynamics;
    let dc = dynamics.dc_gain();
    let Ok(inverse) = dc.clone().pseudo_inverse(RANK * dc.norm()) else { return Vec::new() };
    let (states, inputs) = (&inverse * dynamics.c(), &inverse * &dynamics.d);
    let values = stacked(situation.displacements) * inverse.transpose();
    signals(&states, &inputs, &values)
}

/// Each v: what the input does to the mechanics by itself.
fn driven(situation: &Situation) -> Vec<LoopSignal> {
    let count = situation.inputs().len();
    let states = Matrix::zeros(count, situation.dynamics.order());
    signals(&states, &Matrix::identity(count, count), &stacked(situation.intermediates))
}

/// Sums or differences of neighbours, around.
fn pairs(signals: &[LoopSignal], sign: f64) -> Vec<LoopSignal> {
    let count = signals.len();
    // of two, each is the other's neighbour on both sides
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

/// All experiments below each other.
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
