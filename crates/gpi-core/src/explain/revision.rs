//! Earlier decisions, examined again once more is known.
//!
//! All decisions compare two fitted models by the deviance lost, `lost = N ln(J_without / J_with)`, J the training
//! squares, and by the held-out squares T. The factors f are those of the policy.
//!
//! | decision | condition |
//! |---|---|
//! | an effect is superfluous | `lost` < threshold of the newest effect, and `T_without < f T_with` |
//! | an added signal moves to the other side of the output stage | `J_moved < (1 - f) J` |
//! | a driven effect replaces a slow function of time | `lost + M ln(T_driven / T_slow)` < threshold of the slow one, M values being held out, `T_driven < f T_slow`, plausible values; both are fitted by as many steps |
//! | a slow function of time replaces another | `J_other < (1 - f) J` |
//! | an effect replaces slow poles of G | `J_effect <= f J_poles` at the end of the search, else the poles return |
//! | a mode of G that follows a line, or rings on, is taken out | always ([`crate::fit::line_modes`]) |
//!
//! An effect that was accepted early, with little else in the model, has often taken what belongs to a later one. The
//! first decision is therefore made after each addition. The dropped effect may have moved the newest one far from
//! where it would be alone; the fit without it is thus also started from the score test, and the better one counts.
//!
//! Slow functions of time are flexible enough to follow much of what the input drives, but they do not predict another
//! experiment. That is why a driven effect that explains as much is preferred, and not the other way round.

use super::judgement::{Significance, is_superfluous};
use super::ranking::{Ranked, scored_beside};
use super::state::{Addition, BeforeLags, SearchState, Trial};
use super::trial::{fitted, measured, start, threshold};
use crate::Error;
use crate::Progress;
use crate::chain::point::Point;
use crate::effects::{CATALOGUE, Entry, FreeOrder, Place, Signature};
use crate::fit::line_modes::{is_same, line_modes};
use crate::fit::memory::Memory;
use crate::fit::minimize::{FitOptions, Fitted};
use crate::progress::as_trial;
use nalgebra::Complex;

