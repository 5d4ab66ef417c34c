//! A mass that slides with dry friction, perhaps between end stops.
//!
//! Where nothing resonates, plays before the dynamics stand for friction inside them, and no small step leads from there to the friction. A
//! model without end stops runs through them, and one without friction does not rest between them, so that neither of them alone
//! need bring a model near such a record.
//!
//! The balance of forces shows both without a simulation. Over the samples that move, dry friction explains most of its squares; where
//! the output stands still although more than friction pushes it, it is at a stop ([`super::moving`]). A fit begins at the mass,
//! the friction and the stops, without plays and deadzones. A stop takes away by how much the mass exceeds it, and a part beta of the
//! speed with which it came. With the excess w of the displacement, the free response to `E w` is -w at once and `-(1 + beta) w` one
//! sample later:
//!
//! ```text
//! C E = -1,      C A E = -(1 + beta)
//! ```
//!
//! What is added is taken if the held-out blocks confirm all of it together and each part beside the other, and if the model with it leaves a
//! small part of the squares of the model without it, of the training data and of what is held out. At the end of the search, each effect is
//! examined as any other.

use super::balance_start::{Straight, best, proposals};
use super::examination::impossible;
use super::force_balance::{Balance, balance};
use super::judgement::is_confirmed;
use super::limits::with_loops;
use super::moving::Motion;
use super::ranking::Ranked;
use super::round::add;
use super::score::Score;
use super::state::{Addition, SearchState, Trial};
use super::trial::trial;
use crate::chain::point::Point;
use crate::effects::{Drives, Effect, Entry, InnerLoop, Law, Sees, Stage};
use crate::fit::initial_state::settled;
use crate::fit::minimize::{FitOptions, Fitted};
use crate::linear::Sections;
use crate::{Error, Progress};
use nalgebra::{Matrix2, Vector2};

/// What the balance of forces says of a mass that slides.
struct Machine {
    /// The balance of the moving samples with its friction.
    balance: Balance,
    entry: &'static Entry,
    friction: Effect,
    /// The entry of limits and the end stops, each with whether it is the lower one, where there are any.
    stops: Option<(&'static Entry, Vec<(f64, bool)>)>,
}

/// Adds friction, and end stops where there are any, if the balance of forces shows them; says whether the model became another.
pub(super) fn add_sliding_mass(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let beside: Vec<&'static str> = state.point.effects.iter().map(Effect::name).collect();
    if state.slid_beside.as_ref() == Some(&beside) {
        return Ok(false);
    }
    state.slid_beside = Some(beside);
    let Some(next) = sliding(state, progress)? else { return Ok(false) };
    *state = next;
    Ok(true)
}

/// The state with what the balance of forces shows, if that is taken: without effects that the input drives, which may have stood for
/// the mass and are found again if they did not, or else beside them.
fn sliding<'a>(
    state: &SearchState<'a>,
    progress: Progress,
) -> Result<Option<SearchState<'a>>, Error> {
    let Some(straight) = Straight::of(state, &state.point) else { return Ok(None) };
    let Some(machine) = machine(state, &straight)? else { return Ok(None) };
    let mut bare = state.under(state.setup)?;
    let mut dropped = Vec::new();
    while let Some(place) = bare.point.effects.iter().position(may_stand_for_mass) {
        dropped.push(bare.point.effects[place].name());
        bare.point = bare.point.without_effect(place);
    }
    if !dropped.is_empty() {
        bare.cost = bare.training_squares(&bare.point)?;
        if let Some(mut next) = with_machine(state, &bare, &machine, progress)? {
            if let Some(addition) = next.additions.last_mut() {
                addition.dropped.extend(dropped);
            }
            return Ok(Some(next));
        }
    }
    with_machine(state, state, &machine, progress)
}

/// Whether an effect may be what the hysteresis before the dynamics does not explain of a mass: the input drives it, and no column of the
/// record does.
fn may_stand_for_mass(effect: &Effect) -> bool {
    effect.entry().driven && effect.entry().stage != Stage::Added
}

