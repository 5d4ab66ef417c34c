//! Whether a simple model predicts held-out data better.
//!
//! The squares of the final model and of a rival are compared block by block of held-out time. The rival wins if its rms is
//! lower by a useful part, and if the mean logarithm of the blocks' ratios exceeds its standard error by a factor. Ratios and
//! not differences are averaged, because a few blocks of large amplitude would decide alone.

use crate::explain::policy::OutsidePolicy;
use crate::rivals::Fitted;
use crate::{Matrix, Record};

/// The rival with the lowest error, of those that win.
pub(super) fn winner<'a>(
    (test, residuals): (&Record, &[Matrix]),
    rivals: &'a [Fitted],
    policy: &OutsidePolicy,
) -> Option<&'a Fitted> {
    let own = blocks(test, residuals, policy.parts);
    let with = |rival: &'a Fitted| (blocks(test, rival.tested(), policy.parts), rival);
    let winning = rivals.iter().map(with).filter(|(blocks, _)| wins(&own, blocks, policy));
    let total = |blocks: &[f64]| blocks.iter().sum::<f64>();
    winning.min_by(|a, b| total(&a.0).total_cmp(&total(&b.0))).map(|(_, rival)| rival)
}

/// The squares of each block: of the scored runs, or of equal parts of them where there are few.
fn blocks(test: &Record, residuals: &[Matrix], least: usize) -> Vec<f64> {
    let runs: usize = test.experiments().iter().map(|e| e.scored_runs().count()).sum();
    let parts = least.div_ceil(runs.max(1));
    let mut sums = Vec::new();
    for (experiment, residual) in test.experiments().iter().zip(residuals) {
        for run in experiment.scored_runs() {
            let size = run.len().div_ceil(parts).max(1);
            for start in run.clone().step_by(size) {
                let rows = size.min(run.end - start);
                sums.push(residual.rows(start, rows).norm_squared());
            }
        }
    }
    sums
}

/// Whether a rival's squares are lower than the model's.
fn wins(model: &[f64], rival: &[f64], policy: &OutsidePolicy) -> bool {
    let [all, rivals] = [model, rival].map(|blocks| blocks.iter().sum::<f64>());
    // blocks that are exact would decide alone
    let least = f64::EPSILON.sqrt() * (all + rivals) + f64::MIN_POSITIVE;
    let ratio = |(a, b): (&f64, &f64)| ((a + least) / (b + least)).ln();
    let ratios: Vec<f64> = model.iter().zip(rival).map(ratio).collect();
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    rivals.sqrt() < (1.0 - policy.useful) * all.sqrt()
        && mean > policy.standard_errors * (variance / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::{slow_input, stage};
    use crate::rivals::{RivalPolicy, fit};

    const MODEL: [f64; 10] = [10.0, 12.0, 9.0, 11.0, 10.0, 9.5, 10.5, 11.5, 8.5, 10.0];

    #[test]
    fn a_win_is_useful_and_shows_in_most_blocks() {
        let policy = OutsidePolicy::default();
        let scaled = |factor: f64| MODEL.map(|square| factor * square);
        assert!(wins(&MODEL, &scaled(0.8), &policy));
        assert!(!wins(&MODEL, &scaled(0.95), &policy), "less than 5 % of the rms is of no use");
        let mut in_one = MODEL;
        (in_one[1], in_one[3]) = (2.0, 2.0);
        assert!(!wins(&MODEL, &in_one, &policy), "two blocks may be chance");
        let loud = [1.0, 2.0, 300.0, 1.0, 2.0, 100.0, 1.0, 2.0, 30.0, 1.0];
        assert!(wins(&loud, &loud.map(|square| 0.5 * square), &policy), "of any amplitude");
    }

    #[test]
    fn the_best_rival_of_a_poor_model_wins() {
        // a static curve, which a model that is off by a tenth of the output does not reach
        let u = slow_input(3000);
        let y: Vec<f64> = u.iter().map(|u| u + 0.5 * u * u).collect();
        let record = stage(&u, &y);
        let test = record.held_out_part().unwrap();
        let rivals = fit(&record, None, &RivalPolicy::default()).unwrap();
        let output = &record.experiments()[0].output;
        let policy = OutsidePolicy::default();
        let found = winner((&test, &[0.1 * output]), &rivals, &policy);
        assert_eq!(found.map(|rival| rival.name), Some("static-polynomial"));
        assert!(winner((&test, &[0.0 * output]), &rivals, &policy).is_none());
    }
}
