//! Models drawn from the covariance of the parameters.
//!
//! On data of another kind than those of the training record, parameters that the record determines badly cause an error that the
//! record does not show. The difference of a drawn model from the model is a sample of this error.

use super::settings::MonitorSettings;
use crate::Model;

/// Drawn models, and the factor from the difference of each to one draw of the error; none without a covariance.
pub(super) fn drawn_models(model: &Model, settings: &MonitorSettings) -> Vec<(Model, f64)> {
    (0..settings.draws).filter_map(|draw| drawn(model, draw)).collect()
}

/// A model of the uncertain parameters, a small step from the model so that it is valid, and the factor from this step to one
/// draw; `None` without a covariance, or if no step is valid.
///
/// With axes d_k of the covariance and signs s_k, `sum_k s_k d_k` has this covariance over all signs (M. F. Hutchinson,
/// *A stochastic estimator of the trace*, 1990).
fn drawn(model: &Model, draw: usize) -> Option<(Model, f64)> {
    let prediction = model.prediction()?;
    let numbers = model.numbers();
    let mut change = vec![0.0; numbers.len()];
    for (axis, parts) in prediction.axes.iter().enumerate() {
        let sign = if hash(draw, axis) & 1 == 0 { 1.0 } else { -1.0 };
        for (&place, &part) in prediction.numbers.iter().zip(parts) {
            change[place] += sign * f64::from(part);
        }
    }
    // a whole draw may leave the valid models, with poles beyond the unit circle or half-widths below zero, and is not linear
    [1e-3, -1e-3, 1e-4, -1e-4].into_iter().find_map(|step| {
        let there: Vec<f64> = numbers.iter().zip(&change).map(|(n, d)| n + step * d).collect();
        let neighbour = model.with_numbers(&there).ok()?;
        let stable = neighbour.linear().spectral_radius().ok()? < 1.0;
        stable.then_some((neighbour, 1.0 / step))
    })
}

/// Bits that look random (G. Steele and others, *Fast splittable pseudorandom number generators*, 2014).
fn hash(draw: usize, axis: usize) -> u64 {
    let mut z = (draw as u64) << 32 | axis as u64;
    z = z.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
