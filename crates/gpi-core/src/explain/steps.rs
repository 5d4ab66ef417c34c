//! In how many steps loops are computed between two samples, and how v is held meanwhile: what the data prefer.
//!
//! No parameter is added to the model, so that the squares of the training samples decide. The steps are doubled as long as
//! these fall.
//!
//! With one step a sample, a force acts half a sample late, and a pole of G with a negative real part can make up for it. A mode of the
//! mechanics has such a pole only above a quarter of the sampling rate. A model without these poles and with several steps replaces
//! such a model where it explains nearly as much.

use super::state::SearchState;
use crate::Error;
use crate::chain::point::Point;
use crate::fit::minimize::Fitted;
use crate::progress::Progress;
use crate::{Hold, Intersample};

/// Computes the loops of the model in more steps where the data ask for it; says whether the model became another.
///
/// Loops around several inputs or outputs keep one step a sample: each step costs as much as a simulation with all loops.
pub(super) fn finer_steps(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let policy = &state.setup.policy.steps;
    let has_one = state.point.channels.len() == 1 && state.point.dynamics.outputs() == 1;
    if !has_one || state.point.loops().next().is_none() {
        return Ok(false);
    }
    let mut changed = leave_fast_poles(state, progress)?;
    loop {
        let present = state.point.intersample;
        let substeps = 2 * present.substeps;
        if substeps > policy.most {
            break;
        }
        let holds =
            if present.is_plain() { &[Hold::First, Hold::Zero][..] } else { &[present.hold] };
        let best = best_hold(state, &state.point, substeps, holds, progress)?;
        let is_better = |best: &Fitted| best.linearization.cost < (1.0 - policy.least) * state.cost;
        let Some(best) = best.filter(is_better) else { break };
        (state.point, state.cost) = (best.point, best.linearization.cost);
        changed = true;
    }
    Ok(changed)
}

/// The best fit of a point with so many steps, of those with each hold.
fn best_hold(
    state: &SearchState,
    point: &Point,
    substeps: usize,
    holds: &[Hold],
    progress: Progress,
) -> Result<Option<Fitted>, Error> {
    let mut best: Option<Fitted> = None;
    for &hold in holds {
        let mut point = point.clone();
        point.intersample = Intersample { substeps, hold };
        let fitted = state.fit(point, &state.setup.options, "steps between samples", progress)?;
        let cost = fitted.linearization.cost;
        if best.as_ref().is_none_or(|best| cost < best.linearization.cost) {
            best = Some(fitted);
        }
    }
    Ok(best)
}

/// Takes sections out of G whose poles have a negative real part, and computes the loops in several steps instead; says whether that explains nearly
/// as much.
fn leave_fast_poles(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    if state.setup.order_is_given || !state.point.intersample.is_plain() {
        return Ok(false);
    }
    let slower = state.point.without_sections(|pole| pole.re < 0.0);
    let Some(slower) = slower.filter(|point| point.dynamics.has_resonance()) else {
        return Ok(false);
    };
    let substeps = state.setup.policy.steps.instead_of_poles;
    let best = best_hold(state, &slower, substeps, &[Hold::First, Hold::Zero], progress)?;
    let Some(best) = best else { return Ok(false) };
    let is_enough = state.explains_nearly_as_much(&best)?;
    if is_enough {
        (state.point, state.cost) = (best.point, best.linearization.cost);
    }
    Ok(is_enough)
}

/// How the loops of a model are computed between samples, where the data prefer more than one step.
pub(super) fn in_words(point: &Point) -> Option<String> {
    let Intersample { substeps, hold } = point.intersample;
    let between = match hold {
        Hold::Zero => "constant (zero-order hold)",
        Hold::First => "straight (first-order hold)",
    };
    let is_told = substeps > 1 && point.loops().next().is_some();
    is_told.then(|| {
        format!(
            "The forces inside the mechanics are computed in {substeps} steps from one sample to the next, because this fits \
             the data better than one step. Between samples, the signal that drives the mechanics is {between}."
        )
    })
}
