//! How much of a residual its input predicts once its own past has been taken out.
//!
//! Coloured noise and friction leave residuals of the same autocorrelation, but only that of friction follows the
//! input. The residual e and features f of the input and of the simulated output are filtered by the autoregression
//! A(q) that makes e white. Blocks of time are dealt to ten folds in turn, so that every fold has a part of every
//! excitation. On each fold, a regression fitted to all others predicts `A e` from `A f`:
//!
//! `R^2 = 1 - sum_b |A e_b - A f_b beta_(-b)|^2 / |A e|^2`.
//!
//! The features f (samples, features) are a constant and, of each input and of the simulated output, lagged levels,
//! speeds, directions, and plays of several half-widths: what hysteresis of any kind remembers.
//!
//! `beta_(-b)` solves the normal equations of all folds but b, `(F - F_b) beta = g - g_b` with `F = sum (A f)'(A f)`
//! and `g = sum (A f)' (A e)`, a small part of the diagonal added. The products of each fold are summed once, so that
//! ten regressions cost ten factorisations and one pass over the record. Because no fold is predicted from itself,
//! features that are not related to e make R^2 slightly negative on average, by about the number of features over the
//! samples. The p-value is that of the mean gain of the folds over its standard error.

use super::compared::Compared;
use super::families::{ScaledSignal, sign};
use super::outcome::{PREDICTION, ResidualTest, points_to};
use crate::uncertainty::noise_model::NoiseModel;
use crate::{Experiment, Matrix};
use nalgebra::{Cholesky, DVector};

/// The part of a whitened residual that the input predicts.
pub(super) fn prediction(
    given: &Compared,
    output: usize,
    signals: &[&ScaledSignal],
) -> ResidualTest {
    let colour = NoiseModel::of(given.residuals, given.record);
    let filter = &colour.coefficients[output];
    let mut folds: Vec<Sums> = Vec::new();
    let (scored, blocks) = (given.record.scored(), given.policy.predicted_blocks);
    let mut seen = 0;
    for (index, experiment) in given.record.experiments().iter().enumerate() {
        let mut columns = features(given, index, signals);
        columns.push(given.residuals[index].column(output).iter().copied().collect());
        let columns: Vec<Vec<f64>> =
            columns.iter().map(|column| whitened(column, filter)).collect();
        for k in usable(experiment, filter.len()) {
            let fold = seen * blocks / scored % given.policy.predicted_folds;
            seen += 1;
            if folds.len() <= fold {
                folds.resize_with(fold + 1, || Sums::new(columns.len()));
            }
            folds[fold].add(DVector::from_fn(columns.len(), |i, _| columns[i][k]));
        }
    }
    let size = folds.first().map_or(1, |fold| fold.products.nrows());
    let mut all = Sums::new(size);
    folds.iter().for_each(|fold| all.products += &fold.products);
    let gains = folds.iter().map(|fold| fold.gain(&all, given.policy.predicted_ridge));
    let own = all.products[(size - 1, size - 1)].max(f64::MIN_POSITIVE);
    ResidualTest {
        name: PREDICTION,
        output,
        statistic: gains.sum::<f64>() / own,
        threshold: given.policy.predicted,
        // a long record makes any dependence significant; what counts is how much of the residual it is
        significance: None,
        points_to: points_to(PREDICTION, "hysteresis or friction that the model lacks"),
    }
}

/// Scored samples with enough samples before them.
fn usable(experiment: &Experiment, before: usize) -> impl Iterator<Item = usize> {
    experiment.scored_runs().flatten().filter(move |&k| k >= before)
}

/// One column a feature: a constant, and of each signal its lagged levels, speed, direction and plays.
fn features(given: &Compared, index: usize, signals: &[&ScaledSignal]) -> Vec<Vec<f64>> {
    let samples = given.residuals[index].nrows();
    let mut columns = vec![vec![1.0; samples]];
    for signal in signals {
        let (level, speed) = (&signal.level[index], &signal.speed[index]);
        for &lag in &given.policy.predicted_lags {
            columns.push((0..samples).map(|k| level[k.saturating_sub(lag)]).collect());
        }
        columns.push(speed.iter().map(|s| s.abs()).collect());
        columns.push(speed.iter().map(|s| sign(*s)).collect());
        let plays = given.policy.predicted_plays.iter();
        columns.extend(plays.map(|&half_width| play(level, half_width)));
    }
    columns
}

/// The play of a signal, from the middle of its dead band.
fn play(signal: &[f64], half_width: f64) -> Vec<f64> {
    let mut place = signal.first().copied().unwrap_or(0.0);
    let follow = |x: &f64| {
        place = place.clamp(x - half_width, x + half_width);
        place
    };
    signal.iter().map(follow).collect()
}

/// `x(k) - sum_i a_i x(k-i)`, zero where the past is too short.
fn whitened(signal: &[f64], filter: &[f64]) -> Vec<f64> {
    let at = |k: usize| {
        let past = filter.iter().zip(1..).map(|(a, lag)| a * signal[k - lag]);
        signal[k] - past.sum::<f64>()
    };
    (0..signal.len()).map(|k| if k < filter.len() { 0.0 } else { at(k) }).collect()
}

/// Products of features and residual, the residual last, over a fold.
struct Sums {
    products: Matrix,
}

impl Sums {
    fn new(size: usize) -> Self {
        Self { products: Matrix::zeros(size, size) }
    }

    fn add(&mut self, row: DVector<f64>) {
        self.products.ger(1.0, &row, &row, 1.0);
    }

    /// By how much the squares of this fold fall when a regression on all other folds predicts it.
    fn gain(&self, all: &Self, ridge: f64) -> f64 {
        let n = self.products.nrows() - 1;
        let others = &all.products - &self.products;
        let mut gram = others.view((0, 0), (n, n)).into_owned();
        let most = gram.diagonal().max();
        for i in 0..n {
            // a feature that never moves in the other folds has no part
            gram[(i, i)] = gram[(i, i)] * (1.0 + ridge) + f64::EPSILON * most;
        }
        let Some(factor) = Cholesky::new(gram) else { return 0.0 };
        let beta = factor.solve(&others.view((0, n), (n, 1)));
        let own = self.products.view((0, 0), (n, n));
        let with = self.products.view((0, n), (n, 1));
        2.0 * beta.dot(&with) - (own * &beta).dot(&beta)
    }
}
