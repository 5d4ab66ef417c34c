//! The zero of an increasing function of one unknown.

/// Doublings of the step after which the search for a bracket ends: a factor of 10^24.
const DOUBLINGS: usize = 80;

/// Iterations within a bracket after which the search ends; a third are bisections, so the bracket is 10^10 times
/// narrower then even for the worst function.
const HALVINGS: usize = 100;

/// The zero of the increasing function `missing` between two limits; the nearer limit if there is no zero between them.
///
/// Starting at `guess`, the steps double until they bracket the zero. The bracket is then narrowed by regula falsi (the
/// Illinois variant) and bisection.
pub(super) fn zero_of(
    mut missing: impl FnMut(f64) -> f64,
    guess: f64,
    step: f64,
    [lower, upper]: [f64; 2],
) -> f64 {
    let (mut a, mut fa) = (guess.clamp(lower, upper), 0.0);
    let (mut b, mut fb) = (a, missing(a));
    let mut stride = if fb < 0.0 { step } else { -step };
    for _ in 0..DOUBLINGS {
        if fb == 0.0 || fb * stride > 0.0 || (a == b && fa != 0.0) {
            break;
        }
        (a, fa) = (b, fb);
        b = (a + stride).clamp(lower, upper);
        fb = missing(b);
        stride *= 2.0;
    }
    if fb == 0.0 || fa * fb >= 0.0 {
        return b;
    }
    for turn in 0..HALVINGS {
        let mut middle = 0.5 * (a + b);
        if middle == a || middle == b {
            break;
        }
        // every third iteration is a bisection, whatever the function
        if turn % 3 < 2 {
            let straight = b - fb * (b - a) / (fb - fa);
            if (straight - a) * (straight - b) < 0.0 {
                middle = straight;
            }
        }
        let there = missing(middle);
        if there == 0.0 {
            return middle;
        }
        if there * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        (b, fb) = (middle, there);
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    #[test]
    fn zeros_from_anywhere() {
        for wanted in [-300.0, -1.0, 0.0, 1e-3, 2.0, 1e6] {
            let found = zero_of(|x| x.powi(3) + x - wanted, 0.3, 1e-3, ALL);
            assert!((found.powi(3) + found - wanted).abs() <= 1e-14 * (1.0 + f64::abs(wanted)));
        }
    }

    #[test]
    fn a_kink_and_a_jump() {
        let kink =
            zero_of(|x| if x < 1.0 { 1e-6 * (x - 1.0) } else { 1e6 * (x - 1.0) }, 5.0, 0.1, ALL);
        assert!((kink - 1.0).abs() < 1e-12);
        let jump = zero_of(|x| if x < 2.0 { -1.0 } else { 1.0 }, -7.0, 0.1, ALL);
        assert!((jump - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_nearer_limit_where_there_is_none() {
        assert_eq!(zero_of(|x| x - 9.0, 0.0, 0.1, [-1.0, 2.0]), 2.0);
        assert_eq!(zero_of(|x| x + 9.0, 5.0, 0.1, [-1.0, 2.0]), -1.0);
        assert_eq!(zero_of(|x| x - 2.0, 1.0, 0.1, [-1.0, 2.0]), 2.0);
    }
}
