//! One more effect, fitted jointly with the whole model.
//!
//! A trial minimises the training squares J over all parameters, those of the effect included. Its deviance is
//!
//! ```text
//! D = N ln(J_before / J_after)
//! ```
//!
//! for N values. J_before belongs to the present model, fitted with the same parameters free but those of the effect.
//! An effect on the plays is fitted with the grids free too, because they were placed to replace what the plays lacked;
//! the present model, fitted in the same way without the effect, then gains part of D, and that part is subtracted.
//!
//! A fit begins where the score test says, at `b = L^-1 s` (see [`super::score`]). It begins at the effect without
//! action where b violates the effect's bounds, or where the squares at b exceed those of the present model by a
//! factor: the linear prediction does not hold there. A fit that used all its steps and still lowered the squares over
//! its last ones is continued. Terms of the effect that are implausible at its end are taken out, and the rest is fitted
//! once more.
//!
//! The threshold of D is a function of numbers ([`Significance`]). If D lies between the threshold for white noise and
//! where autocorrelation could no longer matter, the residual's autocorrelation is measured by
//! `kappa = tr(H^-1 M) / (s^2 p)` over p parameters, M the covariance of the score (see [`crate::fit::certainty`]),
//! which is 1 for white noise, and the threshold is raised by it.

use super::concurrently::concurrently;
use super::forces::with_feedthrough;
use super::policy::FitPolicy;
use super::ranking::{Ranked, promised};
use super::score::Score;
use super::state::{SearchState, Trial};
use super::threshold::Significance;
use crate::Error;
use crate::Progress;
use crate::chain::point::Point;
use crate::effects::{ClosedLoops, Entry, FreeOrder, Stage};
use crate::fit::joint::Refined;
use crate::fit::minimize::{FitOptions, Fitted};
use crate::fit::preparation::rescale;
use crate::optimize::Status;
use crate::progress::{as_trial, reached};

