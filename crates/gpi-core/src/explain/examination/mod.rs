//! Whether the best trial of a round has earned its name.
//!
//! A trial that is significant, confirmed and substantial ([`super::judgement`]) may still be the work of something
//! else. Before its effect is named it must also pass the following.
//!
//! 1. *Possible*: its values are such as a machine can have ([`Block::is_possible`]). G resonates if the effect acts inside a
//!    mechanical loop, and a hysteretic force opposes the displacement. A hysteretic spring acts beside a linear one. A mode does not
//!    follow a line, creep or a disturbance ([`crate::fit::line_modes`], [`crate::fit::memory`]).
//! 2. *Not a longer fit*: the model without it, fitted again from where the trial ended, does worse by more than chance.
//!
//! More is asked of every effect when the search has ended. Before that, another effect that is not found yet would make
//! nonsense of the answers.
//!
//! 3. *Its own part*: what it adds to the output differs from all that the rest of the model can do ([`own_part`]), or a fit
//!    without it leaves more than the noise. The latter does not count for a slow function of time. A force inside the mechanics of a
//!    stage that integrates its input is not asked: the error of a simulation is there the sum of all small forces. Nor are limits of
//!    states, while the model is far from the noise: what they do is no small change of the rest.
//! 4. *Slow*: a slow function of time is slower than the lags of G that carry a part of the movement, predicts gaps between its
//!    knots as well as it fits ([`gaps`]), is smooth ([`jumps`]), and does not follow how the input moves ([`follows_input`]). Where one follows
//!    the input or jumps, neither another one nor a shape of loops is named that leaves a larger error. Nor is a shape of loops that
//!    leaves a larger error than a slow function of time that failed to predict gaps.
//! 5. *Small, or at the noise*: an effect that is a large part of the output, acts a few times only, or acts like a misfit
//!    of the hysteresis has brought the model near the noise ([`far_from_noise`]). Where it leaves much unexplained, it
//!    follows another structure.
//!
//! A limit inside the dynamics must also explain samples at which the output is within its limits ([`within_limits`]); those at its
//! limits alone may be the sensor's.
//!
//! What does not pass is not tried again, and the search goes on without it.

mod contribution;
mod far_from_noise;
mod follows_input;
mod gaps;
mod jumps;
mod own_part;
mod within_limits;

use super::judgement::{Evidence, judge};
use super::moving::rubs;
use super::outside::saturates;
use super::refusal::Refusal;
use super::state::{SearchState, Trial};
use super::trial::{fitted, join_modes};
use crate::chain::point::Point;
use crate::effects::{Block, Effect, FreeOrder, InnerLoop, Place, Signature};
use crate::fit::line_modes::line_modes;
use crate::fit::memory::Memory;
use crate::fit::minimize::Fitted;
use crate::progress::as_trial;
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
    let goal = (1.0 - state.setup.policy.examination.better) * state.cost;
    let (without, _) = as_trial(progress, ("examination", trial.entry.name), (0, 1), |progress| {
        fitted(state, trial.point.without_effect(place), trial.entry, goal, progress)
    })?;
    let cost = without.linearization.cost;
    let refusal = if let Some(refusal) = impossible(state, &trial.point, place)? {
        Some(refusal)
    } else if !is_mode(state, trial)? {
        Some(Refusal::NotAMode)
    } else if trial.point.effects[place].limits()
        && !within_limits::explains_more(state, trial, place, progress)?
    {
        Some(Refusal::ClipsOnly)
    } else {
        None
    };
    if cost >= goal {
        return Ok(Examination { refusal, without: None });
    }
    let held_out = state.held_out(&without.point)?;
    let alone = Evidence {
        deviance: trial.deviance.min(state.prepared.values() * (cost / trial.cost).ln()),
        squares: [cost, trial.cost],
        held_out: [&held_out, &trial.held_out],
        change: Some(state.held_out_change(&without.point, &trial.point)?),
        ..*evidence
    };
    let again = judge(&alone, &state.setup.policy.judgement).err().map(|_| Refusal::LongerFit);
    Ok(Examination { refusal: refusal.or(again), without: Some(without) })
}

