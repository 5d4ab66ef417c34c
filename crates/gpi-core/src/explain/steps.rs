//! In how many steps loops are computed between two samples, and how v is held meanwhile: what the data prefer.
//!
//! No parameter is added to the model, so that the squares of the training samples decide. The steps are doubled as long as
//! these fall.

use super::state::SearchState;
use crate::Error;
use crate::chain::point::Point;
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
    let mut changed = false;
    loop {
        let present = state.point.intersample;
        let substeps = 2 * present.substeps;
        if substeps > policy.most {
            break;
        }
        let holds =
            if present.is_plain() { &[Hold::First, Hold::Zero][..] } else { &[present.hold] };
        let mut best = None;
        for &hold in holds {
            let mut point = state.point.clone();
            point.intersample = Intersample { substeps, hold };
            let fitted =
                state.fit(point, &state.setup.options, "steps between samples", progress)?;
            let (point, cost) = (fitted.point, fitted.linearization.cost);
            if cost < best.as_ref().map_or((1.0 - policy.least) * state.cost, |&(_, cost)| cost) {
                best = Some((point, cost));
            }
        }
        let Some((point, cost)) = best else { break };
        (state.point, state.cost) = (point, cost);
        changed = true;
    }
    Ok(changed)
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
