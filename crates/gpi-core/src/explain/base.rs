//! A fitted model that candidates are compared with: its signals, residuals and sensitivities.
//!
//! With J (values, p) the sensitivities of the weighted output by all p unknowns and e (values) the weighted residual,
//! both from [`Estimation`], let H = `J' J` (p, p) and d = `J' e` (p) be its Gram matrix and its descent. A direction
//! that the data hardly determine has an eigenvalue of H near rounding, and units of different unknowns differ by many
//! orders of magnitude. H is therefore scaled to a unit diagonal and decomposed,
//!
//! ```text
//! S = diag(H_ii^(-1/2)),      S H S = V diag(lambda) V',      W = S V diag(lambda)^(-1/2)      (p, rank)
//! ```
//!
//! with the eigenvalues that exceed [`RANK`] times the largest. W whitens the sensitivities, `W' H W = I`, so that
//! `J W` is an orthonormal basis of what the model can do, and
//!
//! ```text
//! Q = J W W' J'      projects onto it,      |Q e|^2 = |W' d|^2.
//! ```
//!
//! Where all eigenvalues are kept, `W W' = H^-1`. Unknowns that stand at a bound are left out (their rows of W are
//! zero), because a step of both signs is not possible there. A direction that is left out counts as something that the
//! model cannot do. A unit step along it, in unknowns scaled by S, changes the output by less than
//! `sqrt(RANK lambda_max)`.

use super::policy::score::RANK;
use crate::chain::free_run::Signals;
use crate::chain::group::Group;
use crate::chain::point::{Freedom, Point};
use crate::chain::table::Table;
use crate::effects::Situation;
use crate::fit::problem::Estimation;
use crate::optimize::{LeastSquares, Linearization, Loss};
use crate::uncertainty::eigen::descending_eigen;
use crate::{Error, Matrix, Record};

/// A fitted point with its signals and its sensitivities' Gram matrix, ready to test candidates.
pub(crate) struct Base<'a> {
    pub point: &'a Point,
    pub record: &'a Record,
    pub freedom: Freedom,
    pub loss: &'a Loss,
    pub signals: Vec<Signals>,
    pub residuals: Vec<Matrix>,
    /// W, (unknowns, directions).
    pub(super) whitening: Matrix,
    pub(super) linearization: Linearization,
    pub(super) table: Table,
}

impl<'a> Base<'a> {
    /// Linearizes a fitted point.
    pub(crate) fn new(
        point: &'a Point,
        record: &'a Record,
        freedom: Freedom,
        loss: &'a Loss,
    ) -> Result<Self, Error> {
        Self::of(point, record, freedom, loss, |_| true)
    }

    /// Linearizes a fitted point; only the groups of parameters that `takes` accepts are what the model can do.
    pub(crate) fn of(
        point: &'a Point,
        record: &'a Record,
        freedom: Freedom,
        loss: &'a Loss,
        takes: impl Fn(Group) -> bool,
    ) -> Result<Self, Error> {
        let problem = Estimation::new(point, record, freedom, loss);
        let linearization = problem.linearize(point, &mut || Ok(()))?;
        let table = problem.table.clone();
        let mut free = problem.bounds(point).free();
        free.retain(|&unknown| table.at(unknown).is_some_and(|(group, _)| takes(group)));
        let gram = &linearization.gram;
        let scale: Vec<f64> =
            free.iter().map(|&i| gram.get(i, i).sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled = Matrix::from_fn(free.len(), free.len(), |i, j| {
            gram.get(free[i], free[j]) / (scale[i] * scale[j])
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
            let used = channel.half_widths.iter().zip(&channel.weights).filter(|(_, p)| **p != 0.0);
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
            dynamics: &self.point.dynamics,
            loops: self.point.loops().collect(),
            kind: self.point.output_kind(),
            widest: widest.collect(),
        })
    }
}