/// A state with a machine in the place of its hysteresis, if that is taken instead of the present state.
fn with_machine<'a>(
    present: &SearchState<'a>,
    state: &SearchState<'a>,
    Machine { balance, entry, friction, stops }: &Machine,
    progress: Progress,
) -> Result<Option<SearchState<'a>>, Error> {
    let policy = &state.setup.policy;
    let begun = Straight::of(state, &state.point)
        .and_then(|straight| straight.at_balance(state, balance, friction.clone()));
    let Some((point, _)) = begun else { return Ok(None) };
    let options = &state.setup.options;
    let point = settled(point, &state.prepared.record, options, entry.name, progress)?;
    let alone = of_start(state, entry, point.clone(), progress)?;
    if let Some((limit, ends)) = stops {
        let mut next = state.under(state.setup)?;
        next.add(Addition::alone(alone.clone()))?;
        if let Some(stopped) = stopped(&next, &point, ends, limit, progress)? {
            let both = of_start(&next, limit, stopped, progress)?;
            add(&mut next, Addition::alone(both), progress)?;
            if is_taken(present, &next, &[entry, limit], progress)? {
                return Ok(Some(next));
            }
        }
    }
    if balance.explained < policy.sliding.alone {
        return Ok(None);
    }
    let mut next = state.under(state.setup)?;
    add(&mut next, Addition::alone(alone), progress)?;
    Ok(is_taken(present, &next, &[entry], progress)?.then_some(next))
}