/// What a candidate became, or why its fit failed.
pub(super) type Tried = Result<Trial, (&'static Entry, Error)>;

/// Fits candidates; where fits take long, only those that may come near the best so far. The failure of one does not
/// concern the others.
pub(super) fn trials(
    state: &SearchState,
    ranked: Vec<Ranked>,
    progress: Progress,
) -> Result<Vec<Tried>, Error> {
    let tried = |one: Ranked, place: (usize, usize), progress: Progress| -> Result<Tried, Error> {
        let entry = one.entry;
        let trial = as_trial(progress, ("trials", entry.name), place, |progress| {
            trial(state, one, progress)
        });
        let trial = Error::unless_interrupted(trial)?;
        Ok(trial.map_err(|error| (entry, error)))
    };
    if !state.setup.is_long(&state.point) {
        return concurrently(ranked, progress, |one, progress| tried(one, (0, 1), progress));
    }
    let mut trials: Vec<Tried> = Vec::new();
    let all = ranked.len();
    for (place, one) in ranked.into_iter().enumerate() {
        let deviances = trials.iter().flatten().map(|trial| trial.deviance);
        let best = deviances.fold(0.0, f64::max);
        let own = promised(state.prepared.values(), one.score.gain);
        if own >= state.setup.policy.ranking.near * best {
            trials.push(tried(one, (place, all), progress)?);
        }
    }
    Ok(trials)
}

/// Fits the whole model with one more effect.
pub(super) fn trial(
    state: &SearchState,
    Ranked { entry, score, start: given, others, .. }: Ranked,
    progress: Progress,
) -> Result<Trial, Error> {
    let (gain, is_far) = (score.gain, given.is_some());
    let (fitted, options) = match given {
        Some(given) => {
            let steps = state.setup.policy.fits.far_steps;
            // where the output integrates, the balance of forces decides, whatever the squares
            let goal = if state.integrates()? { ANY } else { state.cost };
            let options = FitOptions { steps, goal, ..state.setup.options.clone() };
            let fitted = state.fit(given, &options, entry.name, progress)?;
            (with_feedthrough(state, fitted, &options, entry, progress)?, options)
        }
        None => fitted(state, start(state, &state.point, score)?, entry, ANY, progress)?,
    };
    let trial = own(state, entry, fitted, options, gain, progress)?;
    Ok(Trial { is_far, others, ..trial })
}

/// What a fit of one more effect brought over the present model that is the effect's own.
pub(super) fn own(
    state: &SearchState,
    entry: &'static Entry,
    fitted: Fitted,
    options: FitOptions,
    promised: f64,
    progress: Progress,
) -> Result<Trial, Error> {
    let trial = measured(state, &state.point, entry, fitted, options, promised, progress)?;
    reached(progress, entry.name, (trial.cost / state.prepared.values()).sqrt())?;
    if entry.stage != Stage::Plays || trial.deviance <= trial.threshold {
        return Ok(trial);
    }
    // what the same fit gains without the effect is not the effect's
    let (without, _) = self::fitted(state, state.point.clone(), entry, ANY, progress)?;
    let gained = state.cost / without.linearization.cost.max(f64::MIN_POSITIVE);
    let deviance = trial.deviance - state.prepared.values() * gained.ln().max(0.0);
    Ok(Trial { deviance, ..trial })
}

/// The goal of a fit whose squares are of use whatever they are.
pub(super) const ANY: f64 = 0.0;

/// A point with `entry` as its newest effect, fitted jointly, and what was free at last. Squares above `goal` are not asked for.
pub(super) fn fitted(
    state: &SearchState,
    start: Point,
    entry: &Entry,
    goal: f64,
    progress: Progress,
) -> Result<(Fitted, FitOptions), Error> {
    let mut options = FitOptions { goal, ..state.setup.options.clone() };
    let mut fitted = state.fit(start, &options, entry.name, progress)?;
    if entry.stage == Stage::Plays {
        // the grid was placed to replace what the plays lacked
        options = FitOptions { goal, ..state.setup.moving_grids.clone() };
        fitted = state.fit(fitted.point, &options, entry.name, progress)?;
    }
    fitted = continued(state, fitted, &options, entry, progress)?;
    if let Some(part) = plausible_part(state, &fitted.point, entry) {
        fitted = state.fit(part, &options, entry.name, progress)?;
        fitted = continued(state, fitted, &options, entry, progress)?;
    }
    Ok((fitted, options))
}

/// A fit that is continued as long as it makes progress.
fn continued(
    state: &SearchState,
    mut fitted: Fitted,
    options: &FitOptions,
    entry: &Entry,
    progress: Progress,
) -> Result<Fitted, Error> {
    for _ in 0..state.setup.policy.fits.more {
        let (status, cost) = (fitted.status, fitted.linearization.cost);
        if !makes_progress(status, &fitted.history, cost, &state.setup.policy.fits) {
            break;
        }
        fitted = state.fit(fitted.point, options, entry.name, progress)?;
    }
    Ok(fitted)
}

/// A point whose newest effect of an entry has lost the terms that make it implausible. They may only have made up for each
/// other.
pub(super) fn plausible_part(state: &SearchState, point: &Point, entry: &Entry) -> Option<Point> {
    let place = point.effects.iter().rposition(|effect| effect.name() == entry.name)?;
    let part = point.effects[place].plausible_part(state.duration())?;
    Some(point.without_effect(place).with_effect(part))
}

/// A point with one more effect: as the score test suggests it, or without effect yet where that is beyond what is
/// linear or sensible.
pub(super) fn start(state: &SearchState, base: &Point, score: Score) -> Result<Point, Error> {
    let start = base.with_effect(score.start.clone());
    let Some(zero) = score.zero else { return Ok(start) };
    let is_sensible = score.start.block().is_none_or(|block| {
        let mut limits = block.values().into_iter().zip(block.bounds());
        limits.all(|(value, (low, high))| low <= value && value <= high)
    });
    let loops = score.start.place().closed_loops().map_or(&[][..], ClosedLoops::loops);
    let has_memory = loops.iter().any(|inner| inner.law.has_memory());
    let FitPolicy { beyond, beyond_with_memory, .. } = state.setup.policy.fits;
    let most = if has_memory { beyond_with_memory } else { beyond };
    let squares = |point| state.training_squares(point);
    let is_near = squares(&start)? <= most * squares(base)?;
    Ok(if is_sensible && is_near { start } else { base.with_effect(zero) })
}

/// Makes modes that were found parts of G. One with a pole that no motion between the samples has stays beside G where loops
/// are computed in several steps a sample.
pub(super) fn join_modes(point: &mut Point) {
    let mut place = 0;
    while place < point.effects.len() {
        let joins = point.effects[place].entry().free_order == FreeOrder::JoinsG;
        let joined = joins.then(|| point.with_effect_in_dynamics(place));
        match joined.filter(Point::moves_between_samples) {
            Some(joined) => *point = joined,
            None => place += 1,
        }
    }
    rescale(point);
}

/// What a fit brought over the present model; `without` is what the effect was added to.
pub(super) fn measured(
    state: &SearchState,
    without: &Point,
    entry: &'static Entry,
    fitted: Fitted,
    options: FitOptions,
    promised: f64,
    progress: Progress,
) -> Result<Trial, Error> {
    let (cost, values) = (fitted.linearization.cost, state.prepared.values());
    let point = fitted.point.clone();
    let deviance = values * (state.cost / cost.max(f64::MIN_POSITIVE)).ln();
    let significance = Significance {
        values,
        added: state.setup.estimated(&point).saturating_sub(state.setup.estimated(&state.point)),
        is_long: state.setup.is_long(&point),
        is_more: state.is_more(entry),
    };
    let threshold = threshold(state, fitted, options, significance, deviance, progress)?;
    let held_out = state.held_out(&point)?;
    let rms = state.rms(&point)?;
    let is_driven = is_driven(state, without, &point)?;
    let (is_far, others) = (false, Vec::new());
    Ok(Trial {
        entry,
        point,
        cost,
        deviance,
        threshold,
        held_out,
        rms,
        promised,
        is_driven,
        is_far,
        others,
    })
}

/// What a deviance must exceed, with the autocorrelation of the residual of a fit where that matters.
pub(super) fn threshold(
    state: &SearchState,
    fitted: Fitted,
    options: FitOptions,
    significance: Significance,
    deviance: f64,
    progress: Progress,
) -> Result<f64, Error> {
    let policy = &state.setup.policy.judgement;
    if !significance.depends_on_autocorrelation(deviance, policy) {
        return Ok(significance.threshold(policy));
    }
    let refined = Refined { fitted, options, outliers: 0, robust: false };
    let uncertainty = refined.uncertainty(&state.prepared.record, progress)?;
    let factor = uncertainty.used / uncertainty.estimated.max(1) as f64;
    Ok(significance.threshold_of_autocorrelated(factor, policy))
}

/// Whether it is the input that makes the lags beside G explain what they do: those whose initial state is unknown
/// also decay from it, and that is a function of time.
fn is_driven(state: &SearchState, without: &Point, with: &Point) -> Result<bool, Error> {
    let moves = with.pasts.iter().any(|past| past.has_unknown_state);
    if !moves || with.order() == with.dynamics.order() {
        return Ok(true);
    }
    let mut undriven = with.clone();
    for place in 0..with.effects.len() {
        undriven.change_sections(place, |all| all.iter_mut().for_each(|(_, b)| b.fill(0.0)));
    }
    let squares = |point| state.training_squares(point);
    Ok(squares(&undriven)? > state.setup.policy.judgement.driven * squares(without)?)
}

/// Whether the last steps of a fit that had no more were long ones; all steps where it took few, because most that it
/// tried failed. `history` are the squares at the start and after each step, `cost` those at the end.
fn makes_progress(status: Status, history: &[f64], cost: f64, policy: &FitPolicy) -> bool {
    let before = history.get(history.len().saturating_sub(policy.last_steps + 1));
    status == Status::Limit && before.is_some_and(|before| cost < (1.0 - policy.progress) * before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{fine, record, run};
    use crate::effects::LinearDynamics;
    use crate::fit::preparation::Prepared;

    #[test]
    fn a_mode_without_motion_between_samples_stays_beside_the_dynamics() {
        let model = fine();
        let record = record(&model, vec![run(1.5, 0.0, 130, vec![])]);
        let channels = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let point = Prepared::new(&record, channels).unwrap().point_of(&model).unwrap();
        let stays = |denominator: [f64; 2]| {
            let (denominator, numerator) = (denominator.to_vec(), vec![0.1, 0.05]);
            let mode =
                LinearDynamics { input: 0, denominator, numerator, rate: 100.0, dead_time: 2 };
            let mut own = point.with_effect(mode.into());
            join_modes(&mut own);
            own.effects.len() > point.effects.len()
        };
        assert!(!stays([-1.6, 0.8]));
        // poles at 0.5 and -0.4
        assert!(stays([-0.1, -0.2]));
    }

    #[test]
    fn a_fit_goes_on_where_its_last_steps_were_long() {
        let policy = FitPolicy { last_steps: 2, progress: 0.1, ..FitPolicy::default() };
        let goes_on =
            |status, history: &[f64], cost| makes_progress(status, history, cost, &policy);
        // by 20 % in the last two steps, by 2 %, and by 20 % in the only one
        assert!(goes_on(Status::Limit, &[9.0, 5.0, 4.5, 4.0], 4.0));
        assert!(!goes_on(Status::Limit, &[9.0, 4.08, 4.05, 4.0], 4.0));
        assert!(goes_on(Status::Limit, &[5.0, 4.0], 4.0));
        // what has converged, or has not moved, has nothing to gain
        assert!(!goes_on(Status::Converged, &[9.0, 5.0, 4.5, 4.0], 4.0));
        assert!(!goes_on(Status::Limit, &[], 4.0));
    }
}