/// Moves added signals to the other side of the output stage where that explains more.
pub(super) fn rearrange(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    if !state.point.senses() {
        return Ok(());
    }
    for place in 0..state.point.effects.len() {
        let Some(other) = state.point.effects[place].elsewhere() else { continue };
        let moved = state.point.without_effect(place).with_effect(other);
        let fitted = state.fit(moved, &state.setup.options, "rearrangement", progress)?;
        if fitted.linearization.cost < (1.0 - state.setup.policy.revision.other_side) * state.cost {
            (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
        }
    }
    Ok(())
}

/// Drops effects that a later one has made superfluous.
pub(super) fn drop_superfluous(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    let Some(newest) = state.additions.last().map(|addition| addition.trial.clone()) else {
        return Ok(());
    };
    let mut place = 0;
    while state.point.effects.len() > 1 && place < state.point.effects.len() {
        let name = state.point.effects[place].name();
        // a free function of time does not replace what was measured
        let is_measured = matches!(state.point.effects[place].place(), Place::Added(_))
            && state.point.effects[place].entry().driven;
        let keeps = is_measured && newest.entry.signature == Signature::SlowInTime;
        if name == newest.entry.name || keeps {
            place += 1;
            continue;
        }
        let fitted = as_trial(progress, ("examination", name), (0, 1), |progress| {
            without(state, place, newest.entry, progress)
        })?;
        let lost = state.prepared.values() * (fitted.linearization.cost / state.cost).ln();
        let now = state.held_out(&state.point)?;
        let then = state.held_out(&fitted.point)?;
        let factor = state.setup.policy.revision.superfluous;
        if is_superfluous(lost, newest.threshold, [&now, &then], factor) {
            (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
            if let Some(addition) = state.additions.last_mut() {
                addition.dropped.push(name);
            }
        } else {
            place += 1;
        }
    }
    Ok(())
}

/// The best fit without one of the effects. The newest effect is also started from the score test again, because in the
/// presence of the dropped one it may have moved to where no fit leads back from.
fn without(
    state: &SearchState,
    place: usize,
    newest: &'static Entry,
    progress: Progress,
) -> Result<Fitted, Error> {
    let without = state.point.without_effect(place);
    let (refitted, _) = fitted(state, without.clone(), newest, progress)?;
    let own = without.effects.iter().rposition(|effect| effect.name() == newest.name);
    let Some(own) = own.filter(|_| newest.driven) else { return Ok(refitted) };
    let point = without.without_effect(own);
    let best = scored_beside(state, &point, &[newest], progress)?.into_iter().next();
    let Some(best) = best else { return Ok(refitted) };
    let start = start(state, &point, best.score)?;
    let (anew, _) = fitted(state, start, newest, progress)?;
    let is_better = anew.linearization.cost < refitted.linearization.cost;
    Ok(if is_better { anew } else { refitted })
}

/// Replaces a slow function of time, which can fit much, by an effect that the input drives and that explains as much;
/// says whether there was any.
pub(super) fn prefer_driven(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let mut is_replaced = false;
    let is_slow = |entry: &Entry| entry.signature == Signature::SlowInTime;
    let driven: Vec<&'static Entry> =
        state.setup.allowed.iter().copied().filter(|own| own.driven && !is_slow(own)).collect();
    // from the end of the chain
    for slow in CATALOGUE.iter().rev().filter(|entry| is_slow(entry)) {
        let place = state.point.effects.iter().position(|effect| effect.name() == slow.name);
        let Some(place) = place else { continue };
        let without = state.point.without_effect(place);
        let best = scored_beside(state, &without, &driven, progress)?.into_iter().next();
        let Some(Ranked { entry, score, .. }) = best else { continue };
        let named = state.additions.iter().find(|addition| addition.trial.entry.name == slow.name);
        let Some(deviance) = named.map(|own| own.trial.deviance) else { continue };
        let steps = state.setup.policy.revision.longer * state.setup.options.steps;
        let options = FitOptions { steps, ..state.setup.options.clone() };
        let gain = score.gain;
        let start = start(state, &without, score)?;
        let fitted = as_trial(progress, ("exchange", entry.name), (0, 1), |progress| {
            state.fit(start, &options, entry.name, progress)
        })?;
        let threshold = fit_slow_again(state, slow, &options, deviance, progress)?;
        let options = state.setup.options.clone();
        let trial = measured(state, &without, entry, fitted, options, gain, progress)?;
        let held_out = state.held_out(&state.point)?;
        let lost = lost(state, &trial, &held_out);
        // what the slow function had gained, less what is lost with it
        let trial = Trial { deviance: deviance - lost, ..trial };
        let factor = state.setup.policy.revision.driven_instead;
        if trial.is_driven
            && state.is_plausible(&trial.point)
            && is_superfluous(lost, threshold, [&held_out, &trial.held_out], factor)
        {
            let dropped = vec![slow.name];
            state.point = trial.point.clone();
            state.add(Addition { trial, others: Vec::new(), dropped })?;
            // the grids were placed, and the effect's terms counted, beside the slow function
            state.is_rich = false;
            is_replaced = true;
        }
    }
    Ok(is_replaced)
}

/// Fits the present model by the steps that its rival had, because two fits that ended at their step limits are compared
/// only where both had as many; with the slow function at a place as it is and as the score test would choose it now,
/// with fewer knots where these suffice. The better one in the BIC becomes the present model. Returns what the slow
/// function must gain there.
fn fit_slow_again(
    state: &mut SearchState,
    slow: &'static Entry,
    options: &FitOptions,
    deviance: f64,
    progress: Progress,
) -> Result<f64, Error> {
    let values = state.prepared.values();
    let place = |point: &Point| point.effects.iter().position(|one| one.name() == slow.name);
    let without = place(&state.point).map(|place| state.point.without_effect(place));
    let mut starts = vec![state.point.clone()];
    if let Some(without) = &without {
        let anew = scored_beside(state, without, &[slow], progress)?.into_iter().next();
        starts.extend(anew.map(|best| start(state, without, best.score)).transpose()?);
    }
    let mut best: Option<(Fitted, f64)> = None;
    for start in starts {
        let fitted = as_trial(progress, ("exchange", slow.name), (0, 1), |progress| {
            state.fit(start, options, slow.name, progress)
        })?;
        let price = state.setup.unknowns(&fitted.point) as f64 * values.ln();
        let information = values * fitted.linearization.cost.ln() + price;
        if best.as_ref().is_none_or(|(_, least)| information < *least) {
            best = Some((fitted, information));
        }
    }
    let Some((fitted, _)) = best else { return Ok(0.0) };
    (state.point, state.cost) = (fitted.point.clone(), fitted.linearization.cost);
    let unknowns = |point: &Point| state.setup.unknowns(point);
    let significance = Significance {
        values,
        added: unknowns(&state.point) - without.as_ref().map_or(0, unknowns),
        is_long: state.setup.is_long(&state.point),
        is_more: false,
    };
    threshold(state, fitted, options.clone(), significance, deviance, progress)
}

/// The deviance lost with a trial, on the training data and on what is held out.
fn lost(state: &SearchState, trial: &Trial, held_out: &[f64]) -> f64 {
    let [before, after] = [held_out, &trial.held_out].map(|blocks| blocks.iter().sum::<f64>());
    state.prepared.values() * (trial.cost / state.cost).ln()
        + state.setup.held_out_values() * (after / before).ln()
}

/// Replaces a slow function of time by one that acts elsewhere where that explains more, now that the rest is known.
pub(super) fn exchange_slow(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    if state.additions.len() < 2 {
        return Ok(());
    }
    let is_slow = |entry: &Entry| entry.signature == Signature::SlowInTime;
    for place in 0..state.point.effects.len() {
        let own = state.point.effects[place].entry();
        let is_other = |entry: &&Entry| is_slow(entry) && !state.has(entry);
        let others: Vec<&'static Entry> =
            state.setup.allowed.iter().copied().filter(is_other).collect();
        if !is_slow(own) || others.is_empty() {
            continue;
        }
        let without = state.point.without_effect(place);
        let best = scored_beside(state, &without, &others, progress)?.into_iter().next();
        let Some(Ranked { entry, score, .. }) = best else { continue };
        let gain = score.gain;
        let start = start(state, &without, score)?;
        let (fitted, options) = as_trial(progress, ("exchange", entry.name), (0, 1), |progress| {
            fitted(state, start, entry, progress)
        })?;
        let most = (1.0 - state.setup.policy.revision.other_side) * state.cost;
        if fitted.linearization.cost < most {
            let trial = measured(state, &without, entry, fitted, options, gain, progress)?;
            state.point = trial.point.clone();
            let dropped = vec![own.name];
            state.add(Addition { trial, others: Vec::new(), dropped })?;
        }
    }
    Ok(())
}

/// Takes slow poles out of G that came when something else was fitted, so that the next round can name the effect that
/// hides in them; says whether there were any.
pub(super) fn shed_lags(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let hides = |entry: &&Entry| entry.free_order == FreeOrder::HidesInSlowPoles;
    let may_hide = state.setup.allowed.iter().copied().filter(hides).any(|entry| !state.has(entry));
    if !may_hide || state.setup.order_is_given || state.before_lags.is_some() {
        return Ok(false);
    }
    let memory = Memory::of(&state.prepared.record);
    let Some(point) = state.point.without(|pole| memory.is_slow_lag(pole))? else {
        return Ok(false);
    };
    let fitted = state.fit(point, &state.setup.options, "slow poles", progress)?;
    let before = std::mem::replace(&mut state.point, fitted.point);
    let additions = state.additions.len();
    state.before_lags = Some(BeforeLags { point: before, cost: state.cost, additions });
    state.cost = fitted.linearization.cost;
    state.is_rich = false;
    Ok(true)
}

/// Takes modes out of G that follow a line of the mains or ring for a large part of the record, so that the next round can name it; says whether there were any.
pub(super) fn shed_lines(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    if state.setup.order_is_given {
        return Ok(false);
    }
    let lines = line_modes(&state.point, &state.prepared.record)?;
    let memory = Memory::of(&state.prepared.record);
    let is_line = |pole: &Complex<f64>| {
        let rings_on = pole.im != 0.0 && memory.is_disturbance(pole);
        rings_on || lines.iter().any(|line| is_same(line, pole))
    };
    let Some(point) = state.point.without(is_line)? else { return Ok(false) };
    let fitted = state.fit(point, &state.setup.options, "lines", progress)?;
    (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
    state.is_rich = false;
    Ok(true)
}

/// Goes back to what was before slow poles were taken out, where no effect explains as much as they did.
pub(super) fn settle_lags(state: &mut SearchState) -> Result<(), Error> {
    let Some(before) = state.before_lags.take() else { return Ok(()) };
    let most = state.setup.policy.revision.instead_of_lags * before.cost;
    if state.additions.len() <= before.additions || state.cost > most {
        state.additions.truncate(before.additions);
        state.point = before.point;
        state.repair()?;
    }
    Ok(())
}
