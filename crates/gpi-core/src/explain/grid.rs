//! Finer grids: half-widths and thresholds that the residual asks for.
//!
//! What the declared model itself can explain is no effect. Each play or deadzone that is tried has one column, the
//! change of the output by its weight. The columns are projected off the model's sensitivities ([`Projection`]) and
//! taken one after the other (orthogonal matching pursuit): the one that takes most of the squares, `s_i^2 / L_ii`,
//! comes first, and is then projected off the others, `L -= L_i L_i' / L_ii` and `s -= s_i L_i / L_ii`.
//!
//! Half-widths move downhill from where they stand, and no play becomes two. Where the model has effects and stays above the noise, plays
//! are therefore also chosen anew on a dense grid ([`crate::fit::dense`]), which the declared model is not given, nor one with a force inside
//! the mechanics: so many plays can take the place of an effect that is not known yet.
//!
//! A strong candidate is fitted on the grids as they are, because finer ones would bend to what it explains. Before it is taken, finer
//! grids are tried without it. It is superfluous where they lose less than its threshold.

use super::base::Base;
use super::judgement::is_superfluous;
use super::policy::GridPolicy;
use super::policy::score::LEFT;
use super::projection::Projection;
use super::setup::SearchSetup;
use super::state::{SearchState, Trial};
use crate::chain::bounds::range;
use crate::chain::free_run::Signals;
use crate::chain::point::Point;
use crate::effects::Stage;
use crate::fit::dense::dense;
use crate::fit::minimize::FitOptions;
use crate::parallel::install;
use crate::progress::{Progress, report};
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;
use rayon::prelude::*;

/// A play or a deadzone that an input's hysteresis may get.
#[derive(Clone, Copy)]
enum Place {
    Play { input: usize, half_width: f64 },
    Deadzone { input: usize, threshold: f64 },
}

impl Place {
    fn added_to(self, point: &Point, weight: f64) -> Point {
        match self {
            Self::Play { input, half_width } => point.with_play(input, half_width, weight),
            Self::Deadzone { input, threshold } => point.with_deadzone(input, threshold, weight),
        }
    }
}

/// Moves half-widths and thresholds, and takes finer grids as long as they pay. Says whether the model became better.
pub(super) fn refine_grids(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    state.is_rich = true;
    let is_held = !state.setup.moving.half_widths && !state.setup.moving.thresholds;
    // a simulation adds up all forces that the model does not know, and plays would follow their sum
    let adds_up = state.point.loops().next().is_some() && state.adds_up_forces(&state.point)?;
    if is_held || adds_up {
        return Ok(false);
    }
    let is_finer = add_places(state, progress)?;
    let is_other = choose_anew(state, progress)?;
    // other plays leave another residual, which may ask for deadzones
    let is_finer_again = is_other && add_places(state, progress)?;
    Ok(is_finer || is_other || is_finer_again)
}

/// Adds plays and deadzones that the residual asks for as long as they pay, and moves all; says whether the model became better.
fn add_places(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let policy = &state.setup.policy.grid;
    let values = state.prepared.values();
    let mut gained = false;
    for round in 0..policy.rounds {
        report(progress, "finer grid", round as f64 / policy.rounds as f64)?;
        let (point, added) = enriched(state)?;
        if added == 0 && round > 0 {
            break;
        }
        let (point, cost) = on_moving_grids(state, point, progress)?;
        let deviance = values * (state.cost / cost.max(f64::MIN_POSITIVE)).ln();
        // two numbers of a play, priced as in the BIC
        if deviance < 2.0 * added as f64 * values.ln() {
            break;
        }
        (state.point, state.cost) = (point, cost);
        gained = true;
        if deviance < policy.small * values {
            break;
        }
    }
    Ok(gained)
}

/// Chooses the plays anew on a dense grid, where the model has effects and stays above the noise; says whether it became better.
fn choose_anew(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let policy = &state.setup.policy.grid;
    let is_at_noise = state.cost <= policy.at_noise * state.noise_squares()?;
    let is_declared = state.point.effects.is_empty();
    let is_held = !state.setup.moving.half_widths || state.setup.is_long(&state.point);
    // so many plays take the place of a force inside the mechanics
    let has_loops = state.point.loops().next().is_some();
    if is_at_noise || is_declared || is_held || has_loops {
        return Ok(false);
    }
    // a record too short for so many plays keeps those that it has
    let chosen = dense(&state.point, &state.prepared, progress);
    let Ok(chosen) = Error::unless_interrupted(chosen)? else { return Ok(false) };
    let (point, cost) = on_moving_grids(state, chosen, progress)?;
    let is_better = cost < (1.0 - policy.small) * state.cost;
    // an effect that becomes impossible only makes up for errors of these plays
    let is_plausible = state.is_plausible(&point) || !state.is_plausible(&state.point);
    if is_better && is_plausible {
        (state.point, state.cost) = (point, cost);
    }
    Ok(is_better)
}

