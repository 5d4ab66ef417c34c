//! Isolated wrong samples replaced, so that no fit has to follow them.
//!
//! A wrong sample of output y at k becomes `y(k) + (e(k-1) + e(k+1)) / 2 - e(k)`, with the residual e of the present
//! model. Its new residual is the mean of those of its neighbours, so that a smooth error of the model is kept and the
//! sample counts as one of average misfit. Samples are replaced and not left out, because filters and runs need them
//! without gaps.

use crate::{Error, Matrix, Record};

/// The record with samples at `places` (`[experiment][output]`) set to what gives them the mean residual of their
/// two neighbours.
pub(super) fn repaired(
    record: &Record,
    residuals: &[Matrix],
    places: &[Vec<Vec<usize>>],
) -> Result<Record, Error> {
    let mut experiments = record.experiments().to_vec();
    for ((experiment, residual), places) in experiments.iter_mut().zip(residuals).zip(places) {
        for (output, places) in places.iter().enumerate() {
            for &k in places {
                let beside = 0.5 * (residual[(k - 1, output)] + residual[(k + 1, output)]);
                experiment.output[(k, output)] += beside - residual[(k, output)];
            }
        }
    }
    record.with_experiments(experiments)
}

/// The record with nothing held out.
pub(super) fn everything(record: &Record) -> Result<Record, Error> {
    let mut experiments = record.experiments().to_vec();
    experiments.iter_mut().for_each(|experiment| experiment.held_out.clear());
    record.with_experiments(experiments)
}
