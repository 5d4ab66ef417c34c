//! Isolated wrong samples in a residual.

use super::settings::OutlierSettings;
use crate::{Matrix, Record};

/// Median absolute deviation over that of a Gaussian: a standard deviation that a few wrong samples do
/// not move.
pub(crate) fn robust_deviation(values: impl Iterator<Item = f64>) -> f64 {
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
pub(crate) fn deviations(residuals: &[Matrix], record: &Record) -> Vec<f64> {
    let outputs = record.outputs().len();
    let scored = |output: usize| {
        residuals.iter().zip(record.experiments()).flat_map(move |(residual, experiment)| {
            experiment.scored_runs().flatten().map(move |k| residual[(k, output)])
        })
    };
    (0..outputs).map(|output| robust_deviation(scored(output))).collect()
}

/// How many scored samples of a residual are isolated outliers, see [`places`].
pub(crate) fn count(residuals: &[Matrix], record: &Record) -> usize {
    places(residuals, record, OutlierSettings::default().near).iter().flatten().map(Vec::len).sum()
}

/// The scored samples of signals (samples, outputs) that are isolated outliers, `[experiment][output]`.
///
/// A sample is one when it differs from the median of its four neighbours by more than six robust
/// standard deviations of such differences, and by four times more than the samples around
/// (but for `near` of them, which may be wrong themselves): slow or structured signals have none, however
/// rough, and the fewer the smaller `near` is.
pub(crate) fn places(signals: &[Matrix], record: &Record, near: usize) -> Vec<Vec<Vec<usize>>> {
    let OutlierSettings { apart: far, alone: factor, around: reach, .. } = Default::default();
    let mut found = vec![vec![Vec::new(); record.outputs().len()]; signals.len()];
    for output in 0..record.outputs().len() {
        let differences: Vec<Vec<f64>> =
            signals.iter().map(|signal| apart(signal.column(output).as_slice())).collect();
        let scored = differences.iter().zip(record.experiments()).flat_map(|(values, e)| {
            e.scored_runs().flatten().filter_map(|k| values.get(k).copied())
        });
        let limit = far * robust_deviation(scored);
        for (index, (values, experiment)) in
            differences.iter().zip(record.experiments()).enumerate()
        {
            let size = |k: Option<usize>| k.and_then(|k| values.get(k)).map_or(0.0, |d| d.abs());
            let alone = |&k: &usize| {
                let own = size(Some(k));
                if own <= limit {
                    return false;
                }
                let mut around: Vec<f64> = (1..=reach)
                    .flat_map(|lag| [size(k.checked_sub(lag)), size(Some(k + lag))])
                    .collect();
                around.sort_by(|a, b| b.total_cmp(a));
                own > factor * around[near]
            };
            found[index][output] = experiment.scored_runs().flatten().filter(alone).collect();
        }
    }
    found
}

/// The difference of every sample from the median of its four neighbours; zero at the ends.
fn apart(values: &[f64]) -> Vec<f64> {
    let mut differences = vec![0.0; values.len()];
    for k in 2..values.len().saturating_sub(2) {
        let mut near = [values[k - 2], values[k - 1], values[k + 1], values[k + 2]];
        near.sort_by(f64::total_cmp);
        differences[k] = values[k] - 0.5 * (near[1] + near[2]);
    }
    differences
}