/// Takes finer grids where they explain as much as a trial: the effect is then superfluous beside them. Says whether they do.
pub(super) fn finer_grids_instead(
    state: &mut SearchState,
    trial: &Trial,
    progress: Progress,
) -> Result<bool, Error> {
    let before = (state.point.clone(), state.cost);
    let is_finer = refine_grids(state, progress)?;
    let lost = state.prepared.values() * (state.cost / trial.cost).ln();
    let held_out = state.held_out(&state.point)?;
    let factor = state.setup.policy.revision.superfluous;
    if is_finer && is_superfluous(lost, trial.threshold, [&trial.held_out, &held_out], factor) {
        return Ok(true);
    }
    (state.point, state.cost) = before;
    state.is_rich = false;
    Ok(false)
}

/// A point fitted with grids that move, plays and deadzones without use left out; and its squares.
fn on_moving_grids(
    state: &SearchState,
    point: Point,
    progress: Progress,
) -> Result<(Point, f64), Error> {
    let policy = &state.setup.policy.grid;
    let still =
        FitOptions { steps: policy.held_steps, gain: policy.gain, ..state.setup.options.clone() };
    let point = state.fit(point, &still, "refinement", progress)?.point;
    let mut options = FitOptions { steps: policy.moving_steps, ..state.setup.moving_grids.clone() };
    let mut fitted = state.fit(point, &options, "refinement", progress)?;
    if fitted.point.drop_unused() {
        options.steps = policy.moving_steps / 3;
        fitted = state.fit(fitted.point, &options, "refinement", progress)?;
    }
    Ok((fitted.point, fitted.linearization.cost))
}

/// The point with those plays and deadzones more, without weight yet, that would take most of the residual; how many
/// they are.
fn enriched(state: &SearchState) -> Result<(Point, usize), Error> {
    let policy = &state.setup.policy.grid;
    let SearchState { point, prepared, .. } = state;
    let record = &prepared.record;
    let base = Base::new(point, record, state.setup.options.freedom, &state.setup.options.loss)?;
    let places = places(&base, &prepared.spans(point), state.setup);
    let columns = |known: &Signals, here: &Matrix, experiment: &Experiment, index: usize| {
        let column = |place: &Place| {
            let point = place.added_to(base.point, policy.probe);
            Ok(point.output_from(Stage::Plays, known, experiment, index)? - here)
        };
        install(|| places.par_iter().map(column).collect())
    };
    let Projection { mut left, mut score, squares, cost } =
        base.project(&[places.len()], &columns)?;
    let values = prepared.values();
    // two numbers of a play, priced as in the BIC
    let least = (2.0 * values.ln() / values).max(policy.least) * cost;
    let mut point = point.clone();
    let mut added = 0;
    while added < policy.at_once {
        let usable = |&i: &usize| {
            // a play's weight is not negative
            let sign = matches!(places[i], Place::Deadzone { .. }) || score[i] > 0.0;
            sign && left[(i, i)] > LEFT * squares[i]
        };
        let gain = |i: usize| score[i] * score[i] / left[(i, i)];
        let best = (0..places.len()).filter(usable).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        let Some(best) = best.filter(|&i| gain(i) > least) else { break };
        point = places[best].added_to(&point, 0.0);
        added += 1;
        deflate(&mut left, &mut score, best);
    }
    Ok((point, added))
}

/// Takes one column out of the others.
fn deflate(left: &mut Matrix, score: &mut DVector<f64>, taken: usize) {
    let column = left.column(taken) / left[(taken, taken)].sqrt();
    let own = score[taken] / left[(taken, taken)].sqrt();
    score.axpy(-own, &column, 1.0);
    left.ger(-1.0, &column, &column, 1.0);
}

/// Where plays and deadzones may come: dense where half-widths are small.
fn places(base: &Base, spans: &[f64], setup: &SearchSetup) -> Vec<Place> {
    let GridPolicy { tried_plays, tried_deadzones, density, near_zero, .. } = setup.policy.grid;
    let mut places = Vec::new();
    for (input, span) in spans.iter().enumerate() {
        if setup.moving.half_widths {
            let half_width = |i: usize| 0.5 * span * (i as f64 / tried_plays as f64).powf(density);
            let place = |i| Place::Play { input, half_width: half_width(i) };
            places.extend((1..=tried_plays).map(place));
        }
        if setup.moving.thresholds {
            let (low, high) = range(base.record, input);
            let step = (high - low) / (tried_deadzones + 1) as f64;
            let threshold = |i: usize| low + i as f64 * step;
            let is_apart = |eta: &f64| eta.abs() > near_zero * step;
            let nonzero = (1..=tried_deadzones).map(threshold).filter(is_apart);
            places.extend(nonzero.map(|threshold| Place::Deadzone { input, threshold }));
        }
    }
    places
}