/// The machine that the balance of forces shows. None where the model is near the noise, has forces inside the mechanics already, or is
/// held by the user, and where the output integrates the input: forces are then judged by the balance alone, and the overlap of a
/// valve does to it what friction does.
fn machine(state: &SearchState, straight: &Straight) -> Result<Option<Machine>, Error> {
    let (record, policy) = (&state.prepared.record, &state.setup.policy);
    let moving = &state.setup.moving;
    let is_single = record.outputs().len() == 1 && record.inputs().len() == 1;
    let is_free = moving.half_widths && moving.thresholds && !state.setup.order_is_given;
    let is_pointless = state.setup.is_one_sine || state.point.loops().next().is_some();
    if !is_single
        || !is_free
        || is_pointless
        || state.is_near(&state.point)?
        || state.integrates()?
    {
        return Ok(None);
    }
    let delay = straight.delay();
    let shown = || {
        let motion = Motion::of(record, &policy.sliding)?;
        let moving = motion.moving(record)?;
        let linear = balance(&moving, delay, &[], &policy.balance)?;
        let linear = straight.dynamics(&linear)?;
        let is_refused =
            |entry: &Entry| state.refused.iter().any(|rejected| rejected.effect == entry.name);
        let is_asked = |entry: &&Entry| entry.stage == Stage::Dynamics && !is_refused(entry);
        let mut limit = None;
        let mut found: Option<(Balance, &'static Entry, Effect)> = None;
        for entry in state.setup.allowed.iter().copied().filter(is_asked) {
            let mut proposed = proposals(&moving, &linear, entry);
            if proposed.iter().any(|one| one.block.limits()) {
                limit = Some(entry);
                continue;
            }
            proposed.retain(|one| is_dry(&one.block));
            let Some((own, effect)) = best(&moving, delay, proposed, &policy.balance) else {
                continue;
            };
            if found.as_ref().is_none_or(|(known, ..)| known.explained < own.explained) {
                found = Some((own, entry, effect));
            }
        }
        let (balance, entry, friction) = found?;
        let loops = friction.place().closed_loops()?.loops();
        let ends = motion.ends(record, delay, (&balance, loops), &policy.sliding);
        let is_shown = balance.explained >= policy.sliding.explained;
        let stops = limit.filter(|_| is_shown && !ends.is_empty()).map(|entry| (entry, ends));
        let is_friction = stops.is_some() || balance.explained >= policy.sliding.alone;
        is_friction.then_some(Machine { balance, entry, friction, stops })
    };
    Ok(shown())
}

/// Whether the forces of an effect oppose a motion whatever its speed, and nothing else.
fn is_dry(effect: &Effect) -> bool {
    let Some(closed) = effect.place().closed_loops() else { return false };
    let mut laws = closed.loops().iter().map(|inner| &inner.law);
    laws.any(Law::is_dissipative)
        && !closed.loops().iter().any(|inner| inner.law.is_hysteretic_spring())
}

/// The best fit of a mass that stops at the ends, of those that begin with different losses of speed.
fn stopped(
    state: &SearchState,
    point: &Point,
    ends: &[(f64, bool)],
    entry: &'static Entry,
    progress: Progress,
) -> Result<Option<Point>, Error> {
    let policy = &state.setup.policy;
    let options = FitOptions { steps: policy.fits.far_steps, ..state.setup.options.clone() };
    let offset = point.offsets[0][(0, 0)];
    let mut best: Option<Fitted> = None;
    for lost in policy.sliding.lost {
        let Some(column) = column(&point.dynamics, lost) else { continue };
        let inner = |&(place, is_lower): &(f64, bool)| InnerLoop {
            sees: Sees::Output(0),
            law: Law::Excess { limit: place - offset, is_lower },
            drives: Drives::States(column.clone()),
        };
        let loops = ends.iter().map(inner).collect();
        let Some(effect) = with_loops(state, point, entry, loops)? else { continue };
        let fitted = state.fit(point.with_effect(effect), &options, entry.name, progress)?;
        let is_better = |known: &Fitted| fitted.linearization.cost < known.linearization.cost;
        if best.as_ref().is_none_or(is_better) {
            best = Some(fitted);
        }
    }
    Ok(best.map(|fitted| fitted.point))
}

/// E of a stop that takes the excess away, and a part of the speed.
fn column(dynamics: &Sections, lost: f64) -> Option<Vec<f64>> {
    let now: Vec<f64> = dynamics.c().row(0).iter().copied().collect();
    let sections = dynamics.sections.iter();
    let then: Vec<f64> = sections
        .flat_map(|own| (own.c.rows(0, 1) * own.matrix()).iter().copied().collect::<Vec<f64>>())
        .collect();
    let (&[a, b], &[c, d]) = (now.as_slice(), then.as_slice()) else { return None };
    let column = Matrix2::new(a, b, c, d).lu().solve(&-Vector2::new(1.0, 1.0 + lost))?;
    Some(column.as_slice().to_vec())
}

/// The trial of an effect whose fit begins at a point.
fn of_start(
    state: &SearchState,
    entry: &'static Entry,
    point: Point,
    progress: Progress,
) -> Result<Trial, Error> {
    let own = point.effects.iter().rfind(|effect| effect.name() == entry.name);
    let start = own.unwrap_or(&point.effects[0]).clone();
    let gain = 1.0 - state.training_squares(&point)? / state.cost;
    let score = Score { columns: start.values().len(), start, zero: None, gain };
    let ranked = Ranked { entry, score, worth: gain, start: Some(point), others: Vec::new() };
    trial(state, ranked, progress)
}

/// Whether these effects of the next model are taken.
fn is_taken(
    state: &SearchState,
    next: &SearchState,
    entries: &[&Entry],
    progress: Progress,
) -> Result<bool, Error> {
    let policy = &state.setup.policy;
    let (before, both) = (state.held_out(&state.point)?, next.held_out(&next.point)?);
    let sum = |blocks: &[f64]| blocks.iter().sum::<f64>();
    let most = policy.sliding.left;
    let is_small = next.cost <= most * state.cost && sum(&both) <= most * sum(&before);
    if !is_small || !is_confirmed([&before, &both], &policy.judgement) {
        return Ok(false);
    }
    for entry in entries {
        let place = next.point.effects.iter().rposition(|effect| effect.name() == entry.name);
        let Some(place) = place else { return Ok(false) };
        let (without, _) = next.best_without(place, progress)?;
        let is_confirmed = is_confirmed([&next.held_out(&without)?, &both], &policy.judgement);
        if !is_confirmed || impossible(next, &next.point, place)?.is_some() {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::chain::plain::plain;

    #[test]
    fn a_stop_takes_the_excess_and_a_part_of_the_speed() {
        // poles at 1 and 0.5
        let dynamics = plain(&[0.0, 0.1], &[1.0, -1.5, 0.5], Vec::new()).dynamics;
        let c: Vec<f64> = dynamics.c().iter().copied().collect();
        for lost in [0.0, 0.5] {
            let own = column(&dynamics, lost).unwrap();
            let at_once: f64 = c.iter().zip(&own).map(|(c, e)| c * e).sum();
            assert!((at_once + 1.0).abs() < 1e-12);
            // the state one sample later
            let system = dynamics.to_state_space().unwrap();
            let then = system.c() * system.a() * Matrix::from_column_slice(2, 1, &own);
            assert!((then[(0, 0)] + 1.0 + lost).abs() < 1e-12);
        }
        let first = plain(&[0.0, 0.1], &[1.0, -0.5], Vec::new()).dynamics;
        assert_eq!(column(&first, 0.0), None);
    }
}
