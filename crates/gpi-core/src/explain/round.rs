//! One round of the search: candidates, their joint fits, and the one that is taken.

use super::choice::{choose, refusal};
use super::examination::examine;
use super::forces::{Balanced, balanced, forces, remember_out_of_reach};
use super::grid::{finer_grids_instead, refine_grids};
use super::judgement::{Evidence, judge};
use super::probability::probabilities;
use super::ranking::{Ranked, ranked};
use super::refusal::Refusal;
use super::restart::from_others;
use super::revision::{drop_superfluous, rearrange, shed_sections, straighten};
use super::sensor_range;
use super::slow_candidate;
use super::state::{Addition, Rejected, SearchState, Trial};
use super::steps::finer_steps;
use super::trial::{join_modes, trials};
use crate::Error;
use crate::Progress;
use crate::effects::{Entry, FreeOrder, Signature, Stage};
use crate::fit::minimize::Fitted;
use std::collections::BTreeSet;

/// Takes the best effect, if any is confirmed; says whether the model became another.
pub(super) fn round(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    state.unconfirmed = None;
    let Some(best) = candidates(state, progress)? else {
        state.last.clear();
        return Ok(false);
    };
    let (mut trials, failed) = fitted(state, best, progress)?;
    let before = state.held_out(&state.point)?;
    begin_again(state, &mut trials, &before, progress)?;
    let balanced = balance(state, &trials, progress)?;
    let mut evidences = evidences(state, &trials, &before, &balanced)?;
    match examined(state, &trials, &mut evidences, progress)? {
        Found::FinerGrids => Ok(true),
        Found::Effect { place } => {
            let (others, probability) = answers(state, &trials, &evidences, Some(place), failed)?;
            let trial = trials.swap_remove(place);
            add(state, Addition { trial, others, probability, dropped: Vec::new() }, progress)?;
            Ok(true)
        }
        Found::Nothing { better } => {
            (state.last, _) = answers(state, &trials, &evidences, None, failed)?;
            let unconfirmed = unconfirmed(state, &trials, &evidences);
            let Some(better) = better else {
                // what a strong candidate promised may be that of a finer grid
                if !state.is_rich && refine_grids(state, progress)? {
                    return Ok(true);
                }
                state.unconfirmed = unconfirmed;
                return Ok(false);
            };
            (state.point, state.cost) = (better.point, better.linearization.cost);
            Ok(true)
        }
    }
}

/// The best candidates, with those that the balance of forces and a sensor's range propose; `None` where none promises enough.
fn candidates(state: &mut SearchState, progress: Progress) -> Result<Option<Vec<Ranked>>, Error> {
    let policy = &state.setup.policy;
    let promised = |best: &[Ranked]| best.iter().map(|one| one.score.gain).fold(0.0, f64::max);
    let mut best = ranked(state, progress)?;
    // A strong candidate is fitted first: a finer grid would partly replace it.
    let is_weak = promised(&best) < policy.ranking.strong;
    if is_weak && !state.is_rich && refine_grids(state, progress)? {
        best = ranked(state, progress)?;
    }
    let most = promised(&best);
    let forces = forces(state, most, progress)?;
    if forces.is_empty() && most < policy.ranking.hopeless * policy.judgement.least {
        return Ok(None);
    }
    // more of what the model has needs no new name
    let rest = best.split_off(policy.ranking.fitted.min(best.len()));
    best.extend(rest.into_iter().filter(|one| state.is_more(one.entry)));
    best.extend(slow_candidate::candidate(state, &best)?);
    best.extend(forces);
    best.extend(sensor_range::candidate(state)?);
    Ok(Some(best))
}

