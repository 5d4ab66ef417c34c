//! The closed loop: rounds that add effects ([`super::round`]), until nothing more is confirmed and all that was named passes the last
//! examination.

use super::examination::{doubt, impossible};
use super::exchange::{exchange_slow, prefer_driven};
use super::force_at_input::enter_with_input;
use super::pairs::add_pair;
use super::ranking::scored_beside;
use super::refusal::Refusal;
use super::revision::{keep_plausible, shed_lines, straighten};
use super::round::round;
use super::sliding_mass::add_sliding_mass;
use super::slow_poles::name_lags;
use super::state::{Addition, Rejected, SearchState};
use super::trial::trial;
use crate::Error;
use crate::effects::{Entry, Signature};
use crate::progress::{Progress, as_trial, reached};

/// Adds effects until nothing more is confirmed and all that was named passes the last examination. An effect that
/// replaces another one at the end of a round may need more terms, or leave room for more effects, so that the search
/// goes on.
pub(super) fn run(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    reached(progress, "score test", (state.cost / state.prepared.values()).sqrt())?;
    for _ in 0..state.setup.policy.revision.rounds {
        add_effects(state, progress)?;
        let is_replaced = prefer_driven(state, progress)?;
        exchange_slow(state, progress)?;
        if !examine_all(state, progress)? && !is_replaced {
            break;
        }
    }
    enter_with_input(state, progress)?;
    straighten(state, progress)
}

/// Adds effects until nothing more is confirmed.
fn add_effects(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    for _ in 0..state.setup.policy.revision.rounds {
        // a finer grid or a longer fit may have led a mode to a line
        let is_changed = name_lags(state, progress)?
            || round(state, progress)?
            || add_pair(state, progress)?
            || add_sliding_mass(state, progress)?
            || shed_lines(state, progress)?;
        if !is_changed {
            break;
        }
    }
    Ok(())
}

/// Examines every effect once more, now that the model is whole; drops what does not pass, which is not tried again, and
/// says whether there was any. Slow functions of time come first: beside one that follows an error of the model, an effect that
/// the error belongs to has no part of its own.
fn examine_all(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let before = state.refused.len();
    let mut passed = 0;
    while let Some(&place) = slow_first(state).get(passed) {
        let Some(why) = doubt(state, place, progress)? else {
            passed += 1;
            continue;
        };
        if why == Refusal::Impossible && keep_plausible(state, place, progress)? {
            passed = 0;
            continue;
        }
        refuse(state, place, why, progress)?;
        // the others may have depended on it
        passed = 0;
    }
    Ok(state.refused.len() > before)
}

/// Drops the first effect that the last fit has made impossible, or its implausible terms; says whether there was any. Those that the
/// user requires stay.
pub(super) fn drop_impossible(
    state: &mut SearchState,
    required: &[&'static Entry],
    progress: Progress,
) -> Result<bool, Error> {
    for place in 0..state.point.effects.len() {
        let name = state.point.effects[place].name();
        if required.iter().any(|entry| entry.name == name) {
            continue;
        }
        if let Some(why) = impossible(state, &state.point, place)? {
            if !keep_plausible(state, place, progress)? {
                refuse(state, place, why, progress)?;
            }
            return Ok(true);
        }
    }
    Ok(false)
}

/// Drops an effect for a reason. It is not tried again.
fn refuse(
    state: &mut SearchState,
    place: usize,
    why: Refusal,
    progress: Progress,
) -> Result<(), Error> {
    let entry = state.point.effects[place].entry();
    let [_, holdout_rms] = state.rms(&state.point)?;
    state.surpassing.note(entry, why, holdout_rms);
    state.remove(place, progress)?;
    let why = why.in_words("the model");
    let (effect, confounded_with) = (entry.name, Vec::new());
    let probability = None;
    state.refused.push(Rejected { effect, holdout_rms, why, confounded_with, probability });
    if !state.has(entry) {
        state.additions.retain(|one| one.trial.entry.name != effect);
    }
    state.repair()
}

/// The places of all effects, those of slow functions of time first.
fn slow_first(state: &SearchState) -> Vec<usize> {
    let effects = &state.point.effects;
    let is_slow = |place: &usize| effects[*place].entry().signature == Signature::SlowInTime;
    let (mut first, rest): (Vec<usize>, Vec<usize>) = (0..effects.len()).partition(is_slow);
    first.extend(rest);
    first
}

/// Adds an effect that the user asks for, whatever it gains.
pub(super) fn force(
    state: &mut SearchState,
    entry: &'static Entry,
    progress: Progress,
) -> Result<(), Error> {
    if state.has(entry) {
        return Ok(());
    }
    state.refused.retain(|one| one.effect != entry.name);
    let best = scored_beside(state, &state.point, &[entry], progress)?.into_iter().next();
    let Some(best) = best else {
        let requirement =
            "the record does not show where or at which frequency to add it; do not require it";
        return Err(Error::parameter("require", entry.name, requirement));
    };
    let trial = as_trial(progress, ("trials", entry.name), (0, 1), |progress| {
        trial(state, best, progress)
    })?;
    state.add(Addition::alone(trial))
}
