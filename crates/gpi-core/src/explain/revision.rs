//! Earlier decisions, examined again once more is known.
//!
//! All decisions compare two fitted models by the deviance lost, `lost = N ln(J_without / J_with)`, J the training
//! squares, and by the held-out squares T. The factors f are those of the policy.
//!
//! | decision | condition |
//! |---|---|
//! | an effect is superfluous | `lost` < threshold of the newest effect, and `T_without < f T_with` |
//! | the hysteresis is superfluous beside a loop around G | `lost` < q ln N for its q parameters, and `T_without < f T_with`; or, far from the noise, `J_without <= (1 + f) J`, and `T_without <= (1 + f) T` |
//! | a section of G without resonance is superfluous beside a loop | `J_without <= (1 + f) J`, and `T_without <= (1 + f) T` |
//! | an added signal moves to the other side of the output stage | `J_moved < (1 - f) J` |
//! | of an effect that later fits have made impossible, the plausible terms stay | `J_terms < (1 - f) J_without` |
//! | a slow function of time is replaced | see [`super::exchange`] |
//! | an effect replaces slow poles of G | see [`super::slow_poles`] |
//! | a mode of G that follows a line, or rings on, is taken out | always ([`crate::fit::line_modes`]) |
//!
//! An effect that was accepted early, with little else in the model, has often taken what belongs to a later one. The
//! first decision is therefore made after each addition. The dropped effect may have moved the newest one far from
//! where it would be alone; the fit without it is thus also started from the score test, and the better one counts.

use super::judgement::is_superfluous;
use super::ranking::scored_beside;
use super::state::SearchState;
use super::trial::{fitted, plausible_part, start};
use crate::Error;
use crate::Progress;
use crate::chain::point::Point;
use crate::effects::{Entry, Place, Signature};
use crate::fit::line_modes::{is_same, line_modes};
use crate::fit::memory::Memory;
use crate::fit::minimize::Fitted;
use crate::linear::resonates;
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
        let goal = state.cost * (newest.threshold / state.prepared.values()).exp();
        let fitted = as_trial(progress, ("examination", name), (0, 1), |progress| {
            without(state, place, newest.entry, goal, progress)
        })?;
        let values = state.prepared.values();
        let unknowns = |point| state.setup.unknowns(point);
        let more = unknowns(&fitted.point).saturating_sub(unknowns(&state.point)) as f64;
        let lost = values * (fitted.linearization.cost / state.cost).ln() + more * values.ln();
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

/// Takes the hysteresis before the dynamics out where a loop around them explains what it did. It had stood for the loop.
pub(super) fn straighten(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    let moving = &state.setup.moving;
    let is_free = moving.half_widths && moving.thresholds;
    if !is_free || state.point.loops().next().is_none() {
        return Ok(());
    }
    let straight = state.point.without_hysteresis(&state.prepared.record);
    let unknowns = |point| state.setup.unknowns(point) as f64;
    let price = (unknowns(&state.point) - unknowns(&straight)) * state.prepared.values().ln();
    let fitted = state.fit(straight, &state.setup.options, "rearrangement", progress)?;
    let lost = state.prepared.values() * (fitted.linearization.cost / state.cost).ln();
    let now = state.held_out(&state.point)?;
    let then = state.held_out(&fitted.point)?;
    let policy = &state.setup.policy;
    let is_far = state.cost > policy.judgement.near_noise * state.noise_squares()?;
    let is_negligible = is_far && state.explains_nearly_as_much(&fitted)?;
    if is_negligible || is_superfluous(lost, price, [&now, &then], policy.revision.superfluous) {
        (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
    }
    Ok(())
}

/// Keeps the plausible terms of an effect that later fits have made impossible, where they remove as large a part of the squares as
/// an effect must; says whether they stay.
pub(super) fn keep_plausible(
    state: &mut SearchState,
    place: usize,
    progress: Progress,
) -> Result<bool, Error> {
    let entry = state.point.effects[place].entry();
    let Some(part) = plausible_part(state, &state.point, entry) else { return Ok(false) };
    let fitted = state.fit(part, &state.setup.options, entry.name, progress)?;
    let (_, without) = state.best_without(place, progress)?;
    let cost = fitted.linearization.cost;
    let is_more = cost < (1.0 - state.setup.policy.judgement.least) * without;
    if is_more {
        (state.point, state.cost) = (fitted.point, cost);
    }
    Ok(is_more)
}

/// Takes sections out of G that stood for what a loop does now: those that have no resonance, beside one that has.
///
/// Such a section takes a share of what the loop drives, which is then no longer the force on the mode.
pub(super) fn shed_sections(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    let has_loops = state.point.loops().next().is_some();
    if state.setup.order_is_given || !has_loops || !state.point.dynamics.has_resonance() {
        return Ok(());
    }
    let mut section = 0;
    while section < state.point.dynamics.sections.len() {
        let mut poles = state.point.dynamics.sections[section].poles().into_iter();
        if poles.any(|pole| resonates(&pole)) {
            section += 1;
            continue;
        }
        let without = state.point.without_section(section);
        let fitted = state.fit(without, &state.setup.options, "rearrangement", progress)?;
        if state.explains_nearly_as_much(&fitted)? {
            (state.point, state.cost) = (fitted.point, fitted.linearization.cost);
        } else {
            section += 1;
        }
    }
    Ok(())
}

/// The best fit without one of the effects. The newest effect is also started from the score test again, because in the
/// presence of the dropped one it may have moved to where no fit leads back from, and more of it is added where it repeats: the dropped
/// one may have done a part of it. Squares above `goal` are not asked for.
fn without(
    state: &SearchState,
    place: usize,
    newest: &'static Entry,
    goal: f64,
    progress: Progress,
) -> Result<Fitted, Error> {
    let without = state.point.without_effect(place);
    let (mut best, _) = fitted(state, without.clone(), newest, goal, progress)?;
    let own = without.effects.iter().rposition(|effect| effect.name() == newest.name);
    let Some(own) = own.filter(|_| newest.driven) else { return Ok(best) };
    let anew = beside(state, &without.without_effect(own), newest, goal, progress)?;
    best = better(best, anew);
    if best.linearization.cost > goal && newest.repeats {
        let more = beside(state, &best.point, newest, goal, progress)?;
        best = better(best, more);
    }
    Ok(best)
}

/// The fit of an effect beside a model from where the score test says, if it promises anything.
fn beside(
    state: &SearchState,
    point: &Point,
    entry: &'static Entry,
    goal: f64,
    progress: Progress,
) -> Result<Option<Fitted>, Error> {
    let best = scored_beside(state, point, &[entry], progress)?.into_iter().next();
    let Some(best) = best else { return Ok(None) };
    let start = start(state, point, best.score)?;
    Ok(Some(fitted(state, start, entry, goal, progress)?.0))
}

/// The fit that leaves less.
fn better(one: Fitted, other: Option<Fitted>) -> Fitted {
    match other {
        Some(other) if other.linearization.cost < one.linearization.cost => other,
        _ => one,
    }
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
    state.left.clear();
    state.is_rich = false;
    Ok(true)
}
