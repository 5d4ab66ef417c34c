//! Whether a limit inside the dynamics shows where the output is within its own limits.
//!
//! A sensor that clips changes the samples at which it stands at its limit, and no others. A state that stays at a limit forgets what
//! drove it there, so that the samples behind differ too. With the samples at a limit left out, the present model, that with the
//! limit, and the latter without its limit are fitted again. With J the squares over N values that are left, the smaller ones of both models
//! without the limit, the limit must gain
//!
//! ```text
//! N ln(J_without / J_with) > D_0
//! ```
//!
//! the threshold D_0 of the trial. Where no sample stands at a limit, this has been asked before.
//!
//! A limit is stiff: in steady state, z exceeds it by the part `1 / (1 + K)` of what it would without the loop, with the loop's gain
//! `K = -S (I - A)^-1 E`, S the row of what it sees. Loops that all leave much of the excess are kinks of a restoring force. One loop may
//! be what a sensor that clips leaves of another limit.

use crate::chain::point::Point;
use crate::effects::{Drives, InnerLoop, Sees};
use crate::explain::outside::within_limits;
use crate::explain::state::{SearchState, Trial};
use crate::fit::minimize::fit;
use crate::{Error, Progress};

/// Whether the limit at a place of a trial is significant among the samples within the output's limits; not where too few of them are
/// left for a fit.
pub(super) fn explains_more(
    state: &SearchState,
    trial: &Trial,
    place: usize,
    progress: Progress,
) -> Result<bool, Error> {
    let Ok(record) = within_limits(&state.prepared.record, &state.setup.policy.outside) else {
        return Ok(false);
    };
    if record.scored() == state.prepared.record.scored() {
        return Ok(true);
    }
    let options = &state.setup.options;
    let mut squares = |point: &Point| -> Result<f64, Error> {
        let fitted = fit(point.clone(), &record, options, trial.entry.name, progress)?;
        Ok(fitted.linearization.cost)
    };
    let alone = trial.point.without_effect(place);
    let without = squares(&state.point)?.min(squares(&alone)?);
    let with = squares(&trial.point)?;
    let values = (record.scored() * record.outputs().len()) as f64;
    Ok(values * (without / with.max(f64::MIN_POSITIVE)).ln() > trial.threshold)
}

/// Whether a loop leaves no more than a part of the excess over its limit.
pub(super) fn is_stiff(point: &Point, inner: &InnerLoop, most: f64) -> bool {
    let Drives::States(column) = &inner.drives else { return false };
    let states = point.dynamics.steady_states(column);
    let taken = -match &inner.sees {
        Sees::Output(output) => point.dynamics.gains_from_states(column)[*output],
        Sees::Mixture { states: seen, .. } => seen.iter().zip(&states).map(|(s, x)| s * x).sum(),
    };
    taken > 0.0 && 1.0 <= most * (1.0 + taken)
}