/// A candidate whose fit failed, and why.
type Failed = (&'static Entry, Error);

/// The fits of candidates, one for each effect, by what they explain beyond the significance threshold; and those that failed.
fn fitted(
    state: &mut SearchState,
    best: Vec<Ranked>,
    progress: Progress,
) -> Result<(Vec<Trial>, Vec<Failed>), Error> {
    let (mut fits, mut failed) = (Vec::new(), Vec::new());
    for tried in trials(state, best, progress)? {
        tried.map_or_else(|one| failed.push(one), |trial| fits.push(trial));
    }
    remember_out_of_reach(state, &fits)?;
    // one that diverges on what is held out predicts nothing
    fits.retain(|trial| trial.held_out.iter().all(|squares| squares.is_finite()));
    fits.sort_by(|a, b| (b.deviance - b.threshold).total_cmp(&(a.deviance - a.threshold)));
    if state.adds_up_forces(&state.point)? {
        // that which began at the balance of forces, whatever the squares
        fits.sort_by_key(|trial| !trial.is_far);
    }
    // of two fits of the same effect, the better one
    let mut names = BTreeSet::new();
    fits.retain(|trial| names.insert(trial.entry.name));
    Ok((fits, failed))
}

/// Fits the effect of the trial that would be taken from its other candidates, too; the better fit stays.
fn begin_again(
    state: &SearchState,
    trials: &mut [Trial],
    before: &[f64],
    progress: Progress,
) -> Result<(), Error> {
    if trials.iter().all(|trial| trial.others.is_empty()) {
        return Ok(());
    }
    let balanced = balance(state, trials, progress)?;
    let Some(place) = chosen(state, &evidences(state, trials, before, &balanced)?) else {
        return Ok(());
    };
    if let Some(better) = from_others(state, &trials[place], progress)? {
        trials[place] = better;
    }
    Ok(())
}

/// The trial that takes most of the training squares, where that is a large part and the held-out blocks do not confirm it.
fn unconfirmed(state: &SearchState, trials: &[Trial], evidences: &[Evidence]) -> Option<Trial> {
    let policy = &state.setup.policy.judgement;
    let is_doubtful = |evidence: &Evidence| {
        let [before, after] = evidence.squares;
        judge(evidence, policy) == Err(Refusal::Unconfirmed)
            && after < (1.0 - policy.substantial) * before
    };
    evidences.iter().position(is_doubtful).map(|place| trials[place].clone())
}

/// The place of the trial to take.
fn chosen(state: &SearchState, evidences: &[Evidence]) -> Option<usize> {
    let policy = &state.setup.policy;
    choose(evidences, policy.examination.measured_instead, &policy.judgement)
}

/// What the examination of the trials found.
enum Found {
    /// Finer grids explain as much as an effect, and were taken.
    FinerGrids,
    /// A trial that has passed.
    Effect { place: usize },
    /// None has passed. `better` is the best fit without the effect of one of them, where it is better than the model.
    Nothing { better: Option<Box<Fitted>> },
}

/// Examines the trials in the order of their evidence until one passes. Those that do not are marked in their evidence.
fn examined(
    state: &mut SearchState,
    trials: &[Trial],
    evidences: &mut [Evidence],
    progress: Progress,
) -> Result<Found, Error> {
    let mut better: Option<Box<Fitted>> = None;
    while let Some(place) = chosen(state, evidences) {
        let examined = examine(state, &trials[place], &evidences[place], progress)?;
        if examined.refusal.is_none() {
            // what the declared model can explain is no effect, unless the balance of forces shows it
            let is_asked = !state.is_rich && !evidences[place].is_balanced;
            let is_finer = is_asked && finer_grids_instead(state, &trials[place], progress)?;
            return Ok(if is_finer { Found::FinerGrids } else { Found::Effect { place } });
        }
        evidences[place].doubt = examined.refusal;
        let trial = &trials[place];
        if let Some(why) = examined.refusal {
            state.surpassing.note(trial.entry, why, trial.rms[1]);
        }
        let is_better = |one: &Fitted| {
            better.as_ref().is_none_or(|known| one.linearization.cost < known.linearization.cost)
        };
        better = examined.without.filter(is_better).map(Box::new).or(better);
    }
    Ok(Found::Nothing { better })
}

/// What is said of the trials that are not taken, and how probable the taken one is beside those that were also accepted.
fn answers(
    state: &SearchState,
    trials: &[Trial],
    evidences: &[Evidence],
    taken: Option<usize>,
    failed: Vec<Failed>,
) -> Result<(Vec<Rejected>, Option<f64>), Error> {
    let policy = &state.setup.policy.judgement;
    let reject = |place: usize| {
        let refusal = refusal(&evidences[place], taken.map(|taken| &evidences[taken]), policy);
        rejected(&trials[place], refusal, taken.map(|taken| &trials[taken]))
    };
    let rest = || (0..trials.len()).filter(|&place| Some(place) != taken);
    let mut others: Vec<Rejected> = rest().map(reject).collect();
    let probability = taken.and_then(|taken| {
        let accepted = |&place: &usize| judge(&evidences[place], policy).is_ok();
        let rivals: Vec<&[f64]> =
            rest().filter(accepted).map(|place| &trials[place].held_out[..]).collect();
        let (own, of_others) = probabilities(&trials[taken].held_out, &rivals)?;
        let accepted = others.iter_mut().zip(rest()).filter(|(_, place)| accepted(place));
        accepted.zip(of_others).for_each(|((other, _), of)| other.probability = Some(of));
        Some(own)
    });
    let [_, unchanged] = state.rms(&state.point)?;
    others.extend(failed.into_iter().map(|one| failure(one, unchanged)));
    Ok((others, probability))
}

/// Adds an effect, and examines earlier decisions again beside it.
pub(super) fn add(
    state: &mut SearchState,
    mut addition: Addition,
    progress: Progress,
) -> Result<(), Error> {
    let joins = addition.trial.entry.free_order == FreeOrder::JoinsG;
    if joins && !state.setup.order_is_given {
        join_modes(&mut addition.trial.point);
    }
    state.add(addition)?;
    // the grids were placed before this effect was known
    state.is_rich = false;
    if finer_steps(state, progress)? {
        shed_sections(state, progress)?;
    }
    rearrange(state, progress)?;
    drop_superfluous(state, progress)?;
    straighten(state, progress)
}

/// What the balance of forces says of each trial.
fn balance(
    state: &SearchState,
    trials: &[Trial],
    progress: Progress,
) -> Result<Vec<Option<Balanced>>, Error> {
    trials.iter().map(|trial| balanced(state, trial, progress)).collect()
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
    let is_worse = balanced.is_some_and(|own| own.is_worse);
    let of_output = ([state.cost, trial.cost], [before, &trial.held_out[..]]);
    let (squares, held_out) =
        balanced.map_or(of_output, |own| (own.squares, [&own.held_out[0][..], &own.held_out[1]]));
    let is_asked = balanced.is_none() && trial.deviance > trial.threshold;
    let change = is_asked.then(|| state.held_out_change(&state.point, &trial.point)).transpose()?;
    // the many terms of an expansion follow what a finite number of plays leaves
    let is_misfit =
        trial.entry.is_expansion && state.cost <= state.setup.policy.grid.at_noise * noise;
    let unconfirmed = is_worse.then_some(Refusal::Unconfirmed);
    Ok(Evidence {
        deviance: if balanced.is_some() {
            state.prepared.values() * (squares[0] / squares[1]).ln()
        } else {
            trial.deviance
        },
        threshold: trial.threshold,
        squares,
        noise,
        held_out_noise: noise * state.setup.held_out_values() / state.prepared.values(),
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
        is_expansion: trial.entry.is_expansion,
        is_balanced: balanced.is_some(),
        is_integrated: balanced.is_none() && state.integrates()?,
        doubt: unconfirmed.or(is_misfit.then_some(Refusal::MisfitOfPlays)),
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
