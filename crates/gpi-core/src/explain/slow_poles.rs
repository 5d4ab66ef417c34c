//! Slow poles of G in which an effect may hide.
//!
//! G may have lags that are as slow as creep: the last fit of the declared model, or the fit of an effect, has led poles there. As long as
//! they stay, other effects are found beside them that stand for what these lags do not do of the hidden effect. Before the next effect
//! is asked for, they are therefore taken out, and rounds follow as long as they change the model, or until an effect explains as much,
//!
//! ```text
//! J_effect <= f J_poles
//! ```
//!
//! with the training squares J and a factor f of the policy. Where none does, the search goes on with the poles as if they had not been
//! taken out. The effect that they may stand for is fitted twice in these rounds: from where the score test says, as every candidate, and
//! from the lags themselves, which become its sections. The rest of the model was fitted beside them, and the fit without them may
//! have moved it far from there.

use super::round::round;
use super::state::{SearchState, WithLags};
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{Effect, Entry, FreeOrder};
use crate::fit::line_modes::is_same;
use crate::fit::memory::Memory;
use crate::progress::Progress;
use nalgebra::Complex;

/// Names the effect that slow poles of G stand for, if any does; says whether the model became another.
pub(super) fn name_lags(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let hides = |entry: &&Entry| entry.free_order == FreeOrder::HidesInSlowPoles;
    let may_hide = state.setup.allowed.iter().copied().filter(hides).any(|entry| !state.has(entry));
    if !may_hide || state.setup.order_is_given {
        return Ok(false);
    }
    let lags = Memory::of(&state.prepared.record).slow_lags(&state.point, &state.prepared)?;
    let names: Vec<&'static str> = state.point.effects.iter().map(Effect::name).collect();
    let asked = Some((names, lags.len()));
    let is_slow = |pole: &Complex<f64>| lags.iter().any(|lag| is_same(lag, pole));
    let Some(bare) = state.point.without(is_slow)? else { return Ok(false) };
    if state.lags_asked == asked {
        return Ok(false);
    }
    state.lags_asked = asked;
    let before = state.clone();
    state.with_lags = Some(WithLags { point: state.point.clone(), lags });
    let most = state.setup.policy.revision.instead_of_lags * state.cost;
    let named = named(state, bare, most, progress);
    if matches!(named, Ok(true)) {
        state.with_lags = None;
    } else {
        *state = before;
    }
    named
}

/// Searches on from a model without slow poles of G; says whether an effect was added and the model's squares are at most `most`.
fn named(
    state: &mut SearchState,
    bare: Point,
    most: f64,
    progress: Progress,
) -> Result<bool, Error> {
    let fitted = state.fit(bare, &state.setup.options, "slow poles", progress)?;
    (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
    state.left.clear();
    state.is_rich = false;
    let before = state.additions.len();
    let is_named = |state: &SearchState| state.additions.len() > before && state.cost <= most;
    for _ in 0..state.setup.policy.revision.rounds {
        if !round(state, progress)? || is_named(state) {
            break;
        }
    }
    Ok(is_named(state))
}
