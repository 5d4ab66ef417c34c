//! What the past of a residual does not predict.
//!
//! Noise with memory is modelled as an autoregression of order p, `e(k) = sum_i a_i e(k - i) + w(k)` with w white. The
//! likelihood of a residual is then that of w, so that least squares of w is the most likely fit. At the start of a run of
//! consecutive samples only the k < p samples before e(k) are known. The best prediction from them is that of order k, whose
//! error has the variance v_k > v_p, and
//!
//! ```text
//! w(k) = sqrt(v_p / v_m) (e(k) - sum_(i <= m) a_i^(m) e(k - i)),      m = min(k, p)
//! ```
//!
//! has the same variance everywhere. The lower orders follow from the highest one by Levinson and Durbin's recursion
//! backwards, with the reflection r = a_m^(m):
//!
//! ```text
//! a_i^(m-1) = (a_i^(m) + r a_(m-i)^(m)) / (1 - r^2),      v_(m-1) = v_m / (1 - r^2)
//! ```
//!
//! The map from e to w is linear, so that derivatives pass through the same filter. Its transpose takes what belongs to
//! w back to what belongs to e. Sources: L. Ljung, System Identification, 1999, sections 3.2 and 7.4; P. Brockwell and R.
//! Davis, Time Series: Theory and Methods, 1991, section 8.6 (the innovations of a finite run).

use crate::Matrix;

/// The predictions of an autoregression from the past of a run, however short it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Autoregression {
    /// Of each order from 0 to p: the factor `sqrt(v_p / v_m)`, and `a_1, .., a_m` times it.
    orders: Vec<(f64, Vec<f64>)>,
}

impl Autoregression {
    /// From a_1 to a_p of a stationary process.
    pub(crate) fn new(coefficients: &[f64]) -> Self {
        let mut orders = Vec::new();
        let (mut own, mut variance) = (coefficients.to_vec(), 1.0_f64);
        loop {
            let factor = variance.sqrt().recip();
            orders.push((factor, own.iter().map(|a| factor * a).collect()));
            let Some(reflection) = own.pop() else { break };
            let rest = 1.0 - reflection * reflection;
            let mirrored: Vec<f64> = own.iter().rev().copied().collect();
            own.iter_mut()
                .zip(mirrored)
                .for_each(|(a, mirror)| *a = (*a + reflection * mirror) / rest);
            variance /= rest;
        }
        orders.reverse();
        Self { orders }
    }

    /// Whether there is nothing to predict.
    pub(crate) fn is_white(&self) -> bool {
        self.order() == 0
    }

    fn order(&self) -> usize {
        self.orders.len().saturating_sub(1)
    }

    /// The factor and the coefficients for a sample with so many before it in its run.
    fn after(&self, before: usize) -> &(f64, Vec<f64>) {
        &self.orders[before.min(self.order())]
    }

    /// Replaces a run of residuals e by w.
    pub(crate) fn whiten(&self, run: &mut [f64]) {
        if self.is_white() {
            return;
        }
        for k in (0..run.len()).rev() {
            let (factor, past) = self.after(k);
            let predicted: f64 = past.iter().zip(1..).map(|(a, lag)| a * run[k - lag]).sum();
            run[k] = factor * run[k] - predicted;
        }
    }

    /// Replaces what belongs to w by what belongs to e, the transposed map.
    pub(crate) fn whiten_adjoint(&self, run: &mut [f64]) {
        if self.is_white() {
            return;
        }
        for k in 0..run.len() {
            let later = run[k + 1..].iter().zip(1..).take(self.order());
            let later: f64 = later.map(|(w, lag)| w * self.after(k + lag).1[lag - 1]).sum();
            run[k] = self.after(k).0 * run[k] - later;
        }
    }
}

/// The filter of columns that come block by block.
#[derive(Clone, Debug)]
pub(crate) struct Whitening<'a> {
    noise: &'a Autoregression,
    /// The latest columns of the blocks before, (rows, order).
    before: Matrix,
    /// Columns of the present run that have come.
    seen: usize,
}

impl<'a> Whitening<'a> {
    /// For columns of so many rows.
    pub(crate) fn new(noise: &'a Autoregression, rows: usize) -> Self {
        Self { noise, before: Matrix::zeros(rows, noise.order()), seen: 0 }
    }

