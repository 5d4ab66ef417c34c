//! Isolated wrong samples replaced, so that no fit has to follow them.

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
