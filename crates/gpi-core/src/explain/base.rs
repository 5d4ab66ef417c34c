//! A fitted model that candidates are compared with: its signals, residuals and sensitivities.
//!
//! With J the sensitivities of the weighted residuals by all p unknowns, the Gram matrix `J' J` is scaled to a unit
//! diagonal, `S J' J S`, and decomposed into eigenvectors V and eigenvalues. Unknowns that stand at a bound are left
//! out, and so are directions whose eigenvalue is rounding. `W = S V diag(eigenvalues)^(-1/2)` then satisfies
//! `W W' = (J' J)^+`, so that `I - J W W' J'` projects off all that the model itself can do.

use super::policy::score::RANK;
use crate::chain::free_run::Signals;
use crate::chain::point::{Freedom, Point};
use crate::chain::table::{Group, Table};
use crate::effects::Situation;
use crate::fit::problem::Estimation;
use crate::optimize::{LeastSquares, Linearization, Loss};
use crate::uncertainty::covariance::descending_eigen;
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
            dynamics: &self.point.dynamics,
            loops: self.point.loops().collect(),
            widest: widest.collect(),
        })
    }
}
