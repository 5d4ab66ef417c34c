//! Models whose states have limits, where the output stands at one while the input moves.
//!
//! A state that stays at its limit forgets what drives it. Linear dynamics that are fitted to such a record are those of no state, so that
//! plays, deadzones and more poles stand for the limits, and no small step leads from there to a limit. As for a force inside the
//! mechanics ([`super::forces`]), fits therefore begin at linear dynamics of second order without plays and deadzones:
//!
//! 1. with the limits of the output where it stands still,
//! 2. with one limit more, of the state of each real pole and on either side; the best of these is kept.
//!
//! Each loop begins with a column of E that takes the excess away from what it sees: `E = -S / |S|^2` for `z = S x`.

use super::base::Base;
use super::ranking::Ranked;
use super::score::Score;
use super::state::SearchState;
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{Drives, Effect, Entry, InnerLoop, Law, PlaceMut, Sees};
use crate::fit::minimize::Fitted;
use crate::progress::Progress;

/// The best model with limits of an entry's kind, from linear dynamics without plays and deadzones, whose offset and initial state are
/// fitted. `ends` are the limits at which the output stands, each with whether it is a lower one.
pub(super) fn limited(
    state: &SearchState,
    linear: &Point,
    ends: Vec<(f64, bool)>,
    entry: &'static Entry,
    progress: Progress,
) -> Result<Option<Ranked>, Error> {
    let policy = &state.setup.policy.limits;
    let offset = linear.offsets[0][(0, 0)];
    let of_output = |(value, is_lower): (f64, bool)| InnerLoop {
        sees: Sees::Output(0),
        law: Law::Excess { limit: value - offset, is_lower },
        drives: Drives::States(vec![0.0; linear.dynamics.order()]),
    };
    let loops = ends.into_iter().map(of_output).collect();
    let Some(effect) = with_loops(state, linear, entry, loops)? else { return Ok(None) };
    let mut best = fit(state, linear.with_effect(effect), entry, progress)?;
    let place = best.point.effects.len() - 1;
    let known = loops_of(&best.point.effects[place]);
    let rest = best.point.without_effect(place);
    let mut found = Vec::new();
    for inner in inside(state, &best.point, entry)? {
        let loops = known.iter().cloned().chain([inner]).collect();
        let Some(effect) = with_loops(state, &best.point, entry, loops)? else { continue };
        found.push(fit(state, rest.with_effect(effect), entry, progress)?);
    }
    let cost = |one: &Fitted| one.linearization.cost;
    found.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    for mut fitted in found.into_iter().take(policy.retied) {
        for _ in 0..policy.ties {
            let Some(tied) = tied(state, &fitted.point, place, entry)? else { break };
            let again = fit(state, tied, entry, progress)?;
            let is_better = cost(&again) < (1.0 - policy.worth) * cost(&fitted);
            if cost(&again) < cost(&fitted) {
                fitted = again;
            }
            if !is_better {
                break;
            }
        }
        if cost(&fitted) < cost(&best) {
            best = fitted;
        }
    }
    let gain = 1.0 - best.linearization.cost / state.cost;
    let start = best.point.effects[place].clone();
    let columns = start.values().len();
    let score = Score { start, zero: None, gain, columns };
    let start = Some(best.point);
    Ok(Some(Ranked { entry, score, worth: gain, start, others: Vec::new() }))
}

/// An effect of an entry's kind with these loops, each of which keeps what it sees at the limit.
pub(super) fn with_loops(
    state: &SearchState,
    point: &Point,
    entry: &Entry,
    mut loops: Vec<InnerLoop>,
) -> Result<Option<Effect>, Error> {
    let seen_by_output: Vec<f64> = point.dynamics.c().row(0).iter().copied().collect();
    for inner in &mut loops {
        let Drives::States(column) = &mut inner.drives else { continue };
        if column.iter().any(|drive| *drive != 0.0) {
            continue;
        }
        let seen =
            if let Sees::Mixture { states, .. } = &inner.sees { states } else { &seen_by_output };
        let squares: f64 = seen.iter().map(|own| own * own).sum();
        column.iter_mut().zip(seen).for_each(|(drive, own)| *drive = -own / squares);
    }
    let proposals = proposed(state, point, entry)?;
    let Some(mut effect) = proposals.into_iter().next() else { return Ok(None) };
    let PlaceMut::Loops(closed) = effect.place_mut() else { return Ok(None) };
    *closed.loops_mut() = loops;
    Ok(Some(effect))
}

/// What an entry proposes for a point.
fn proposed(state: &SearchState, point: &Point, entry: &Entry) -> Result<Vec<Effect>, Error> {
    let options = &state.setup.options;
    let base = Base::new(point, &state.prepared.record, options.freedom, &options.loss)?;
    Ok(base.situation(entry.proposals).into_iter().map(|one| one.block).collect())
}

/// The loops of what an entry proposes that see a state inside the dynamics.
fn inside(state: &SearchState, point: &Point, entry: &Entry) -> Result<Vec<InnerLoop>, Error> {
    let all = proposed(state, point, entry)?;
    let is_inside = |inner: &InnerLoop| matches!(inner.sees, Sees::Mixture { .. });
    Ok(all.iter().flat_map(loops_of).filter(is_inside).collect())
}

fn loops_of(effect: &Effect) -> Vec<InnerLoop> {
    effect.place().closed_loops().map_or_else(Vec::new, |closed| closed.loops().to_vec())
}

fn fit(
    state: &SearchState,
    point: Point,
    entry: &Entry,
    progress: Progress,
) -> Result<Fitted, Error> {
    state.fit(point, &state.setup.options, entry.name, progress)
}

/// The point with limits of what its own poles hold.
fn tied(
    state: &SearchState,
    point: &Point,
    place: usize,
    entry: &Entry,
) -> Result<Option<Point>, Error> {
    let candidates = inside(state, point, entry)?;
    let mut point = point.clone();
    let PlaceMut::Loops(closed) = point.effects[place].place_mut() else { return Ok(None) };
    for inner in closed.loops_mut() {
        let Sees::Mixture { states, .. } = &inner.sees else { continue };
        let likeness = |other: &InnerLoop| {
            let Sees::Mixture { states: own, .. } = &other.sees else { return 0.0 };
            let product: f64 = own.iter().zip(states).map(|(a, b)| a * b).sum();
            let size = |all: &[f64]| all.iter().map(|a| a * a).sum::<f64>();
            product / (size(own) * size(states)).sqrt()
        };
        let Some(best) = candidates.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
        else {
            return Ok(None);
        };
        inner.sees = best.sees.clone();
    }
    Ok(Some(point))
}
