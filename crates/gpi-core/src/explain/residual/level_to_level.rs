//! Whether the residual follows the input's past differently where the input swings more.

use super::families::{Moving, Signal, Signals};
use super::independence::{BlockSums, dependence};
use super::{Beside, ResidualTest};
use crate::Matrix;
use nalgebra::DVector;

/// Lags whose slopes are compared.
const COMPARED: [usize; 7] = [0, 1, 2, 4, 8, 16, 32];

/// Lags of what is alike in all groups: a residual of any linear dynamics that is not too long.
const ALIKE: [usize; 26] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 20, 24, 28, 32, 40, 48, 64, 96, 128];

/// Compares the dynamics between levels of swing.
///
/// The scored samples are cut into three groups of equal energy by the local swing of an input: small,
/// middle, large. In each, the residual may follow u and its steps `du(k - lag)` with slopes of its own.
/// With c = -1, 0, 1 in the three groups, the contrast `c du(k - lag)`, without what the past of u and v and
/// a constant in each group explain of it, averages to zero with any residual whose slopes are equal in
/// all groups, missing linear dynamics included. Its product with the residual, from which the same was
/// taken, is summed over blocks for a t that noise of any colour leaves small.
pub(super) fn level_to_level(
    beside: &Beside,
    output: usize,
    signals: &Signals,
    chance: f64,
) -> ResidualTest {
    let contrasts: Vec<Signal> = signals.inputs.iter().map(|u| contrast(beside, u)).collect();
    let each = slopes(beside, output, signals, &contrasts).unwrap_or_default();
    dependence("level-to-level", "stiffness", output, &each, chance)
}

/// Minus one where the swing is small, one where it is large: each the samples of a third of its energy.
fn contrast(beside: &Beside, input: &Moving) -> Signal {
    let mut scored: Vec<f64> = beside.scored().map(|(e, k)| input.swing[e][k]).collect();
    scored.sort_by(f64::total_cmp);
    let total: f64 = scored.iter().sum();
    let limit = |share: f64| {
        let mut energy = 0.0;
        let reached = scored.iter().find(|swing| {
            energy += **swing;
            energy >= share * total
        });
        reached.copied().unwrap_or(0.0)
    };
    let (small, large) = (limit(1.0 / 3.0), limit(2.0 / 3.0));
    let group = |swing: &f64| f64::from(i8::from(*swing > large) - i8::from(*swing <= small));
    input.swing.iter().map(|swings| swings.iter().map(group).collect()).collect()
}

/// Samples of a block, and how many blocks: more than elsewhere, since large swings fill a few only.
const BLOCK: usize = 40;
const FEWEST: usize = 40;
const MOST: usize = 100;

/// The t of every contrast; `None` where the regression has no solution.
fn slopes(
    beside: &Beside,
    output: usize,
    signals: &Signals,
    contrasts: &[Signal],
) -> Option<Vec<f64>> {
    let inputs = signals.inputs.len();
    let rows = 2 * inputs * (1 + ALIKE.len()) + inputs + 1;
    let alike = |e: usize, k: usize, row: &mut DVector<f64>| {
        let both = signals.inputs.iter().chain(&signals.intermediates);
        let past = both.flat_map(|signal| signal.past(e, k, &ALIKE));
        let groups = contrasts.iter().map(|c| c[e][k]).chain(std::iter::once(1.0));
        row.iter_mut().zip(past.chain(groups)).for_each(|(place, value)| *place = value);
    };
    // the residual, then what is compared
    let compared = inputs * (1 + COMPARED.len());
    let tested = |e: usize, k: usize, values: &mut DVector<f64>| {
        let own = std::iter::once(beside.residuals[e][(k, output)]);
        let pairs = signals.inputs.iter().zip(contrasts);
        let contrasted = pairs
            .flat_map(|(input, c)| input.past(e, k, &COMPARED).map(move |value| c[e][k] * value));
        values.iter_mut().zip(own.chain(contrasted)).for_each(|(place, value)| *place = value);
    };
    let (mut phi, mut values) = (DVector::zeros(rows), DVector::zeros(1 + compared));
    let mut gram = Matrix::zeros(rows, rows);
    let mut cross = Matrix::zeros(rows, 1 + compared);
    for (e, k) in beside.scored() {
        alike(e, k, &mut phi);
        tested(e, k, &mut values);
        gram.syger(1.0, &phi, &phi, 1.0);
        cross.ger(1.0, &phi, &values, 1.0);
    }
    let coefficients = solve(gram, cross)?;
    let scored = beside.record.scored();
    let blocks = (scored / BLOCK).clamp(FEWEST, MOST);
    let mut sums: Vec<BlockSums> = (0..compared).map(|_| BlockSums::of(scored, blocks)).collect();
    for (e, k) in beside.scored() {
        alike(e, k, &mut phi);
        tested(e, k, &mut values);
        values.gemv_tr(-1.0, &coefficients, &phi, 1.0);
        for (sum, contrast) in sums.iter_mut().zip(values.iter().skip(1)) {
            sum.add(contrast * values[0]);
        }
    }
    Some(sums.iter().map(BlockSums::t).collect())
}

/// Solves normal equations whose unknowns the data may leave open.
fn solve(mut gram: Matrix, right: Matrix) -> Option<Matrix> {
    /// Of each diagonal element; far below any dependence that matters, far above rounding.
    const RIDGE: f64 = 1e-10;
    let scale = gram.diagonal().max();
    for i in 0..gram.nrows() {
        gram[(i, i)] += RIDGE * (gram[(i, i)] + RIDGE * scale);
    }
    gram.cholesky().map(|factors| factors.solve(&right))
}
