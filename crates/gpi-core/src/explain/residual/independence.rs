//! Dependence of the residual on other signals, for noise of any autocorrelation.
//!
//! Let f be a function of input, output or time, and e the residual. If e does not depend on f, the products
//! `(f(k) - mean f) e(k)` have mean zero, but neighbours are correlated, so that their sample variance says nothing of
//! the variance of their sum. They are summed over b = 1 .. B blocks of time to g_b instead. Sums of blocks that are
//! longer than the correlation are nearly independent, with mean zero and variances of their own, and
//!
//! ```text
//! t = sum_b g_b / sqrt(sum_b g_b^2)
//! ```
//!
//! is self-normalised: approximately standard normal whatever the variances are, and its tails are no heavier than
//! Gaussian, `P(t > c) <= exp(-c^2 / 2)`, if the g_b are symmetric (B. Efron, *Student's t-test under symmetry
//! conditions*, 1969). By Cauchy and Schwarz, t never exceeds sqrt(B).
//!
//! The largest |t| of m functions has at most m times the tail probability of one (Bonferroni), which gives the
//! threshold and the p-value of a family.

use super::compared::Compared;
use super::families::{Family, Regressor};
use super::outcome::{ResidualTest, Significance};
use super::policy::ResidualPolicy;
use super::significance::{normal_beyond, normal_tails};

/// Products of residual and regressor, summed over blocks of time.
pub(super) struct BlockSums {
    sums: Vec<f64>,
    samples: usize,
    seen: usize,
}

impl BlockSums {
    /// For so many products in so many blocks.
    pub(super) fn new(samples: usize, blocks: usize) -> Self {
        Self { sums: vec![0.0; blocks.clamp(1, samples.max(1))], samples: samples.max(1), seen: 0 }
    }

    /// The next product in time.
    pub(super) fn add(&mut self, product: f64) {
        let block = self.seen * self.sums.len() / self.samples;
        self.sums[block] += product;
        self.seen += 1;
    }

    /// `t = sum_b g_b / sqrt(sum_b g_b^2)`, with g_b the sum of block b: at most normal where the products
    /// average to zero, for noise whose autocorrelation is shorter than a block and for noise whose power
    /// varies with time. It cannot exceed the root of the number of blocks.
    pub(super) fn t(&self) -> f64 {
        let squares: f64 = self.sums.iter().map(|g| g * g).sum();
        if squares > 0.0 { self.sums.iter().sum::<f64>() / squares.sqrt() } else { 0.0 }
    }
}

/// The largest t of a family's regressors, their means removed.
pub(super) fn independence(
    given: &Compared,
    output: usize,
    family: &Family,
    significance: f64,
) -> ResidualTest {
    let scored = given.record.scored();
    let t = |regressor: &Regressor| {
        let total: f64 = given.scored().map(|(experiment, k)| regressor(experiment, k)).sum();
        let mean = total / scored as f64;
        let mut sums = BlockSums::new(scored, given.policy.blocks);
        for (experiment, k) in given.scored() {
            let residual = given.residuals[experiment][(k, output)];
            sums.add((regressor(experiment, k) - mean) * residual);
        }
        sums.t()
    };
    let each: Vec<f64> = family.regressors.iter().map(t).collect();
    let points_to = family.points_to.clone();
    dependence(family.name, points_to, output, &each, significance, given.policy)
}

/// A test from the t of each of its regressors, which share its significance level.
pub(super) fn dependence(
    name: &'static str,
    points_to: String,
    output: usize,
    each: &[f64],
    significance: f64,
    policy: &ResidualPolicy,
) -> ResidualTest {
    let statistic = each.iter().map(|t| t.abs()).fold(0.0, f64::max);
    let regressors = each.len().max(1) as f64;
    let tail = |t: f64| regressors * normal_tails(t);
    let threshold = normal_beyond(significance / regressors).max(policy.standard_errors);
    ResidualTest {
        name,
        output,
        statistic,
        threshold,
        significance: Some(Significance::new(tail, statistic, threshold)),
        points_to,
    }
}
