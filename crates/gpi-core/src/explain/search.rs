//! The closed loop: score candidates, fit the best few jointly, keep what the held-out data confirm.

use super::grid::refine_grids;
use super::judgement::{Evidence, Refusal, choose, refusal};
use super::ranking::{ranked, scored_beside};
use super::revision::{drop_superfluous, join_modes, prefer_driven, rearrange, shed_lags};
use super::setup::SearchSetup;
use super::state::{Addition, Rejected, SearchState, Trial};
use super::trial::{trial, trials};
use crate::Error;
use crate::effects::{Entry, FreeOrder, Signature};
use crate::progress::Progress;

/// Adds effects until nothing more is confirmed.
pub(super) fn run(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    for _ in 0..state.setup.policy.revision.rounds {
        if !round(state, progress)? && !shed_lags(state, progress)? {
            break;
        }
    }
    prefer_driven(state, progress)
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
    if best.iter().all(|one| one.score.gain < hopeless) {
        state.last.clear();
        return Ok(false);
    }
    best.truncate(policy.fitted);
    let mut trials = trials(state, best, progress)?;
    // by what is explained beyond the significance threshold
    trials.sort_by(|a, b| (b.deviance - b.threshold).total_cmp(&(a.deviance - a.threshold)));
    let before = state.held_out(&state.point)?;
    let noise = state.noise_squares()?;
    let evidence = |trial| evidence(state, trial, noise, &before);
    let evidences: Vec<Evidence> = trials.iter().map(evidence).collect();
    let judgement = &state.setup.policy.judgement;
    let taken = choose(&evidences, judgement);
    let reject = |place: usize| {
        let refusal = refusal(&evidences[place], taken.map(|taken| &evidences[taken]), judgement);
        rejected(state.setup, &trials[place], refusal, taken.map(|taken| &trials[taken]))
    };
    let others = (0..trials.len()).filter(|&place| Some(place) != taken).map(reject).collect();
    let Some(taken) = taken else {
        state.last = others;
        return Ok(false);
    };
    let trial = trials.swap_remove(taken);
    state.point = trial.point.clone();
    if trial.entry.free_order == FreeOrder::JoinsG && !state.setup.order_is_given {
        join_modes(&mut state.point);
    }
    state.add(Addition { trial, others, dropped: Vec::new() })?;
    // the grids were placed before this effect was known
    state.is_rich = false;
    rearrange(state, progress)?;
    drop_superfluous(state, progress)?;
    Ok(true)
}

/// A trial in numbers, with the held-out squares before it.
fn evidence<'a>(
    state: &SearchState,
    trial: &'a Trial,
    noise: f64,
    before: &'a [f64],
) -> Evidence<'a> {
    Evidence {
        deviance: trial.deviance,
        threshold: trial.threshold,
        squares: [state.cost, trial.cost],
        noise,
        held_out: [before, &trial.held_out],
        is_driven: trial.is_driven,
        is_unique: trial.entry.signature == Signature::Unique,
        is_more: state.is_more(trial.entry),
        is_plausible: state.is_plausible(&trial.point),
    }
}

fn rejected(setup: &SearchSetup, trial: &Trial, why: Refusal, taken: Option<&Trial>) -> Rejected {
    let taken = taken.map(|taken| taken.entry.name);
    let alike = taken.filter(|_| why == Refusal::Confounded);
    Rejected {
        effect: trial.entry.name,
        holdout_rms: setup.holdout_rms(&trial.held_out),
        why: why.in_words(taken.unwrap_or("the model")),
        confounded_with: alike.into_iter().collect(),
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
    let best = scored_beside(state, &state.point, &[entry], progress)?.into_iter().next();
    let Some(best) = best else {
        let requirement = "the record shows nothing to place it by; leave it out";
        return Err(Error::parameter("require", entry.name, requirement));
    };
    let trial = trial(state, best, progress)?;
    state.point = trial.point.clone();
    state.add(Addition { trial, others: Vec::new(), dropped: Vec::new() })
}
