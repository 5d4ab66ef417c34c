//! Whether the best trial of a round has earned its name.
//!
//! A trial that is significant, confirmed and substantial ([`super::judgement`]) may still be the work of something
//! else. Before its effect is named it must also pass the following.
//!
//! 1. *Possible*: its values are such as a machine can have ([`Block::is_possible`](crate::effects::Block)).
//! 2. *Its own part*: what it adds to the output differs from all that the rest of the model can do ([`own_part`]). This is
//!    a linear statement, and parameters have bounds; so a fit without the effect must also recover a part of its gain.
//! 3. *Bridges gaps*: a slow function of time predicts gaps between its knots as well as it fits ([`gaps`]).
//! 4. *Not a longer fit*: the model without it, fitted again from where the trial ended, does worse by more than chance.
//!
//! The first three questions are asked again of every effect when the search has ended, and one more, which another
//! effect that is not found yet would make nonsense of:
//!
//! 5. *Small, or at the noise*: an effect that is a large part of the output has brought the model near the noise
//!    ([`size`]). A large effect that leaves much unexplained follows another structure.

mod contribution;
mod gaps;
mod own_part;
mod size;

use super::judgement::{Evidence, Refusal, judge};
use super::state::{SearchState, Trial};
use super::trial::fitted;
use crate::chain::point::Point;
use crate::effects::{Effect, Signature};
use crate::fit::minimize::Fitted;
use crate::{Error, Progress};

/// The answer for a trial.
pub(super) struct Examination {
    /// Why the effect is not named, if so.
    pub refusal: Option<Refusal>,
    /// The model without the effect, fitted from where the trial ended, where that is better than the present model.
    pub without: Option<Fitted>,
}

/// Examines a trial that was chosen by its evidence.
pub(super) fn examine(
    state: &SearchState,
    trial: &Trial,
    evidence: &Evidence,
    progress: Progress,
) -> Result<Examination, Error> {
    let Some(place) = newest(&trial.point, trial.entry.name) else {
        return Ok(Examination { refusal: None, without: None });
    };
    // what is refused may have shown the way to a better model without it
    let (without, _) = fitted(state, trial.point.without_effect(place), trial.entry, progress)?;
    let cost = without.linearization.cost;
    let is_recovered =
        cost - trial.cost < state.setup.policy.examination.recovered * (state.cost - trial.cost);
    let refusal = doubt(state, &trial.point, place, trial.cost)?;
    let refusal = refusal.filter(|why| *why != Refusal::NotItsOwn || is_recovered);
    if cost >= (1.0 - state.setup.policy.examination.better) * state.cost {
        return Ok(Examination { refusal, without: None });
    }
    let held_out = state.held_out(&without.point)?;
    let alone = Evidence {
        deviance: trial.deviance.min(state.prepared.values() * (cost / trial.cost).ln()),
        squares: [cost, trial.cost],
        held_out: [&held_out, &trial.held_out],
        ..*evidence
    };
    let again = judge(&alone, &state.setup.policy.judgement).err().map(|_| Refusal::LongerFit);
    Ok(Examination { refusal: refusal.or(again), without: Some(without) })
}

/// Why the effect at a place of a fitted point is not named, if so; `cost` are the point's training squares.
pub(super) fn doubt(
    state: &SearchState,
    point: &Point,
    place: usize,
    cost: f64,
) -> Result<Option<Refusal>, Error> {
    let effect = &point.effects[place];
    if effect.block().is_some_and(|block| !block.is_possible()) {
        return Ok(Some(Refusal::Impossible));
    }
    if !own_part::is_beyond_chance(state, point, place, cost)? {
        return Ok(Some(Refusal::NotItsOwn));
    }
    let is_slow = effect.entry().signature == Signature::SlowInTime;
    if is_slow && gaps::are_missed(state, point, place)? {
        return Ok(Some(Refusal::Gaps));
    }
    Ok(None)
}

/// The same for an effect of the present model when the search has ended.
pub(super) fn doubt_at_the_end(
    state: &SearchState,
    place: usize,
    progress: Progress,
) -> Result<Option<Refusal>, Error> {
    let refusal = match doubt(state, &state.point, place, state.cost)? {
        Some(Refusal::NotItsOwn) => {
            let without = state.point.without_effect(place);
            let fitted = state.fit(without, &state.setup.options, "without it", progress)?;
            let most = (1.0 + state.setup.policy.judgement.least) * state.cost;
            (fitted.linearization.cost < most).then_some(Refusal::NotItsOwn)
        }
        other => other,
    };
    if refusal.is_none() && size::is_too_large(state, &state.point, place)? {
        return Ok(Some(Refusal::TooLarge));
    }
    Ok(refusal)
}

/// Where the newest effect of a name stands.
fn newest(point: &Point, name: &str) -> Option<usize> {
    point.effects.iter().rposition(|effect: &Effect| effect.name() == name)
}
