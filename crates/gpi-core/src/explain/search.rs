//! The closed loop: score candidates, fit the best few jointly, keep what the held-out data confirm.

use super::examination::{doubt, examine};
use super::exchange::{exchange_slow, prefer_driven};
use super::force_at_input::enter_with_input;
use super::forces::{Balanced, balanced, forces, remember_out_of_reach};
use super::grid::{finer_grids_instead, refine_grids};
use super::judgement::{Evidence, choose, judge, refusal};
use super::probability::probabilities;
use super::ranking::{ranked, scored_beside};
use super::refusal::Refusal;
use super::restart::from_others;
use super::revision::{
    drop_superfluous, keep_plausible, rearrange, settle_lags, shed_lags, shed_lines, shed_sections,
    straighten,
};
use super::sensor_range;
use super::state::{Addition, Rejected, SearchState, Trial};
use super::steps::finer_steps;
use super::trial::{join_modes, trial, trials as trials_of};
use crate::Error;
use crate::effects::{Entry, FreeOrder, Signature, Stage};
use crate::fit::minimize::Fitted;
use crate::progress::{Progress, as_trial, reached};
use std::collections::BTreeSet;

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
    if settle_lags(state)? {
        examine_all(state, progress)?;
    }
    enter_with_input(state, progress)?;
    straighten(state, progress)
}

/// Adds effects until nothing more is confirmed.
fn add_effects(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    for _ in 0..state.setup.policy.revision.rounds {
        // a finer grid or a longer fit may have led a mode to a line
        if !round(state, progress)? && !shed_lines(state, progress)? && !shed_lags(state, progress)?
        {
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
        let entry = state.point.effects[place].entry();
        let [_, holdout_rms] = state.rms(&state.point)?;
        match why {
            Refusal::FollowsInput => {
                state.follows_input = state.follows_input.min(holdout_rms);
            }
            Refusal::Gaps => state.misses_gaps = state.misses_gaps.min(holdout_rms),
            _ => {}
        }
        state.remove(place, progress)?;
        let why = why.in_words("the model");
        let (effect, confounded_with) = (entry.name, Vec::new());
        let probability = None;
        state.refused.push(Rejected { effect, holdout_rms, why, confounded_with, probability });
        if !state.has(entry) {
            state.additions.retain(|one| one.trial.entry.name != effect);
        }
        state.repair()?;
        // the others may have depended on it
        passed = 0;
    }
    Ok(state.refused.len() > before)
}

/// The places of all effects, those of slow functions of time first.
fn slow_first(state: &SearchState) -> Vec<usize> {
    let effects = &state.point.effects;
    let is_slow = |place: &usize| effects[*place].entry().signature == Signature::SlowInTime;
    let (mut first, rest): (Vec<usize>, Vec<usize>) = (0..effects.len()).partition(is_slow);
    first.extend(rest);
    first
}

/// One round: takes the best effect, if any is confirmed; says whether the model became another.
fn round(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let policy = &state.setup.policy.ranking;
    let mut best = ranked(state, progress)?;
    // A strong candidate is fitted first: a finer grid would partly replace it.
    let most = best.iter().map(|one| one.score.gain).fold(0.0, f64::max);
    if most < policy.strong && !state.is_rich && refine_grids(state, progress)? {
        best = ranked(state, progress)?;
    }
    let hopeless = policy.hopeless * state.setup.policy.judgement.least;
    let most = best.iter().map(|one| one.score.gain).fold(0.0, f64::max);
    let forces = forces(state, most, progress)?;
    if forces.is_empty() && most < hopeless {
        state.last.clear();
        return Ok(false);
    }
    best.truncate(state.setup.policy.ranking.fitted);
    best.extend(forces);
    best.extend(sensor_range::candidate(state)?);
    let (mut trials, mut failed) = (Vec::new(), Vec::new());
    for tried in trials_of(state, best, progress)? {
        tried.map_or_else(|one| failed.push(one), |trial| trials.push(trial));
    }
    remember_out_of_reach(state, &trials)?;
    // one that diverges on what is held out predicts nothing
    trials.retain(|trial| trial.held_out.iter().all(|squares| squares.is_finite()));
    // by what is explained beyond the significance threshold
    trials.sort_by(|a, b| (b.deviance - b.threshold).total_cmp(&(a.deviance - a.threshold)));
    // of two fits of the same effect, the better one
    let mut names = BTreeSet::new();
    trials.retain(|trial| names.insert(trial.entry.name));
    let before = state.held_out(&state.point)?;
    let judgement = &state.setup.policy.judgement;
    let measured = state.setup.policy.examination.measured_instead;
    if trials.iter().any(|trial| !trial.others.is_empty()) {
        let balanced = balance(state, &trials)?;
        let evidences = evidences(state, &trials, &before, &balanced)?;
        let chosen = choose(&evidences, measured, judgement);
        if let Some(place) = chosen
            && let Some(better) = from_others(state, &trials[place], progress)?
        {
            trials[place] = better;
        }
    }
    let balanced = balance(state, &trials)?;
    let mut evidences = evidences(state, &trials, &before, &balanced)?;
    let mut better: Option<Fitted> = None;
    let taken = loop {
        let Some(place) = choose(&evidences, measured, judgement) else { break None };
        let examined = examine(state, &trials[place], &evidences[place], progress)?;
        if examined.refusal.is_none() {
            // what the declared model can explain is no effect
            if !state.is_rich && finer_grids_instead(state, &trials[place], progress)? {
                return Ok(true);
            }
            break Some(place);
        }
        evidences[place].doubt = examined.refusal;
        let is_better = |one: &Fitted| {
            better.as_ref().is_none_or(|known| one.linearization.cost < known.linearization.cost)
        };
        better = examined.without.filter(is_better).or(better);
    };
    let reject = |place: usize| {
        let refusal = refusal(&evidences[place], taken.map(|taken| &evidences[taken]), judgement);
        rejected(&trials[place], refusal, taken.map(|taken| &trials[taken]))
    };
    let rest = || (0..trials.len()).filter(|&place| Some(place) != taken);
    let mut others: Vec<Rejected> = rest().map(reject).collect();
    let probability = taken.and_then(|taken| {
        let accepted = |&place: &usize| judge(&evidences[place], judgement).is_ok();
        let rivals: Vec<&[f64]> =
            rest().filter(accepted).map(|place| &trials[place].held_out[..]).collect();
        let (own, of_others) = probabilities(&trials[taken].held_out, &rivals)?;
        let accepted = others.iter_mut().zip(rest()).filter(|(_, place)| accepted(place));
        accepted.zip(of_others).for_each(|((other, _), of)| other.probability = Some(of));
        Some(own)
    });
    let [_, unchanged] = state.rms(&state.point)?;
    others.extend(failed.into_iter().map(|one| failure(one, unchanged)));
    let Some(taken) = taken else {
        state.last = others;
        let Some(better) = better else {
            // what a strong candidate promised may be that of a finer grid
            return Ok(!state.is_rich && refine_grids(state, progress)?);
        };
        (state.point, state.cost) = (better.point, better.linearization.cost);
        return Ok(true);
    };
    let mut trial = trials.swap_remove(taken);
    if trial.entry.free_order == FreeOrder::JoinsG && !state.setup.order_is_given {
        join_modes(&mut trial.point);
    }
    state.add(Addition { trial, others, probability, dropped: Vec::new() })?;
    // the grids were placed before this effect was known
    state.is_rich = false;
    if finer_steps(state, progress)? {
        shed_sections(state, progress)?;
    }
    rearrange(state, progress)?;
    drop_superfluous(state, progress)?;
    straighten(state, progress)?;
    Ok(true)
}

/// What the balance of forces says of each trial.
fn balance(state: &SearchState, trials: &[Trial]) -> Result<Vec<Option<Balanced>>, Error> {
    trials.iter().map(|trial| balanced(state, trial)).collect()
}

/// Trials in numbers, with the held-out squares before them.
fn evidences<'a>(
    state: &SearchState,
    trials: &'a [Trial],
    before: &'a [f64],
    balanced: &'a [Option<Balanced>],
) -> Result<Vec<Evidence<'a>>, Error> {
    let noise = state.noise_squares()?;
    let pairs = trials.iter().zip(balanced);
    pairs
        .map(|(trial, balanced)| evidence(state, trial, noise, before, balanced.as_ref()))
        .collect()
}

