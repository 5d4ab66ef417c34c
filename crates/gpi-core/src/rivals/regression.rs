//! Linear regression with a ridge, and its error on blocks of time that it was not fitted to.
//!
//! `x(k) = c + sum_i beta_i f_i(k)`. The sums of products of the features f are kept for each fold, so that every choice of
//! the number of features and of the ridge costs one small decomposition a fold. With C the covariance of the features,
//! the coefficients minimize `|x - c - f beta|^2 + ridge sum_i N C_ii beta_i^2`: the ridge has no unit, and the constant is
//! not penalized.

use super::settings::RivalPolicy;
use crate::linear::{NormalEquations, bounded};
use crate::{Matrix, Record};
use nalgebra::DVector;

/// A feature whose variance is a smaller part of its square is constant.
const CONSTANT: f64 = 1e-12;

/// Rows that are gathered before their products are summed.
const AT_ONCE: usize = 512;

/// The golden ratio's fraction: multiples of it are spread evenly, whatever the period of the input.
const SPREAD: f64 = 0.618_033_988_749_895;

/// Features of every sample of a record.
pub(crate) trait Features {
    /// How many there are.
    fn count(&self) -> usize;

    /// Writes those of sample `k` of an experiment.
    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]);
}

/// Sums of products over the scored samples, for each fold; the constant comes first.
pub(crate) struct Sums {
    folds: Vec<NormalEquations>,
    samples: f64,
    for_each: usize,
}

/// A choice, and the squares that it leaves in each fold.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    pub size: usize,
    pub ridge: f64,
    pub squares: Vec<f64>,
}

impl Choice {
    /// The squares of all folds.
    pub(crate) fn score(&self) -> f64 {
        self.squares.iter().sum()
    }
}

impl Sums {
    /// Sums over a record; `target` writes the targets of a sample of an experiment.
    pub(crate) fn of(
        features: &impl Features,
        record: &Record,
        targets: usize,
        target: impl Fn(usize, usize, &mut [f64]),
        policy: &RivalPolicy,
    ) -> Self {
        let (width, scored) = (features.count() + 1, record.scored());
        let part = policy.most_samples as f64 / scored as f64;
        let zeros = || NormalEquations::zeros(width, targets);
        let mut folds: Vec<NormalEquations> = (0..policy.folds).map(|_| zeros()).collect();
        let mut rows: Vec<f64> = Vec::with_capacity(width * AT_ONCE);
        let mut values: Vec<f64> = Vec::with_capacity(targets * AT_ONCE);
        let mut current = 0;
        let mut flush = |rows: &mut Vec<f64>, values: &mut Vec<f64>, fold: usize| {
            let count = values.len() / targets;
            let regressor = Matrix::from_column_slice(width, count, rows);
            folds[fold].add(&regressor, &Matrix::from_column_slice(targets, count, values));
            rows.clear();
            values.clear();
        };
        let (mut seen, mut samples) = (0, 0.0);
        for (index, experiment) in record.experiments().iter().enumerate() {
            for k in experiment.scored_runs().flatten() {
                let fold = seen * policy.blocks / scored % policy.folds;
                let is_used = (seen as f64 * SPREAD).fract() < part;
                seen += 1;
                if !is_used {
                    continue;
                }
                if fold != current || rows.len() == width * AT_ONCE {
                    flush(&mut rows, &mut values, current);
                    current = fold;
                }
                let (start, end) = (rows.len(), values.len());
                rows.resize(start + width, 1.0);
                values.resize(end + targets, 0.0);
                features.fill(index, k, &mut rows[start + 1..]);
                target(index, k, &mut values[end..]);
                samples += 1.0;
            }
        }
        flush(&mut rows, &mut values, current);
        Self { folds, samples, for_each: policy.for_each }
    }

    /// Sums whose targets are the outputs.
    pub(crate) fn of_outputs(
        features: &impl Features,
        record: &Record,
        policy: &RivalPolicy,
    ) -> Self {
        let outputs = |experiment: usize, k: usize, values: &mut [f64]| {
            let output = &record.experiments()[experiment].output;
            values.iter_mut().enumerate().for_each(|(i, value)| *value = output[(k, i)]);
        };
        Self::of(features, record, record.outputs().len(), outputs, policy)
    }

