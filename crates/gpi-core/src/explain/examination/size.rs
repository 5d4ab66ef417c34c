//! Whether an effect is too large for what it leaves unexplained.
//!
//! A drift, a creep, a gap or a sensor's curve is a small part of the output of a stage, and once it is modelled the
//! error is near the noise. One that is a large part of the output, in a model that is still far from the noise, stands
//! for a structure that the model lacks: an integrator, friction, another hysteresis. The size is what is left of the
//! effect's contribution c after a gain and an offset, which the rest of the model can take:
//!
//! `size = min over a, b of rms(c - a y - b) / std(y)`.
//!
//! How the half-widths of plays depend on speed is a correction of the hysteresis. It is never named while the model is
//! far from the noise, because then the hysteresis itself is another.
//!
//! Lines and measured columns are not asked, because no misfit resembles them, nor are modes, loops and shapes of loops,
//! which may well be a large part.

use super::contribution::contribution;
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{FreeOrder, Place, Signature};
use crate::explain::state::SearchState;

/// Whether the effect at a place of a point is large and its model is far from the noise on what is held out.
pub(super) fn is_too_large(
    state: &SearchState,
    point: &Point,
    place: usize,
) -> Result<bool, Error> {
    let entry = point.effects[place].entry();
    let of = point.effects[place].place();
    let is_asked = matches!(
        of,
        Place::Input(_)
            | Place::Widths(_)
            | Place::Parallel(_)
            | Place::Output(_)
            | Place::Added(_)
    );
    if !is_asked || entry.signature == Signature::Unique || entry.free_order == FreeOrder::JoinsG {
        return Ok(false);
    }
    let policy = &state.setup.policy.examination;
    let test = state.setup.test.scored().max(1) as f64;
    let trained = state.prepared.record.scored().max(1) as f64;
    let noise = state.noise_squares()? / trained;
    let is_near = state.held_out(point)?.iter().sum::<f64>() / test <= policy.near.powi(2) * noise;
    Ok(!is_near && (matches!(of, Place::Widths(_)) || size(state, point, place)? > policy.large))
}

/// The largest size over the outputs.
fn size(state: &SearchState, point: &Point, place: usize) -> Result<f64, Error> {
    let without = point.without_effect(place);
    let record = &state.prepared.record;
    let outputs = record.outputs().len();
    // of (1, c, y): sums of products
    let mut sums = vec![nalgebra::Matrix3::<f64>::zeros(); outputs];
    for (index, experiment) in record.experiments().iter().enumerate() {
        let known = point.signals(experiment, index)?;
        let c = contribution(point, &without, &known, experiment, index)?;
        for k in experiment.scored_runs().flatten() {
            for (output, sum) in sums.iter_mut().enumerate() {
                let y = experiment.output[(k, output)];
                let row = nalgebra::Vector3::new(1.0, c[(k, output)], y);
                *sum += row * row.transpose();
            }
        }
    }
    let of = |sum: &nalgebra::Matrix3<f64>| {
        let n = sum[(0, 0)];
        let covariance = |i: usize, j: usize| sum[(i, j)] / n - sum[(0, i)] * sum[(0, j)] / (n * n);
        let output = covariance(2, 2).max(f64::MIN_POSITIVE);
        let own = covariance(1, 1) - covariance(1, 2).powi(2) / output;
        (own.max(0.0) / output).sqrt()
    };
    Ok(sums.iter().map(of).fold(0.0, f64::max))
}
