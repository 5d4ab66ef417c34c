//! Forces inside the mechanics that the balance of forces finds, and the models that fits of them begin at.
//!
//! The score test linearises around the model so far. Where plays and deadzones before the dynamics stand for a force inside them,
//! no small step leads from there to the force; where the output integrates the input, the error of a simulation says little
//! about its cause. The balance ([`super::force_balance`]) needs neither: mass, damping, stiffness and forces follow from it at once, and a fit
//! begins there, without plays and deadzones.

use super::balance_start::{Straight, best, proposals};
use super::force_balance::{balance, squares};
use super::limits::limited;
use super::outside::limits;
use super::ranking::Ranked;
use super::score::Score;
use super::state::{SearchState, Trial};
use super::stretches::held_out;
use super::threshold::Significance;
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{Effect, Entry, InnerLoop, Proposal, Stage};
use crate::fit::initial_state::settled;
use crate::fit::minimize::{FitOptions, Fitted};
use crate::fit::preparation::rescale;
use crate::progress::Progress;

/// States of a mass.
const MECHANICS: usize = 2;

/// The best force of each effect that acts inside the mechanics, with the model to begin at. None where the model has such a force, or the
/// part of the squares that another effect promises brings it near the noise, or where the input repeats one cycle, whose shape any force
/// can take. The balance depends on the record alone, so that it is
/// asked once beside the same other effects.
pub(super) fn forces(
    state: &mut SearchState,
    promised: f64,
    progress: Progress,
) -> Result<Vec<Ranked>, Error> {
    let beside: Vec<&'static str> = state.point.effects.iter().map(Effect::name).collect();
    if state.balanced_beside.as_ref() == Some(&beside) {
        return Ok(Vec::new());
    }
    state.balanced_beside = Some(beside);
    let state = &*state;
    let (record, policy) = (&state.prepared.record, &state.setup.policy);
    let moving = &state.setup.moving;
    let is_single = record.outputs().len() == 1 && record.inputs().len() == 1;
    let is_free = moving.half_widths && moving.thresholds && !state.setup.order_is_given;
    let left = (1.0 - promised) * state.cost;
    let is_near = left <= policy.judgement.near_noise * state.noise_squares()?;
    let is_in_the_way =
        |inner: &InnerLoop| !inner.law.limits() || inner.drives.states() != MECHANICS;
    let is_pointless = state.setup.is_one_sine || state.point.loops().any(is_in_the_way);
    if !is_single || !is_free || is_near || is_pointless {
        return Ok(Vec::new());
    }
    let Some(straight) = Straight::of(state, &state.point) else { return Ok(Vec::new()) };
    let delay = straight.delay();
    let linear = balance(record, delay, &[], &policy.balance);
    let Some(linear) = linear.and_then(|own| straight.dynamics(&own)) else {
        return Ok(Vec::new());
    };
    let settle = |point: Point, name: &str, progress: Progress| {
        settled(point, &state.prepared.record, &state.setup.options, name, progress)
    };
    let mut found = Vec::new();
    for &entry in state.setup.allowed.iter().filter(|entry| entry.stage == Stage::Dynamics) {
        let is_refused = state.refused.iter().any(|rejected| rejected.effect == entry.name);
        if is_refused || state.out_of_reach.contains(entry.name) {
            continue;
        }
        let proposals = proposals(record, &linear, entry);
        let is_limit = |one: &Proposal<Effect>| one.block.limits();
        if proposals.iter().any(is_limit) {
            // more limits of a model that has some are tried by the score test
            let ends = limits(record, 0, &policy.outside)?;
            if !state.has(entry) && !ends.is_empty() {
                let point = straight.with(state, linear.clone(), None);
                let point = settle(point, entry.name, progress)?;
                found.extend(limited(state, &point, ends, entry, progress)?);
            }
            continue;
        }
        let Some((own, effect)) = best(record, delay, proposals, &policy.balance) else {
            continue;
        };
        let Some((point, effect)) = straight.at_balance(state, &own, effect) else { continue };
        let start = Some(settle(point, entry.name, progress)?);
        let (columns, gain) = (own.forces.len(), own.explained);
        let score = Score { start: effect, zero: None, gain, columns };
        found.push(Ranked { entry, score, worth: gain, start, others: Vec::new() });
    }
    found.sort_by(|a, b| b.score.gain.total_cmp(&a.score.gain));
    Ok(found)
}

