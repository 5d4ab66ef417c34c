//! A sum of deadzones as one piecewise linear curve, for both deadzone conventions.

use super::curve::Curve;
use super::ranked::sums;
use crate::operators::Reading;

/// Fewest samples for which building the curve takes less time than it saves.
const FEWEST: usize = 128;

/// `sum_j g_j max(x - eta_j, 0) - sum_j h_j max(eta_j - x, 0)`; terms are `(eta, g, h)`.
fn curve(mut terms: Vec<(f64, f64, f64)>) -> Curve {
    terms.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = |part: fn(&(f64, f64, f64)) -> f64| sums(terms.iter().map(part));
    // `below`: terms g of the knots below x; `above`: terms h of the knots above x
    let (below, below_moment) = (all(|t| t.1), all(|t| t.1 * t.0));
    let rest = |part: fn(&(f64, f64, f64)) -> f64| {
        let mut rest = sums(terms.iter().rev().map(part));
        rest.reverse();
        rest
    };
    let (above, above_moment) = (rest(|t| t.2), rest(|t| t.2 * t.0));
    let line = |c: usize| (below[c] + above[c], -below_moment[c] - above_moment[c]);
    let lines = (0..=terms.len()).map(line).collect();
    Curve::new(terms.iter().map(|term| term.0).collect(), lines)
}

/// Whether a signal is long enough for [`in_place`] to be the faster choice.
pub(crate) fn pays(zones: usize, samples: usize) -> bool {
    zones > 1 && samples >= FEWEST.max(4 * zones)
}

/// Replaces inputs by the outputs of deadzones; `previous` is u(k-1) and is updated.
///
/// The outputs equal those of the definition up to rounding. Does nothing and returns `false` if an input is not finite.
pub(crate) fn in_place(
    thresholds: &[f64],
    weights: &[f64],
    reading: Reading,
    previous: &mut f64,
    signal: &mut [f64],
) -> bool {
    if signal.iter().filter(|u| !u.is_finite()).count() > 0 {
        return false;
    }
    let last = signal.last().copied().unwrap_or(*previous);
    let zones = thresholds.iter().zip(weights);
    match reading {
        Reading::OneSided => {
            let term = |(&eta, &g): (&f64, &f64)| match eta {
                _ if eta > 0.0 => (eta, g, 0.0),
                _ if eta < 0.0 => (eta, 0.0, g),
                _ => (eta, g, g),
            };
            let curve = curve(zones.map(term).collect());
            signal.iter_mut().for_each(|u| *u = curve.at(*u));
        }
        Reading::Directional => {
            let rising = curve(zones.map(|(&eta, &g)| (eta, g, 0.0)).collect());
            let mut before = *previous;
            for value in signal {
                let u = *value;
                // a falling u is a rising -u
                *value = if u > before {
                    rising.at(u)
                } else if u < before {
                    -rising.at(-u)
                } else {
                    0.0
                };
                before = u;
            }
        }
    }
    *previous = last;
    true
}
