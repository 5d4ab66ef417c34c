//! Isolated wrong samples in a residual.

use crate::{Matrix, Record};

/// Median absolute deviation over that of a Gaussian: a standard deviation that a few wrong samples do
/// not move.
pub(super) fn robust_deviation(values: impl Iterator<Item = f64>) -> f64 {
    const GAUSSIAN: f64 = 1.482_602_218_505_602;
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    GAUSSIAN * *median
}

/// The robust standard deviation of each output's scored residual.
pub(super) fn deviations(residuals: &[Matrix], record: &Record) -> Vec<f64> {
    let outputs = record.outputs().len();
    let scored = |output: usize| {
        residuals.iter().zip(record.experiments()).flat_map(move |(residual, experiment)| {
            (experiment.warmup..residual.nrows()).map(move |k| residual[(k, output)])
        })
    };
    (0..outputs).map(|output| robust_deviation(scored(output))).collect()
}

/// How many scored samples stand apart from their four neighbours' median by more than six robust
/// standard deviations of that difference. Slow or structured residuals have none.
pub(super) fn count(residuals: &[Matrix], record: &Record) -> usize {
    const APART: f64 = 6.0;
    let mut found = 0;
    for output in 0..record.outputs().len() {
        let mut differences = Vec::new();
        for (residual, experiment) in residuals.iter().zip(record.experiments()) {
            for k in experiment.warmup + 2..residual.nrows().saturating_sub(2) {
                let mut beside =
                    [-2_isize, -1, 1, 2].map(|lag| residual[(k.wrapping_add_signed(lag), output)]);
                beside.sort_by(f64::total_cmp);
                differences.push(residual[(k, output)] - 0.5 * (beside[1] + beside[2]));
            }
        }
        let limit = APART * robust_deviation(differences.iter().copied());
        found += differences.iter().filter(|difference| difference.abs() > limit).count();
    }
    found
}