/// The fit of a model that began at the balance of forces, or that of the same model whose G passes part of v at once, where it explains
/// significantly more. The output of a mass answers an input that is held between samples one sample later; where the input is not
/// held, part of the answer is there at once. A G that integrates has no gain by which D could be found.
pub(super) fn with_feedthrough(
    state: &SearchState,
    fitted: Fitted,
    options: &FitOptions,
    entry: &Entry,
    progress: Progress,
) -> Result<Fitted, Error> {
    if fitted.linearization.cost >= state.cost || state.integrates()? {
        return Ok(fitted);
    }
    let mut point = fitted.point.clone();
    point.dynamics = point.dynamics.with_free_feedthrough();
    rescale(&mut point);
    let freed = state.fit(point, options, entry.name, progress)?;
    let (values, is_long) = (state.prepared.values(), state.setup.is_long(&freed.point));
    let significance = Significance { values, added: 1, is_long, is_more: false };
    let deviance = values * (fitted.linearization.cost / freed.linearization.cost).ln();
    let is_found = deviance > significance.threshold(&state.setup.policy.judgement);
    Ok(if is_found { freed } else { fitted })
}

/// Remembers the forces whose fits ended so far above the model that other effects beside them change nothing about it.
pub(super) fn remember_out_of_reach(
    state: &mut SearchState,
    trials: &[Trial],
) -> Result<(), Error> {
    if state.integrates()? {
        return Ok(());
    }
    let most = state.setup.policy.balance.out_of_reach * state.cost;
    let is_far_above = |trial: &&Trial| trial.is_far && (trial.cost > most || trial.cost.is_nan());
    state.out_of_reach.extend(trials.iter().filter(is_far_above).map(|trial| trial.entry.name));
    Ok(())
}

/// What the balance of forces says of an effect inside the mechanics.
pub(super) struct Balanced {
    /// The squares of the balance without the effect and with it, of the training data.
    pub squares: [f64; 2],
    /// The same of each held-out block.
    pub held_out: [Vec<f64>; 2],
    /// Whether the held-out error of simulations over stretches of the record becomes larger, that over the whole record where it is too
    /// short for stretches.
    pub is_worse: bool,
}

/// What the balance says of a force inside the mechanics of a stage that integrates. A simulation adds up all forces that no model knows,
/// and its error over a long record says little of one of them, unless the model is near the noise: then a force is judged by its error as any
/// other effect.
pub(super) fn balanced(
    state: &SearchState,
    trial: &Trial,
    progress: Progress,
) -> Result<Option<Balanced>, Error> {
    let point = &trial.point;
    let place = point.effects.iter().rposition(|effect| effect.name() == trial.entry.name);
    let closed = place.and_then(|place| point.effects[place].place().closed_loops());
    let Some(closed) = closed.filter(|_| state.prepared.record.outputs().len() == 1) else {
        return Ok(None);
    };
    if !state.adds_up_forces(&state.point)? {
        return Ok(None);
    }
    let (record, delay) = (&state.prepared.record, point.dynamics.delay);
    let found = balance(record, delay, closed.loops(), &state.setup.policy.balance);
    let Some(own) = found else { return Ok(None) };
    let in_stretches = held_out(state, [&state.point, point], own.time_constant(), progress)?;
    let [before, after] = match in_stretches {
        Some(in_stretches) => in_stretches,
        None => [sum(state.held_out(&state.point)?), sum(trial.held_out.clone())],
    };
    Ok(Some(Balanced {
        squares: squares(&own, record, delay, closed.loops()).map(sum),
        held_out: squares(&own, &state.setup.test, delay, closed.loops()),
        is_worse: after > before,
    }))
}

fn sum(squares: Vec<f64>) -> f64 {
    squares.iter().sum()
}
