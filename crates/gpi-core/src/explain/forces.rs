//! Forces inside the mechanics that the balance of forces finds, and the models that fits of them begin at.
//!
//! The score test linearises around the model so far. Where plays and deadzones before the dynamics stand for a force inside them,
//! no small step leads from there to the force; where the output integrates the input, the error of a simulation says little
//! about its cause. The balance ([`super::force_balance`]) needs neither: mass, damping, stiffness and forces follow from it at once, and a fit
//! begins there, without plays and deadzones.

use super::force_balance::{balance, squares};
use super::ranking::Ranked;
use super::score::Score;
use super::state::{SearchState, Trial};
use crate::chain::point::{DynamicsFreedom, Point};
use crate::effects::{ClosedLoops, Drives, Effect, Entry, PlaceMut, Proposal, Situation, Stage};
use crate::fit::preparation::rescale;
use crate::linear::Sections;
use crate::progress::Progress;
use crate::{Error, Experiment, Matrix};

/// The best force of each effect that acts inside the mechanics, with the model to begin at. None where the model has such a force, or the
/// part of the squares that another effect promises brings it near the noise. The balance depends on the record alone, so that it is
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
    if !is_single || !is_free || is_near || state.point.loops().next().is_some() {
        return Ok(Vec::new());
    }
    let straight = state.point.without_hysteresis(record);
    let mut found = Vec::new();
    for &entry in state.setup.allowed.iter().filter(|entry| entry.stage == Stage::Dynamics) {
        let is_refused = state.refused.iter().any(|rejected| rejected.effect == entry.name);
        if !is_refused {
            found.extend(best(state, &straight, entry, progress)?);
        }
    }
    found.sort_by(|a, b| b.score.gain.total_cmp(&a.score.gain));
    Ok(found)
}

/// The squares of the balance of forces without an effect and with it: of the training data, and of each held-out block.
pub(super) struct Balanced {
    pub squares: [f64; 2],
    pub held_out: [Vec<f64>; 2],
}

/// What the balance says of a force inside the mechanics of a stage that integrates. A simulation adds up all forces that no model knows,
/// and its error says little of one of them.
pub(super) fn balanced(state: &SearchState, trial: &Trial) -> Result<Option<Balanced>, Error> {
    let point = &trial.point;
    let place = point.effects.iter().rposition(|effect| effect.name() == trial.entry.name);
    let closed = place.and_then(|place| point.effects[place].place().closed_loops());
    let Some(closed) = closed.filter(|_| state.prepared.record.outputs().len() == 1) else {
        return Ok(None);
    };
    if !state.integrates()? {
        return Ok(None);
    }
    let (record, delay) = (&state.prepared.record, point.dynamics.delay);
    let found = balance(record, delay, closed.loops(), &state.setup.policy.balance);
    Ok(found.map(|own| Balanced {
        squares: squares(&own, record, delay, closed.loops()).map(|all| all.iter().sum()),
        held_out: squares(&own, &state.setup.test, delay, closed.loops()),
    }))
}

/// The block of an effect whose forces explain most, if that is enough.
fn best(
    state: &SearchState,
    straight: &Point,
    entry: &'static Entry,
    progress: Progress,
) -> Result<Option<Ranked>, Error> {
    let (record, policy) = (&state.prepared.record, &state.setup.policy.balance);
    let delay = straight.dynamics.delay;
    let at = (policy.slowest / record.scored() as f64).exp();
    let gain = straight.channels[0].slope();
    let linear = balance(record, delay, &[], policy).filter(|_| gain != 0.0);
    let Some(dynamics) = linear.and_then(|own| own.dynamics(gain, delay, at).ok()) else {
        return Ok(None);
    };
    let mut best: Option<(f64, Proposal<Effect>)> = None;
    for proposal in proposals(state, &dynamics, entry) {
        let Some(closed) = proposal.block.place().closed_loops() else { continue };
        let Some(own) = balance(record, delay, closed.loops(), policy) else { continue };
        if best.as_ref().is_none_or(|(most, _)| own.explained > *most) {
            best = Some((own.explained, proposal));
        }
    }
    let Some((explained, proposal)) = best.filter(|(own, _)| *own >= policy.least) else {
        return Ok(None);
    };
    let mut effect = proposal.block;
    let loops = effect.place().closed_loops().map_or(&[][..], ClosedLoops::loops);
    let Some(own) = balance(record, delay, loops, policy) else { return Ok(None) };
    let Ok(dynamics) = own.dynamics(gain, delay, at) else { return Ok(None) };
    let input: Vec<f64> = dynamics.driven_by(0).collect();
    if let PlaceMut::Loops(closed) = effect.place_mut() {
        for (inner, found) in closed.loops_mut().iter_mut().zip(&own.forces) {
            // in the unit of v
            let own = gain * found;
            match &mut inner.drives {
                Drives::States(column) => *column = input.iter().map(|b| -own * b).collect(),
                Drives::Input { force, .. } => *force = own,
            }
        }
    }
    let mut point = state.prepared.point(dynamics);
    point.channels.clone_from(&straight.channels);
    state.prepared.settle(&mut point);
    point = state.point.effects.iter().fold(point, |point, other| point.with_effect(other.clone()));
    point = point.with_effect(effect.clone());
    rescale(&mut point);
    let mut options = state.setup.options.clone();
    options.freedom.weights = false;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Nothing;
    let fitted = state.fit(point, &options, entry.name, progress)?;
    let point = fitted.point;
    let columns = own.forces.len();
    let score = Score { start: effect, zero: None, gain: explained, columns };
    Ok(Some(Ranked { entry, score, worth: explained, start: Some(point) }))
}

/// The proposals of an effect for a mass of these dynamics that moves as measured.
fn proposals(state: &SearchState, dynamics: &Sections, entry: &Entry) -> Vec<Proposal<Effect>> {
    let record = &state.prepared.record;
    let of = |signal: fn(&Experiment) -> &Matrix| -> Vec<Matrix> {
        let scored = |experiment: &Experiment| {
            let rows: Vec<usize> = experiment.scored_runs().flatten().collect();
            signal(experiment).select_rows(&rows)
        };
        record.experiments().iter().map(scored).collect()
    };
    let (inputs, outputs) = (of(|own| &own.input), of(|own| &own.output));
    (entry.proposals)(&Situation {
        record,
        drives: &inputs,
        intermediates: &inputs,
        displacements: &outputs,
        residuals: &outputs,
        dynamics,
        loops: Vec::new(),
        widest: vec![0.0],
        places: vec![Situation::range(&inputs, 0)],
    })
}