/// A trial in numbers, with the held-out squares before it.
fn evidence<'a>(
    state: &SearchState,
    trial: &'a Trial,
    noise: f64,
    before: &'a [f64],
    balanced: Option<&'a Balanced>,
) -> Result<Evidence<'a>, Error> {
    let is_worse = trial.held_out.iter().sum::<f64>() > before.iter().sum::<f64>();
    let of_output = ([state.cost, trial.cost], [before, &trial.held_out[..]]);
    let (squares, held_out) =
        balanced.map_or(of_output, |own| (own.squares, [&own.held_out[0][..], &own.held_out[1]]));
    let is_asked = balanced.is_none() && trial.deviance > trial.threshold;
    let change = is_asked.then(|| state.held_out_change(&state.point, &trial.point)).transpose()?;
    Ok(Evidence {
        deviance: if balanced.is_some() {
            state.prepared.values() * (squares[0] / squares[1]).ln()
        } else {
            trial.deviance
        },
        threshold: trial.threshold,
        squares,
        noise,
        held_out,
        held_out_values: state.setup.held_out_values(),
        change,
        is_driven: trial.is_driven,
        is_simpler: state.setup.estimated(&trial.point) < state.setup.estimated(&state.point),
        is_unique: trial.entry.signature == Signature::Unique,
        is_more: state.is_more(trial.entry),
        is_plausible: state.is_plausible(&trial.point),
        is_measured: trial.entry.driven && trial.entry.stage == Stage::Added,
        is_slow: trial.entry.signature == Signature::SlowInTime,
        is_added: trial.entry.stage == Stage::Added,
        is_integrated: balanced.is_none() && state.integrates()?,
        doubt: (balanced.is_some() && is_worse).then_some(Refusal::Unconfirmed),
    })
}

/// A candidate whose fit failed.
fn failure((entry, error): (&Entry, Error), holdout_rms: f64) -> Rejected {
    Rejected {
        effect: entry.name,
        holdout_rms,
        why: format!("could not be fitted to this record ({error})"),
        confounded_with: Vec::new(),
        probability: None,
    }
}

fn rejected(trial: &Trial, why: Refusal, taken: Option<&Trial>) -> Rejected {
    let taken = taken.map(|taken| taken.entry.name);
    let alike = taken.filter(|_| why == Refusal::Confounded);
    Rejected {
        effect: trial.entry.name,
        holdout_rms: trial.rms[1],
        why: why.in_words(taken.unwrap_or("the model")),
        confounded_with: alike.into_iter().collect(),
        probability: None,
    }
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
    state.add(Addition { trial, others: Vec::new(), probability: None, dropped: Vec::new() })
}