/// Why the effect at a place of the present model is not named when the search has ended, if so.
pub(super) fn doubt(
    state: &SearchState,
    place: usize,
    progress: Progress,
) -> Result<Option<Refusal>, Error> {
    let point = &state.point;
    if let Some(refusal) = impossible(state, point, place)? {
        return Ok(Some(refusal));
    }
    let effect = &point.effects[place];
    let is_force = matches!(effect.place(), Place::Loops(_)) && !effect.limits();
    if is_force && is_saturated(state)? {
        return Ok(Some(Refusal::Saturates));
    }
    let is_slow = point.effects[place].entry().signature == Signature::SlowInTime;
    // asked first, because the answer also concerns other effects
    let policy = &state.setup.policy.examination;
    if is_slow && follows_input::follows_input(&state.prepared.record, point, place, policy) {
        return Ok(Some(Refusal::FollowsInput));
    }
    if is_slow && jumps::is_of_jumps(&state.prepared.record, point, place, policy.jumping)? {
        return Ok(Some(Refusal::Jumps));
    }
    // where the output integrates the input, forces are judged by their balance
    let is_balanced =
        matches!(point.effects[place].place(), Place::Loops(_)) && state.integrates()?;
    let is_large = effect.limits() && !state.is_near(point)?;
    // what a slow function of time does beyond the bounds of a slower creep, for example, says nothing of its cause
    if !is_balanced
        && !is_large
        && !own_part::is_beyond_chance(state, point, place, state.cost)?
        && (is_slow || !is_needed(state, place, progress)?)
    {
        return Ok(Some(Refusal::NotItsOwn));
    }
    if is_slow && gaps::is_as_fast_as_lags(state, point, place)? {
        return Ok(Some(Refusal::AsFastAsLags));
    }
    if is_slow && gaps::are_missed(state, point, place)? {
        return Ok(Some(Refusal::Gaps));
    }
    // the gain of another shape of loops depends on their amplitude, too
    let least = match effect.place() {
        Place::Curves(_) => state.surpassing.follows.min(state.surpassing.misses_gaps),
        _ if is_slow => state.surpassing.follows,
        _ => f64::INFINITY,
    };
    if least.is_finite() && state.rms(point)?[1] >= least {
        return Ok(Some(Refusal::Surpassed));
    }
    far_from_noise::doubt(state, point, place, progress)
}

/// Whether the output stands at a limit while the input moves, and the model errs most there. A loop makes up for the limit.
fn is_saturated(state: &SearchState) -> Result<bool, Error> {
    let record = &state.prepared.record;
    saturates(record, &state.point.residuals(record)?, &state.setup.policy.outside)
}

/// Whether the model reaches the noise with the effect at a place, and a fit without it does not: parameters have bounds, so
/// that the rest of the model may be unable to do what a linear test says it can.
fn is_needed(state: &SearchState, place: usize, progress: Progress) -> Result<bool, Error> {
    let most = state.setup.policy.judgement.near_noise * state.noise_squares()?;
    if state.cost > most {
        return Ok(false);
    }
    let without = state.point.without_effect(place);
    let fitted = state.fit(without, &state.setup.options, "without it", progress)?;
    let least = 1.0 + state.setup.policy.judgement.least;
    Ok(fitted.linearization.cost > least * state.cost)
}

/// Whether the input drives a mode that is to be a part of G, and all others that the trial has moved.
fn is_mode(state: &SearchState, trial: &Trial) -> Result<bool, Error> {
    if trial.entry.free_order != FreeOrder::JoinsG || state.setup.order_is_given {
        return Ok(true);
    }
    let mut joined = trial.point.clone();
    join_modes(&mut joined);
    if joined.effects.iter().any(|effect| effect.entry().free_order == FreeOrder::JoinsG) {
        // no continuous motion has its poles
        return Ok(false);
    }
    let record = &state.prepared.record;
    let memory = Memory::of(record);
    let slow = |point: &Point| memory.exceeded_by(point, &state.prepared);
    Ok(slow(&joined)?.len() <= slow(&state.point)?.len() && line_modes(&joined, record)?.is_empty())
}

