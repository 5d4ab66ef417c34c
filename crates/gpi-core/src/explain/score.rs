//! The score (Lagrange multiplier) test: what a candidate would explain, without fitting it.

use super::projection::{LEFT, Projection};
use crate::chain::free_run::Signals;
use crate::chain::point::{Freedom, Point};
use crate::chain::table::Table;
use crate::effects::{Effect, Place, Proposal, Situation};
use crate::fit::problem::Estimation;
use crate::optimize::{LeastSquares, Linearization, Loss};
use crate::uncertainty::covariance::descending_eigen;
use crate::{Error, Experiment, Matrix, Record};
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

/// Tests candidates against a base point: every probe's column, projected off the base model's own
/// sensitivities, takes a part of what is left of the residual.
pub(crate) fn scores(
    base: &Base,
    candidates: &[Proposal<Effect>],
    check: &mut dyn FnMut(f64) -> Result<(), Error>,
) -> Result<Vec<Score>, Error> {
    /// Numbers that the columns held at once may take.
    const AT_ONCE: usize = 12_000_000;
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
        scores.extend(base.score(&rest[..count])?);
    }
    Ok(scores)
}

/// A fitted point with its signals and its sensitivities' Gram matrix, ready to test candidates.
pub(crate) struct Base<'a> {
    pub point: &'a Point,
    pub record: &'a Record,
    pub freedom: Freedom,
    pub loss: &'a Loss,
    pub signals: Vec<Signals>,
    pub residuals: Vec<Matrix>,
    /// Scaled eigenvectors of the Gram matrix of what is free, over the roots of their eigenvalues:
    /// `W W^T` is its inverse.
    pub(super) whitening: Matrix,
    pub(super) linearization: Linearization,
    pub(super) table: Table,
}

impl<'a> Base<'a> {
    pub(crate) fn new(
        point: &'a Point,
        record: &'a Record,
        freedom: Freedom,
        loss: &'a Loss,
    ) -> Result<Self, Error> {
        /// Directions with less power than this cannot be told from rounding.
        const RANK: f64 = 1e-11;
        let problem = Estimation::new(point, record, freedom, loss);
        let linearization = problem.linearize(point, &mut || Ok(()))?;
        let free = problem.bounds(point).free();
        let table = problem.table;
        let gram = &linearization.gram;
        let scale: Vec<f64> =
            free.iter().map(|&i| gram[(i, i)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled = Matrix::from_fn(free.len(), free.len(), |i, j| {
            gram[(free[i], free[j])] / (scale[i] * scale[j])
        });
        let (values, vectors) = descending_eigen(scaled);
        let largest = values.iter().copied().fold(0.0, f64::max);
        let rank = values.iter().take_while(|&&value| value > RANK * largest).count();
        let mut whitening = Matrix::zeros(table.len, rank);
        for (i, &row) in free.iter().enumerate() {
            for column in 0..rank {
                whitening[(row, column)] =
                    vectors[(i, column)] / (scale[i] * values[column].sqrt());
            }
        }
        let runs = record.experiments().iter().enumerate();
        let signals: Result<Vec<Signals>, Error> =
            runs.map(|(index, experiment)| point.signals(experiment, index)).collect();
        Ok(Self {
            signals: signals?,
            residuals: point.residuals(record)?,
            point,
            record,
            freedom,
            loss,
            whitening,
            linearization,
            table,
        })
    }

    /// Calls `ask` with what candidates are placed by.
    pub(crate) fn situation<T>(&self, ask: impl FnOnce(&Situation) -> T) -> T {
        let select = |choose: fn(&Signals) -> &Matrix| -> Vec<Matrix> {
            self.signals.iter().map(|signals| choose(signals).clone()).collect()
        };
        let widest = self.point.channels.iter().map(|channel| {
            let used = channel.half_widths.iter().zip(&channel.weights).filter(|(_, p)| **p > 0.0);
            used.map(|(r, _)| *r).fold(0.0, f64::max)
        });
        let drives = select(|signals| &signals.drive);
        let places = self.point.channels.iter().enumerate().map(|(input, channel)| {
            channel.envelope_range(drives.iter().flat_map(|drive| drive.column(input)).copied())
        });
        ask(&Situation {
            places: places.collect(),
            record: self.record,
            drives: &drives,
            intermediates: &select(|signals| &signals.intermediate),
            displacements: &select(|signals| &signals.displacement),
            residuals: &self.residuals,
            dynamics: &self.point.dynamics.own(),
            loops: self.point.loops().collect(),
            widest: widest.collect(),
        })
    }

    /// Scores of a few candidates.
    fn score(&self, candidates: &[Proposal<Effect>]) -> Result<Vec<Score>, Error> {
        /// Probes whose derivatives are faster all at once than one after the other.
        const MANY: usize = 50;
        if let [candidate] = candidates
            && candidate.probes.len() > MANY
            && let Some(projection) = self.loops_projected(candidate)?
        {
            return Ok(vec![scored(candidate, 0, &projection)]);
        }
        let probes = candidates.iter().map(|candidate| candidate.probes.len()).sum();
        let columns = |known: &Signals, here: &Matrix, experiment: &Experiment, index: usize| {
            let of = |candidate| self.columns(candidate, known, here, experiment, index);
            let columns: Result<Vec<_>, Error> = candidates.par_iter().map(of).collect();
            Ok(columns?.into_iter().flatten().collect())
        };
        let projection = self.project(probes, &columns)?;
        let mut first = 0;
        let place = |candidate: &Proposal<Effect>| {
            first += candidate.probes.len();
            scored(candidate, first - candidate.probes.len(), &projection)
        };
        Ok(candidates.iter().map(place).collect())
    }

    /// What the output gains by each probe of a candidate; `here` is the output.
    fn columns(
        &self,
        candidate: &Proposal<Effect>,
        known: &Signals,
        here: &Matrix,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Vec<Matrix>, Error> {
        if candidate.linear
            && let Place::Curves(block) = candidate.block.place()
        {
            let point = self.point.with_effect(candidate.block.clone());
            let Some(place) = point.effects.iter().position(|own| *own == candidate.block) else {
                return Ok(Vec::new());
            };
            let columns = point.columns_of(place, known, here, experiment, index)?;
            return Ok(columns.into_iter().zip(block.steps()).map(|(c, step)| c * step).collect());
        }
        let gained = |probe: &Effect| self.point.gained_by(probe, known, here, experiment, index);
        candidate.probes.par_iter().map(gained).collect()
    }
}

/// What a candidate would take, whose columns begin at `first`.
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

/// The least squares solution of symmetric equations, directions without power left out.
fn solve_scaled(matrix: Matrix, rhs: &DVector<f64>) -> DVector<f64> {
    const RANK: f64 = 1e-9;
    let n = matrix.nrows();
    if n == 0 {
        return DVector::zeros(0);
    }
    let scale = matrix.diagonal().map(|value| value.sqrt().max(f64::MIN_POSITIVE));
    let scaled = Matrix::from_fn(n, n, |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let (values, vectors) = descending_eigen(scaled);
    let mut solution = DVector::zeros(n);
    let rhs = rhs.component_div(&scale);
    for (place, &value) in values.iter().enumerate().take_while(|(_, v)| **v > RANK) {
        let vector = vectors.column(place);
        solution += vector * (vector.dot(&rhs) / value);
    }
    solution.component_div(&scale)
}
