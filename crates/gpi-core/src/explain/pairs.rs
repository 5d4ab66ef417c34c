//! Two effects that are only confirmed together.
//!
//! Beside a second effect that the model lacks, the held-out blocks need not confirm a first one, although it takes most of the training
//! squares: the fit lets the first follow the second where it can, and what it says of other times is wrong. Where a round ends without an
//! effect for this reason, the first one is therefore added for a trial, and the search goes on beside it until a second one is
//! confirmed. Both are kept if the following holds.
//!
//! - The model with both is near the noise on what is held out: far from it, two effects follow any structure.
//! - The held-out blocks confirm both together, and the first beside the second. The second one was confirmed beside the first.

use super::judgement::is_confirmed;
use super::round::{add, round};
use super::state::{Addition, SearchState};
use crate::effects::Effect;
use crate::{Error, Progress};

/// Adds two effects where the last round has left one that the held-out blocks alone do not confirm; says whether the model became
/// another.
pub(super) fn add_pair(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let Some(first) = state.unconfirmed.take() else { return Ok(false) };
    let entry = first.entry;
    let count = state.point.effects.len();
    let mut next = state.under(state.setup)?;
    add(&mut next, Addition::alone(first), progress)?;
    for _ in 0..state.setup.policy.revision.rounds {
        if next.point.effects.len() > count + 1 || !round(&mut next, progress)? {
            break;
        }
    }
    next.unconfirmed = None;
    let place = next.point.effects.iter().rposition(|effect: &Effect| effect.name() == entry.name);
    let Some(place) = place else { return Ok(false) };
    if next.point.effects.len() < count + 2 || !next.is_near(&next.point)? {
        return Ok(false);
    }
    let (without, _) = next.best_without(place, progress)?;
    let both = next.held_out(&next.point)?;
    let policy = &state.setup.policy.judgement;
    let confirms = |before: &[f64]| is_confirmed([before, &both], policy);
    let is_kept = confirms(&state.held_out(&state.point)?) && confirms(&next.held_out(&without)?);
    if is_kept {
        *state = next;
    }
    Ok(is_kept)
}
