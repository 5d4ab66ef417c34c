//! Dependence of the residual on other signals, for noise of any colour.

use super::chance::{normal_beyond, normal_tails};
use super::families::{Family, Regressor};
use super::{Beside, ResidualTest};

/// Products of residual and regressor, summed over blocks of time.
pub(super) struct BlockSums {
    sums: Vec<f64>,
    samples: usize,
    seen: usize,
}

impl BlockSums {
    /// For so many products: few enough blocks that one is longer than the noise's memory, enough of them
    /// for a standard error.
    pub(super) fn new(samples: usize) -> Self {
        const BLOCKS: usize = 40;
        Self::of(samples, BLOCKS)
    }

    /// For so many products in so many blocks.
    pub(super) fn of(samples: usize, blocks: usize) -> Self {
        Self { sums: vec![0.0; blocks.clamp(1, samples.max(1))], samples: samples.max(1), seen: 0 }
    }

    /// The next product in time.
    pub(super) fn add(&mut self, product: f64) {
        let block = self.seen * self.sums.len() / self.samples;
        self.sums[block] += product;
        self.seen += 1;
    }

    /// `t = sum_b g_b / sqrt(sum_b g_b^2)`, with g_b the sum of block b: at most normal where the products
    /// average to zero, for noise of any colour that is shorter than a block and for noise that is louder
    /// in places. It cannot exceed the root of the number of blocks.
    pub(super) fn t(&self) -> f64 {
        let squares: f64 = self.sums.iter().map(|g| g * g).sum();
        if squares > 0.0 { self.sums.iter().sum::<f64>() / squares.sqrt() } else { 0.0 }
    }
}

/// The largest t of a family's regressors, their means removed.
pub(super) fn independence(
    beside: &Beside,
    output: usize,
    family: &Family,
    chance: f64,
) -> ResidualTest {
    let scored = beside.record.scored();
    let t = |regressor: &Regressor| {
        let total: f64 = beside.scored().map(|(experiment, k)| regressor(experiment, k)).sum();
        let mean = total / scored as f64;
        let mut sums = BlockSums::new(scored);
        for (experiment, k) in beside.scored() {
            let residual = beside.residuals[experiment][(k, output)];
            sums.add((regressor(experiment, k) - mean) * residual);
        }
        sums.t()
    };
    let each: Vec<f64> = family.regressors.iter().map(t).collect();
    dependence(family.name, family.points_to, output, &each, chance)
}

/// A test from the t of each of its regressors, which share its chance.
pub(super) fn dependence(
    name: &'static str,
    points_to: &'static str,
    output: usize,
    each: &[f64],
    chance: f64,
) -> ResidualTest {
    /// A dependence of fewer standard errors is not looked into, however few tests there are.
    const LEAST: f64 = 4.0;
    let statistic = each.iter().map(|t| t.abs()).fold(0.0, f64::max);
    let regressors = each.len().max(1) as f64;
    ResidualTest {
        name,
        output,
        statistic,
        threshold: normal_beyond(chance / regressors).max(LEAST),
        p_value: (regressors * normal_tails(statistic)).min(1.0),
        points_to,
    }
}
