//! Whether the loop of output over input is a butterfly, as the strain of a ferroelectric over the electric field.
//!
//! The mean output m over bins of the input is a curve. A butterfly's curve is mostly even about the middle of the input's
//! range, follows the output, has slopes of opposite sign at its ends, and the mean output of rising less that of falling
//! input changes its sign: the loop crosses itself.

use crate::Record;
use crate::explain::policy::OutsidePolicy;

/// Whether the loop of an output over an input is one.
pub(super) fn is_butterfly(
    record: &Record,
    input: usize,
    output: usize,
    policy: &OutsidePolicy,
) -> bool {
    let bins = policy.bins;
    let mut rising = vec![[0.0; 2]; bins];
    let mut falling = rising.clone();
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for experiment in record.experiments() {
        let (u, y) = (experiment.input.column(input), experiment.output.column(output));
        let mut is_rising = true;
        for k in 0..u.len() {
            let before = u[k.saturating_sub(1)];
            is_rising = u[k] > before || (u[k] == before && is_rising);
            let bin = (0.5 * (u[k] + 1.0) * bins as f64) as usize;
            let side = if is_rising { &mut rising } else { &mut falling };
            let [n, total] = &mut side[bin.min(bins - 1)];
            (*n, *total) = (*n + 1.0, *total + y[k]);
            (count, sum, squares) = (count + 1.0, sum + y[k], squares + y[k] * y[k]);
        }
    }
    if rising.iter().chain(&falling).any(|[n, _]| *n == 0.0) {
        return false;
    }
    let variance = squares / count - (sum / count).powi(2);
    let both: Vec<[f64; 2]> =
        rising.iter().zip(&falling).map(|(a, b)| [a[0] + b[0], a[1] + b[1]]).collect();
    let mean = |[n, total]: &[f64; 2]| total / n - sum / count;
    let followed: f64 = both.iter().map(|bin| bin[0] * mean(bin).powi(2)).sum::<f64>() / count;
    let curve: Vec<f64> = both.iter().map(mean).collect();
    let opened: Vec<f64> = rising.iter().zip(&falling).map(|(a, b)| mean(a) - mean(b)).collect();
    let least = policy.crossed * variance.sqrt();
    let crosses = opened.iter().any(|d| *d > least) && opened.iter().any(|d| *d < -least);
    let end = bins / 4;
    let left = curve[end] - curve[0];
    let right = curve[bins - 1] - curve[bins - 1 - end];
    followed > policy.followed * variance
        && even_part(&curve) > policy.even
        && left * right < 0.0
        && crosses
}

/// The part of a curve's variance that is even about its middle.
fn even_part(curve: &[f64]) -> f64 {
    let mean = curve.iter().sum::<f64>() / curve.len() as f64;
    let (mut even, mut all) = (0.0, 0.0);
    for (a, b) in curve.iter().zip(curve.iter().rev()) {
        even += (0.5 * (a + b) - mean).powi(2);
        all += (a - mean).powi(2);
    }
    even / all.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::stage;
    use crate::operators::play;

    fn found(of: impl Fn(f64, f64) -> f64) -> bool {
        let u: Vec<f64> =
            (0..8000).map(|k| (0.01 * f64::from(k)).sin() * (1.0 - f64::from(k) / 2e4)).collect();
        let mut place = 0.0;
        let y: Vec<f64> = u
            .iter()
            .map(|u| {
                place = play(0.25, *u, place);
                of(*u, place)
            })
            .collect();
        is_butterfly(&stage(&u, &y), 0, 0, &OutsidePolicy::default())
    }

    #[test]
    fn an_even_loop_that_crosses_itself_is_one() {
        assert!(found(|_, p| p * p), "the square of a polarization");
        assert!(!found(|_, p| p), "an ordinary loop");
        assert!(!found(|u, _| u * u), "an even curve without a loop");
        assert!(!found(|_, p| p + 0.5 * p * p), "an asymmetric loop");
    }
}