/// Why no machine can have the effect at a place, if so.
pub(super) fn impossible(
    state: &SearchState,
    point: &Point,
    place: usize,
) -> Result<Option<Refusal>, Error> {
    let effect = &point.effects[place];
    if let Place::Loops(closed) = effect.place() {
        let most = state.setup.policy.examination.excess;
        let mut limits = closed.loops().iter();
        if effect.limits() && !limits.any(|inner| within_limits::is_stiff(point, inner, most)) {
            return Ok(Some(Refusal::Impossible));
        }
        // a mass without a spring shows what acts on it by integrating
        let dissipates = closed.loops().iter().any(|inner| inner.law.is_dissipative());
        let shows = point.dynamics.has_resonance()
            || (dissipates && state.integrates()?)
            || is_shown_by_motion(state, point, closed.loops())
            // a tank with a limit has a nonlinear outflow, and no resonance
            || (!dissipates && point.effects.iter().any(Effect::limits));
        if !effect.limits() && !shows {
            return Ok(Some(Refusal::NoResonance));
        }
        let most = state.setup.policy.examination.hysteretic;
        let is_impossible =
            |inner: &InnerLoop| adds_energy(point, inner) || lacks_spring(point, inner, most);
        if closed.loops().iter().any(is_impossible) {
            return Ok(Some(Refusal::Impossible));
        }
    }
    Ok((!effect.block().is_none_or(Block::is_possible)).then_some(Refusal::Impossible))
}

/// Whether loops are dry friction, which the balance of forces of the samples that move shows.
fn is_shown_by_motion(state: &SearchState, point: &Point, loops: &[InnerLoop]) -> bool {
    let is_dry = loops.iter().any(|inner| inner.law.is_dissipative());
    let stops = point.effects.iter().any(Effect::limits);
    is_dry && rubs(state, point.dynamics.delay, loops, stops)
}

/// Whether a loop is a force with beta > 0 that follows the displacement instead of opposing it: each cycle would add energy.
fn adds_energy(point: &Point, inner: &InnerLoop) -> bool {
    let force = point.steady_force(inner);
    inner.law.is_dissipative() && force.is_some_and(|force| force.over_stiffness <= 0.0)
}

/// Where the newest effect of a name stands.
fn newest(point: &Point, name: &str) -> Option<usize> {
    point.effects.iter().rposition(|effect: &Effect| effect.name() == name)
}

/// Whether the stiffness of a hysteretic spring is more than `most` times the linear one: a force on a mass without a spring is friction.
fn lacks_spring(point: &Point, inner: &InnerLoop, most: f64) -> bool {
    let force = point.steady_force(inner);
    inner.law.is_hysteretic_spring() && force.is_some_and(|force| force.over_stiffness > most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::plain::plain;
    use crate::effects::{Drives, Law, Sees, Stiffness};

    /// A resonance of compliance 2, and a force of so much for each unit of the law that acts against the input.
    fn point(law: Law, force: f64) -> Point {
        let drives = Drives::Input { input: 0, force, states: 2 };
        let loops = vec![InnerLoop { sees: Sees::Output(0), law, drives }];
        plain(&[0.3, 0.1], &[1.0, -1.6, 0.8], vec![Stiffness { loops }.into()])
    }

    #[test]
    fn a_hysteretic_spring_acts_beside_a_linear_one() {
        let bouc_wen = Law::BoucWen { beta: 1.0, gamma: 0.5, exponent: 1.0 };
        let dahl = Law::Dahl { distance: 0.1, averaged: false };
        let lacks = |law: &Law, force: f64, most: f64| {
            let point = point(law.clone(), force);
            point.loops().all(|inner| lacks_spring(&point, inner, most))
        };
        // the stiffness is 2 x the force, over the linear one
        assert!(lacks(&bouc_wen, 600.0, 1e3) && !lacks(&bouc_wen, 400.0, 1e3));
        // friction has no stiffness of its own
        assert!(!lacks(&dahl, 600.0, 1e3));
    }

    #[test]
    fn a_hysteretic_force_opposes_the_displacement() {
        let adds = |law: Law, force: f64| {
            let point = point(law, force);
            point.loops().all(|inner| adds_energy(&point, inner))
        };
        let dahl = || Law::Dahl { distance: 0.1, averaged: false };
        assert!(adds(dahl(), -0.1) && !adds(dahl(), 0.1));
        // a spring may soften
        assert!(!adds(Law::Power { exponent: 3, scale: 1.0 }, -0.1));
    }
}
