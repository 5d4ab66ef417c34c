//! Whether the residual follows the input's past differently where the input's amplitude is larger.
//!
//! With rows phi(k) of what is alike at all amplitudes (levels and steps of u and v at many lags, one constant for each
//! contrast and one for all) and the contrasts `q_l(k) = c(k) f_l(k)`, where f_0 is the level of u and f_l a step of its past,
//! two regressions give
//!
//! ```text
//! e~ = e - phi' beta,   q~_l = q_l - phi' gamma_l,      t_l of the block sums of q~_l(k) e~(k)
//! ```
//!
//! By the theorem of R. Frisch and F. V. Waugh (1933), `sum q~_l e~ / sum q~_l^2` is the coefficient of q_l in a regression of
//! e on phi and q_l together: by how much more e follows f_l at large amplitudes than at small ones, half the difference of
//! its slopes there. Both regressions have the same matrix `sum phi phi'`; a second pass over the record forms the products.
//! The t of [`BlockSums::t`] holds for autocorrelated noise, which the usual standard error of a coefficient does not.

use super::compared::Compared;
use super::families::{ScaledSignal, ScaledSignals, Signal};
use super::independence::{BlockSums, dependence};
use super::outcome::{ResidualTest, points_to};
use super::policy::ResidualPolicy;
use crate::Matrix;
use nalgebra::DVector;

/// Compares the dynamics between levels of amplitude.
///
/// The scored samples are cut into three groups of equal energy by the local amplitude of an input: small,
/// middle, large. In each, the residual may follow u and its steps `du(k - lag)` with slopes of its own.
/// With c = -1, 0, 1 in the three groups, the contrast `c du(k - lag)`, without what the past of u and v and
/// a constant in each group explain of it, averages to zero with any residual whose slopes are equal in
/// all groups, missing linear dynamics included. Its product with the residual, from which the same was
/// taken, is summed over blocks for a t that noise of any autocorrelation leaves small.
pub(super) fn level_to_level(
    given: &Compared,
    output: usize,
    signals: &ScaledSignals,
    significance: f64,
) -> ResidualTest {
    let contrasts: Vec<Signal> = signals.inputs.iter().map(|u| contrast(given, u)).collect();
    let each = slopes(given, output, signals, &contrasts).unwrap_or_default();
    let (name, policy) = ("level-to-level", given.policy);
    dependence(name, points_to(name, ""), output, &each, significance, policy)
}

/// Minus one where the amplitude is small, one where it is large: each the samples of a third of its energy.
fn contrast(given: &Compared, input: &ScaledSignal) -> Signal {
    let mut scored: Vec<f64> = given.scored().map(|(e, k)| input.amplitude[e][k]).collect();
    scored.sort_by(f64::total_cmp);
    let total: f64 = scored.iter().sum();
    let limit = |share: f64| {
        let mut energy = 0.0;
        let reached = scored.iter().find(|amplitude| {
            energy += **amplitude;
            energy >= share * total
        });
        reached.copied().unwrap_or(0.0)
    };
    let (small, large) = (limit(1.0 / 3.0), limit(2.0 / 3.0));
    let group =
        |amplitude: &f64| f64::from(i8::from(*amplitude > large) - i8::from(*amplitude <= small));
    input.amplitude.iter().map(|amplitudes| amplitudes.iter().map(group).collect()).collect()
}

/// The t of every contrast; `None` where the regression has no solution.
fn slopes(
    given: &Compared,
    output: usize,
    signals: &ScaledSignals,
    contrasts: &[Signal],
) -> Option<Vec<f64>> {
    let ResidualPolicy { compared: lags, alike: all, ridge, .. } = given.policy;
    let inputs = signals.inputs.len();
    let rows = 2 * inputs * (1 + all.len()) + inputs + 1;
    let alike = |e: usize, k: usize, row: &mut DVector<f64>| {
        let both = signals.inputs.iter().chain(&signals.intermediates);
        let past = both.flat_map(|signal| signal.past(e, k, all));
        let groups = contrasts.iter().map(|c| c[e][k]).chain(std::iter::once(1.0));
        row.iter_mut().zip(past.chain(groups)).for_each(|(place, value)| *place = value);
    };
    // the residual, then what is compared
    let compared = inputs * (1 + lags.len());
    let tested = |e: usize, k: usize, values: &mut DVector<f64>| {
        let own = std::iter::once(given.residuals[e][(k, output)]);
        let pairs = signals.inputs.iter().zip(contrasts);
        let contrasted =
            pairs.flat_map(|(input, c)| input.past(e, k, lags).map(move |value| c[e][k] * value));
        values.iter_mut().zip(own.chain(contrasted)).for_each(|(place, value)| *place = value);
    };
    let (mut phi, mut values) = (DVector::zeros(rows), DVector::zeros(1 + compared));
    let mut gram = Matrix::zeros(rows, rows);
    let mut cross = Matrix::zeros(rows, 1 + compared);
    for (e, k) in given.scored() {
        alike(e, k, &mut phi);
        tested(e, k, &mut values);
        gram.syger(1.0, &phi, &phi, 1.0);
        cross.ger(1.0, &phi, &values, 1.0);
    }
    let coefficients = solve(gram, cross, *ridge)?;
    let scored = given.record.scored();
    let blocks =
        (scored / given.policy.block).clamp(given.policy.fewest_blocks, given.policy.most_blocks);
    let mut sums: Vec<BlockSums> = (0..compared).map(|_| BlockSums::new(scored, blocks)).collect();
    for (e, k) in given.scored() {
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
fn solve(mut gram: Matrix, right: Matrix, ridge: f64) -> Option<Matrix> {
    let scale = gram.diagonal().max();
    for i in 0..gram.nrows() {
        gram[(i, i)] += ridge * (gram[(i, i)] + ridge * scale);
    }
    gram.cholesky().map(|factors| factors.solve(&right))
}
