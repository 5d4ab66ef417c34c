//! Distributions of the statistics where the residual is noise: tail probabilities, and their inverses.
//!
//! ```text
//! normal       P(|x| > z) = erfc(z / sqrt 2)
//! chi-square   P(x > c)   = Q(nu / 2, c / 2)         Q, P: upper and lower regularised incomplete gamma functions
//! Poisson      P(x >= n)  = P(n, lambda)
//! ```
//!
//! Source: M. Abramowitz and I. Stegun, *Handbook of Mathematical Functions*, 1964, sections 26.2, 26.4 and 6.5.

use statrs::function::{erf, gamma};

/// The probability of a standard normal number beyond plus or minus z.
pub(super) fn normal_tails(z: f64) -> f64 {
    erf::erfc(z / std::f64::consts::SQRT_2)
}

/// The size that a standard normal number exceeds with this probability.
pub(super) fn normal_beyond(significance: f64) -> f64 {
    std::f64::consts::SQRT_2 * erf::erfc_inv(significance)
}

/// The probability of a chi-square number above `value`.
pub(in crate::explain) fn chi_square_tail(value: f64, freedom: f64) -> f64 {
    gamma::gamma_ur(0.5 * freedom, 0.5 * value.max(1e-300))
}

/// Where a falling tail comes down to a probability.
pub(in crate::explain) fn exceeded_with(significance: f64, tail: impl Fn(f64) -> f64) -> f64 {
    const DOUBLINGS: usize = 60;
    const HALVINGS: usize = 100;
    let mut high = 1.0;
    for _ in 0..DOUBLINGS {
        if tail(high) <= significance {
            break;
        }
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if tail(middle) > significance { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_probabilities_are_those_of_the_tables() {
        assert!((normal_beyond(0.05) - 1.959_964).abs() < 1e-5);
        assert!((normal_tails(normal_beyond(1e-6)) / 1e-6 - 1.0).abs() < 1e-6);
        let value = exceeded_with(0.01, |value| chi_square_tail(value, 25.0));
        assert!((value - 44.314).abs() < 1e-3);
    }
}
