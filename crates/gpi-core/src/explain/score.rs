//! The score (Lagrange multiplier) test: what a candidate would explain, without fitting it.
//!
//! A candidate's probes change the output by columns C, linearly as long as the changes are small. If e is the
//! residual, a joint fit of C and of the model's own unknowns would lower the squared residual, to first order, by the
//! part
//!
//! `gain = s' L^-1 s / c`, with `L = C~' C~`, `s = C~' e`, `C~ = (I - J J^+) C`
//!
//! and c what the model itself, fully converged, would leave ([`Projection`]). It is (T7) in the documentation's
//! theory. The solution `L^-1 s` gives the candidate's parameters to start a fit from. Because all candidates are
//! compared with the same J, the catalogue is ranked without a single fit.
//!
//! Derivation: the joint fit minimises `|e - J a - C b|^2` over a (p) and b (n). For fixed b, the best a leaves
//! `|(I - Q)(e - C b)|^2 = c - 2 b' s + b' L b`, Q = J J^+. Its minimum over b is at `L b = s`, where it has fallen by
//! `s' L^-1 s`. It is the score statistic over N (C. R. Rao, *Large sample tests of statistical hypotheses concerning
//! several parameters*, 1948): in the absence of the effect, N gain is asymptotically chi-square with rank(L) degrees
//! of freedom.
//!
//! The approximation is the linearity in b. A probe is linear in its value where the proposal says so; elsewhere each
//! proposal is one grid value of a parameter that is not linear (a time constant, a half-width), and the best of the
//! grid counts.
//!
//! L is solved in eigenvectors after scaling to a unit diagonal, and directions with eigenvalues below [`OWN_RANK`] are
//! left out: probes of one candidate may do the same. A probe of which the model does all but the part [`LEFT`] is not
//! used.

use super::base::Base;
use super::policy::score::{AT_ONCE, LEFT, MANY, OWN_RANK};
use super::projection::Projection;
use crate::chain::free_run::Signals;
use crate::effects::{Effect, Place, Proposal};
use crate::parallel::install;
use crate::uncertainty::eigen::descending_eigen;
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;
use rayon::prelude::*;

/// A candidate's score.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    /// The block with the values that the score test gives it.
    pub start: Effect,
    /// The block without effect, where it may start from there.
    pub zero: Option<Effect>,
    /// The part of the residual's sum of squares that it would take, 0 to 1.
    pub gain: f64,
    /// Columns that the base model does not absorb.
    pub columns: usize,
}

/// Scores candidates against a base point, as many at once as memory allows.
pub(crate) fn scores(
    base: &Base,
    candidates: &[Proposal<Effect>],
    check: &mut dyn FnMut(f64) -> Result<(), Error>,
) -> Result<Vec<Score>, Error> {
    let columns = (AT_ONCE / base.record.samples().max(1)).max(1);
    let mut scores = Vec::new();
    while let Some(first) = candidates.get(scores.len()) {
        check(scores.len() as f64 / candidates.len() as f64)?;
        let rest = &candidates[scores.len()..];
        let mut filled = first.probes.len();
        let fits = |candidate: &&Proposal<Effect>| {
            filled += candidate.probes.len();
            filled <= columns
        };
        let count = 1 + rest[1..].iter().take_while(fits).count();
        scores.extend(score(base, &rest[..count])?);
    }
    Ok(scores)
}

/// Scores of a few candidates.
fn score(base: &Base, candidates: &[Proposal<Effect>]) -> Result<Vec<Score>, Error> {
    if let [candidate] = candidates
        && candidate.probes.len() > MANY
        && let Some(projection) = base.loops_projected(candidate)?
    {
        return Ok(vec![scored(candidate, 0, &projection)]);
    }
    let probes: Vec<usize> = candidates.iter().map(|candidate| candidate.probes.len()).collect();
    let columns = |known: &Signals, here: &Matrix, experiment: &Experiment, index: usize| {
        let of = |candidate| columns(base, candidate, known, here, experiment, index);
        let columns: Result<Vec<_>, Error> = install(|| candidates.par_iter().map(of).collect());
        Ok(columns?.into_iter().flatten().collect())
    };
    let projection = base.project(&probes, &columns)?;
    let mut first = 0;
    let place = |candidate: &Proposal<Effect>| {
        first += candidate.probes.len();
        scored(candidate, first - candidate.probes.len(), &projection)
    };
    Ok(candidates.iter().map(place).collect())
}

/// What the output gains by each probe of a candidate; `here` is the output.
fn columns(
    base: &Base,
    candidate: &Proposal<Effect>,
    known: &Signals,
    here: &Matrix,
    experiment: &Experiment,
    index: usize,
) -> Result<Vec<Matrix>, Error> {
    if candidate.linear
        && let Place::Curves(block) = candidate.block.place()
    {
        let point = base.point.with_effect(candidate.block.clone());
        let Some(place) = point.effects.iter().position(|own| *own == candidate.block) else {
            return Ok(Vec::new());
        };
        let columns = point.columns_of(place, known, here, experiment, index)?;
        return Ok(columns.into_iter().zip(block.steps()).map(|(c, step)| c * step).collect());
    }
    let gained = |probe: &Effect| base.point.gained_by(probe, known, here, experiment, index);
    install(|| candidate.probes.par_iter().map(gained).collect())
}

/// The score of a candidate whose columns begin at `first`.
fn scored(candidate: &Proposal<Effect>, first: usize, projection: &Projection) -> Score {
    let Projection { left, score, squares, cost } = projection;
    let places: Vec<usize> = (first..first + candidate.probes.len())
        .filter(|&i| left[(i, i)] > LEFT * squares[i])
        .collect();
    let own = Matrix::from_fn(places.len(), places.len(), |i, j| left[(places[i], places[j])]);
    let rhs = DVector::from_fn(places.len(), |i, _| score[places[i]]);
    let solution = solve_scaled(own, &rhs);
    let gain = solution.dot(&rhs) / cost.max(f64::MIN_POSITIVE);
    let mut coefficients = vec![0.0; candidate.probes.len()];
    for (value, &place) in solution.iter().zip(&places) {
        coefficients[place - first] = *value;
    }
    Score {
        start: candidate.start(&coefficients),
        zero: candidate.linear.then(|| candidate.block.clone()),
        gain: gain.clamp(0.0, 1.0),
        columns: places.len(),
    }
}

/// The least squares solution of symmetric equations, directions without power left out: with `S = diag(M_ii^(-1/2))` and
/// `S M S = V diag(lambda) V'`, it is `S V diag(1 / lambda) V' S rhs` over the lambda that are large enough.
fn solve_scaled(matrix: Matrix, rhs: &DVector<f64>) -> DVector<f64> {
    let n = matrix.nrows();
    if n == 0 {
        return DVector::zeros(0);
    }
    let scale = matrix.diagonal().map(|value| value.sqrt().max(f64::MIN_POSITIVE));
    let scaled = Matrix::from_fn(n, n, |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let (values, vectors) = descending_eigen(scaled);
    let mut solution = DVector::zeros(n);
    let rhs = rhs.component_div(&scale);
    for (place, &value) in values.iter().enumerate().take_while(|(_, v)| **v > OWN_RANK) {
        let vector = vectors.column(place);
        solution += vector * (vector.dot(&rhs) / value);
    }
    solution.component_div(&scale)
}
