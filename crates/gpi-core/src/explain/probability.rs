//! How probable it is that an explanation is the better one, by what is held out.
//!
//! Trials of one round explain the same residual. For the squares `S_b` of n held-out blocks with the effect that was taken,
//! and `S'_b` with another one that would also be accepted, let `d_b = ln S'_b - ln S_b`. The other one predicts a new block
//! better with the probability
//!
//! ```text
//! P = F(-mean(d) / sqrt(var(d) / n))
//! ```
//!
//! where F is the distribution function of Student's t with n - 1 degrees of freedom (the paired t-test of two models on the
//! same blocks). With the odds `o = P / (1 - P)` of each other effect, the probability of the taken one is `1 / (1 + sum of o)`,
//! and that of another one is o times as large.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// A probability this close to 0 or 1 is not distinguished from it: with ten blocks, the tails of the differences are unknown.
const CERTAIN: f64 = 1e-4;

/// The probabilities of the taken effect and of the others, from the squares of the held-out blocks. `None` where there are too
/// few blocks, or no other effect.
pub(super) fn probabilities(taken: &[f64], others: &[&[f64]]) -> Option<(f64, Vec<f64>)> {
    if taken.len() < 2 || others.is_empty() {
        return None;
    }
    let odds: Option<Vec<f64>> = others.iter().map(|other| odds(taken, other)).collect();
    let odds = odds?;
    let own = 1.0 / (1.0 + odds.iter().sum::<f64>());
    Some((own, odds.into_iter().map(|odds| odds * own).collect()))
}

/// The odds that the other effect predicts a new block better.
fn odds(taken: &[f64], other: &[f64]) -> Option<f64> {
    let n = taken.len() as f64;
    let log = |square: f64| square.max(f64::MIN_POSITIVE).ln();
    let differences: Vec<f64> = other.iter().zip(taken).map(|(o, t)| log(*o) - log(*t)).collect();
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let t = -mean / (variance / n).sqrt().max(f64::MIN_POSITIVE);
    let better = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.cdf(t).clamp(CERTAIN, 1.0 - CERTAIN);
    Some(better / (1.0 - better))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAKEN: [f64; 5] = [1.0, 2.0, 1.5, 1.2, 0.9];

    #[test]
    fn equal_errors_are_equally_probable() {
        let (own, others) = probabilities(&TAKEN, &[&TAKEN, &TAKEN]).unwrap();
        assert!((own - 1.0 / 3.0).abs() < 1e-12);
        assert!(others.iter().all(|other| (other - own).abs() < 1e-12));
    }

    #[test]
    fn a_difference_counts_by_its_standard_error() {
        // ln of the ratios: 0.1, 0.3, -0.1, 0.2, 0.0; mean 0.1, deviation 0.158, t = 1.414 with four degrees of freedom
        let logs = [0.1, 0.3, -0.1, 0.2, 0.0_f64];
        let other: Vec<f64> = TAKEN.iter().zip(logs).map(|(t, d)| t * d.exp()).collect();
        let (own, others) = probabilities(&TAKEN, &[&other]).unwrap();
        // one-sided p of Student's t, from a table
        assert!((others[0] - 0.1151).abs() < 1e-3, "{others:?}");
        assert!((own + others[0] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_larger_error_everywhere_is_improbable_and_one_block_says_nothing() {
        let other = TAKEN.map(|square| 3.0 * square);
        let (own, _) = probabilities(&TAKEN, &[&other]).unwrap();
        assert!(own > 0.999);
        assert!(probabilities(&TAKEN[..1], &[&other[..1]]).is_none());
        assert!(probabilities(&TAKEN, &[]).is_none());
    }
}