    /// The best of the first so many features and of the ridges; `None` where the samples are too few for any.
    pub(crate) fn best(&self, sizes: &[usize], ridges: &[f64]) -> Option<Choice> {
        let choices = sizes.iter().flat_map(|&size| ridges.iter().map(move |&ridge| (size, ridge)));
        let scored = choices.filter_map(|(size, ridge)| self.cross_validated(size, ridge));
        scored
            .filter(|choice| choice.score().is_finite())
            .min_by(|a, b| a.score().total_cmp(&b.score()))
    }

    /// The squares of each fold, predicted from all others, all targets together.
    pub(crate) fn cross_validated(&self, size: usize, ridge: f64) -> Option<Choice> {
        if self.samples < (self.for_each * (size + 1)) as f64 {
            return None;
        }
        let all = self.total();
        let squares = self.folds.iter().map(|fold| {
            let mut others = all.clone();
            others.gram -= &fold.gram;
            others.rhs -= &fold.rhs;
            let mut x = Matrix::zeros(all.gram.nrows(), all.rhs.ncols());
            x.rows_mut(0, size + 1).copy_from(&solve(&others, size, ridge));
            fold.residual_squares(&x).sum()
        });
        Some(Choice { size, ridge, squares: squares.collect() })
    }

    /// The coefficients for all samples, (1 + size, targets), the constant first.
    pub(crate) fn coefficients(&self, choice: &Choice) -> Matrix {
        solve(&self.total(), choice.size, choice.ridge)
    }

    fn total(&self) -> NormalEquations {
        let mut all = NormalEquations::zeros(self.folds[0].gram.nrows(), self.folds[0].rhs.ncols());
        for fold in &self.folds {
            all.gram += &fold.gram;
            all.rhs += &fold.rhs;
        }
        all
    }
}

/// The coefficients of the constant and the first `size` features.
fn solve(sums: &NormalEquations, size: usize, ridge: f64) -> Matrix {
    let count = sums.gram[(0, 0)].max(1.0);
    let mean = |i: usize| sums.gram[(0, i)] / count;
    let is_constant = |i: usize| {
        let square = sums.gram[(i, i)];
        square - count * mean(i).powi(2) <= CONSTANT * square
    };
    let constant: Vec<bool> = (1..=size).map(is_constant).collect();
    let covariance = |i: usize, j: usize| {
        if constant[i] || constant[j] {
            return 0.0;
        }
        let product = sums.gram[(i + 1, j + 1)] - count * mean(i + 1) * mean(j + 1);
        if i == j { product * (1.0 + ridge) } else { product }
    };
    let gram = Matrix::from_fn(size, size, covariance).into();
    let free = DVector::from_element(size, f64::INFINITY);
    let mut x = Matrix::zeros(size + 1, sums.rhs.ncols());
    for target in 0..sums.rhs.ncols() {
        let average = sums.rhs[(0, target)] / count;
        let right = DVector::from_fn(size, |i, _| {
            if constant[i] {
                return 0.0;
            }
            sums.rhs[(i + 1, target)] - count * mean(i + 1) * average
        });
        let slopes = bounded(&gram, &right, &-&free, &free);
        let centre: f64 = slopes.iter().enumerate().map(|(i, slope)| slope * mean(i + 1)).sum();
        x[(0, target)] = average - centre;
        x.view_mut((1, target), (size, 1)).copy_from(&slopes);
    }
    x
}

/// What coefficients predict of every sample, (samples, targets), one matrix an experiment.
pub(crate) fn predict(
    features: &impl Features,
    coefficients: &Matrix,
    record: &Record,
) -> Vec<Matrix> {
    let (used, count) = (coefficients.nrows(), features.count());
    let transposed = coefficients.transpose();
    let one = |(index, experiment): (usize, &crate::Experiment)| {
        let samples = experiment.input.nrows();
        let mut predicted = Matrix::zeros(samples, coefficients.ncols());
        for start in (0..samples).step_by(AT_ONCE) {
            let rows = AT_ONCE.min(samples - start);
            let mut block = Matrix::from_element(count + 1, rows, 1.0);
            for (k, mut column) in block.column_iter_mut().enumerate() {
                features.fill(index, start + k, &mut column.as_mut_slice()[1..]);
            }
            let values = &transposed * block.rows(0, used);
            predicted.rows_mut(start, rows).copy_from(&values.transpose());
        }
        predicted
    };
    record.experiments().iter().enumerate().map(one).collect()
}