    /// Filters the next block (rows, samples); a new run begins at the samples `begins`.
    pub(crate) fn apply(&mut self, block: &mut Matrix, begins: &[usize]) {
        if self.noise.is_white() {
            return;
        }
        let (order, samples) = (self.noise.order(), block.ncols());
        let mut extended = Matrix::zeros(block.nrows(), order + samples);
        extended.columns_mut(0, order).copy_from(&self.before);
        extended.columns_mut(order, samples).copy_from(block);
        for (k, mut column) in block.column_iter_mut().enumerate() {
            if begins.contains(&k) {
                self.seen = 0;
            }
            let (factor, past) = self.noise.after(self.seen);
            column *= *factor;
            for (lag, &a) in past.iter().enumerate() {
                column.axpy(-a, &extended.column(order + k - 1 - lag), 1.0);
            }
            self.seen += 1;
        }
        self.before.copy_from(&extended.columns(samples, order));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of poles 0.5 and 0.6 +- 0.5i.
    fn noise() -> Autoregression {
        Autoregression::new(&[1.7, -1.21, 0.305])
    }

    fn signal(seed: f64, samples: usize) -> Vec<f64> {
        (0..samples).map(|k| (seed + 1.7 * k as f64).sin() + 0.2 * k as f64).collect()
    }

    #[test]
    fn lower_orders_are_the_best_predictions_from_a_shorter_past() {
        // of order 2: correlations r1 = a1 / (1 - a2), r2 = a1 r1 + a2
        let noise = Autoregression::new(&[0.9, -0.2]);
        let first = 0.9 / 1.2;
        let second = 0.9 * first - 0.2;
        let variances: [f64; 3] = [1.0, 1.0 - first * first, 1.0 - 0.9 * first + 0.2 * second];
        for (order, variance) in variances.iter().enumerate() {
            let factor = (variances[2] / variance).sqrt();
            assert!((noise.orders[order].0 - factor).abs() < 1e-12, "{order}");
        }
        let (factor, past) = &noise.orders[1];
        assert!((past[0] / factor - first).abs() < 1e-12);
        assert!(Autoregression::new(&[]).is_white());
    }

    #[test]
    fn an_autoregression_leaves_its_innovations() {
        let innovations = signal(0.3, 40);
        let mut run: Vec<f64> = Vec::new();
        for (k, w) in innovations.iter().enumerate() {
            let past = (1..=k).zip([1.7, -1.21, 0.305]);
            run.push(w + past.map(|(lag, a)| a * run[k - lag]).sum::<f64>());
        }
        noise().whiten(&mut run);
        for (found, expected) in run.iter().zip(&innovations).skip(3) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn the_transposed_map_has_the_same_inner_products() {
        for samples in [0, 1, 2, 3, 4, 30] {
            let (e, w) = (signal(0.1, samples), signal(2.0, samples));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (mut forward, mut back) = (e.clone(), w.clone());
            noise().whiten(&mut forward);
            noise().whiten_adjoint(&mut back);
            assert!((dot(&forward, &w) - dot(&e, &back)).abs() < 1e-10, "{samples}");
        }
    }

    #[test]
    fn blocks_and_runs_are_filtered_as_a_whole() {
        let rows = [signal(0.4, 30), signal(5.0, 30)];
        let mut expected = rows.clone();
        for row in &mut expected {
            let (first, second) = row.split_at_mut(11);
            noise().whiten(first);
            noise().whiten(second);
        }
        let all = Matrix::from_fn(2, 30, |i, k| rows[i][k]);
        let noise = noise();
        let mut whitening = Whitening::new(&noise, 2);
        // the second run begins inside of the third block
        for (first, samples, begins) in [(0, 2, vec![0]), (2, 7, vec![]), (9, 21, vec![2])] {
            let mut block = all.columns(first, samples).into_owned();
            whitening.apply(&mut block, &begins);
            for k in 0..samples {
                for i in 0..2 {
                    assert!((block[(i, k)] - expected[i][first + k]).abs() < 1e-12, "{i} {k}");
                }
            }
        }
    }
}
