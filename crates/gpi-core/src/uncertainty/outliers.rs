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
/// rough, and the fewer the smaller `near` is. The record's output must differ by half as much from the cubic through its four
/// neighbours: a wrong sample of a residual is one of the measurement, and not of a model.
pub(crate) fn places(signals: &[Matrix], record: &Record, near: usize) -> Vec<Vec<Vec<usize>>> {
    let OutlierSettings { apart: far, alone: factor, around: reach, shown, .. } =
        Default::default();
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
            let measured = experiment.output.column(output);
            let is_measured =
                |&k: &usize| from_cubic(measured.as_slice(), k).abs() >= shown * size(Some(k));
            found[index][output] =
                experiment.scored_runs().flatten().filter(alone).filter(is_measured).collect();
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

/// The difference of a sample, which is not one of the two first or last, from the cubic through its four neighbours.
fn from_cubic(values: &[f64], k: usize) -> f64 {
    values[k] - (4.0 * (values[k - 1] + values[k + 1]) - (values[k - 2] + values[k + 2])) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Experiment};

    /// The outliers of a residual at rest but for a spike, where the measured output is a sine with a spike of some size at the same place.
    fn found(spike: f64) -> Vec<usize> {
        let place = 57;
        let at = |k: usize| f64::from(u8::from(k == place));
        let output = Matrix::from_fn(200, 1, |k, _| (0.2 * k as f64).sin() + spike * at(k));
        let residual =
            Matrix::from_fn(200, 1, |k, _| 0.01 * (1.7 * (k * k) as f64).sin() + 0.2 * at(k));
        let channel = |name| vec![Channel::new(name, "")];
        let run = vec![Experiment::new(Matrix::zeros(200, 1), output)];
        let record = Record::new(run, 100.0, channel("u"), channel("y"), vec![]).unwrap();
        places(&[residual], &record, 0).concat().concat()
    }

    #[test]
    fn a_wrong_sample_is_one_of_the_measured_output() {
        assert_eq!(found(0.2), [57]);
        assert!(found(0.0).is_empty(), "a spike of the model");
    }
}
