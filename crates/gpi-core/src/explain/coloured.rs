//! The search once more, weighed by the memory of the noise.
//!
//! Least squares of the residual is the most likely fit where the noise is white. Noise with a memory is worth fewer samples
//! than it has: beside slow noise, plays and effects whose output is much smaller than the noise are not found, although the
//! noise hardly moves while they do. Where a residual could be autocorrelated noise but for a test of structure, the search goes
//! on with what the past of the residual does not predict,
//!
//! ```text
//! w(k) = e(k) - sum_i a_i e(k - i)
//! ```
//!
//! in place of e everywhere: fits, squares, thresholds, and the noise floor. The a_i are those of the residual, and are taken
//! anew in each round, because what the model still lacks is part of it at first. Source: L. Ljung, System Identification,
//! 1999, sections 3.2 and 7.4.
//!
//! Any smooth error is predicted by its past, the error of a wrong model too, which would pass for noise here. What the rounds
//! find is therefore kept only if the following holds. Otherwise the model before the rounds stands, unless e itself is considerably smaller
//! after them, on the training data and on what is held out: the search then goes on from there with e, as it does without such noise, and
//! its model is kept if it is near the noise.
//!
//! - They leave autocorrelated noise and nothing else, by all tests of structure.
//! - e is hardly larger than before. Noise moves the estimates of both fits by little, but where e is an error of the model,
//!   the fit makes it larger for a smaller w.
//! - The a_i also predict the noise at rest or between repeated periods, where the record has them: the error of a model is
//!   not there when nothing moves.

use super::finish::refined;
use super::noise::{is_alone, memory};
use super::residual::{PREDICTION, STRUCTURE, WHITENESS, tests_of};
use super::search::run;
use super::setup::SearchSetup;
use super::state::SearchState;
use crate::Error;
use crate::effects::ColouredNoise;
use crate::fit::joint::balance;
use crate::fit::problem::residual_rms;
use crate::identify::{NoiseFloor, NoiseMethod};
use crate::optimize::{Autoregression, Loss};
use crate::progress::{Progress, Report};
use std::cell::OnceCell;

/// Goes on with the search where the noise has a memory, for as many rounds as there are places for their setups.
pub(super) fn search_weighed<'a>(
    state: &mut SearchState<'a>,
    rounds: &'a [OnceCell<SearchSetup>],
    progress: Progress,
) -> Result<(), Error> {
    let mut latest: Option<SearchState> = None;
    for round in rounds {
        let before = latest.as_ref().unwrap_or(state);
        let Some((Residual::WithStructure, loss)) = residual(before)? else { break };
        let setup = round.get_or_init(|| before.setup.with_loss(&loss));
        // a round that fails leaves what was there before
        let next = Error::unless_interrupted(searched(before, setup, progress))?;
        let Ok(next) = next else { break };
        latest = Some(next);
    }
    let Some(latest) = latest else { return Ok(()) };
    if is_better(&latest, state)? {
        *state = latest;
    } else if errs_less(&latest, state)? {
        let mut next = latest.under(state.setup)?;
        run(&mut next, progress)?;
        if next.cost < state.cost && next.is_near(&next.point)? {
            *state = next;
        }
    }
    Ok(())
}

/// Whether the latest state's errors are considerably smaller than before, on the training data and on what is held out.
fn errs_less(latest: &SearchState, before: &SearchState) -> Result<bool, Error> {
    let most = 1.0 - before.setup.policy.noise.grown;
    let pairs = latest.rms(&latest.point)?.into_iter().zip(before.rms(&before.point)?);
    Ok(pairs.into_iter().all(|(latest, before)| latest < most * before))
}

/// Whether autocorrelated noise is all that the latest state leaves, its residual is not much larger than before, and the noise is also
/// there at rest.
fn is_better(latest: &SearchState, before: &SearchState) -> Result<bool, Error> {
    let most = 1.0 + before.setup.policy.noise.grown;
    if latest.rms(&latest.point)?[0] > most * before.rms(&before.point)?[0] {
        return Ok(false);
    }
    match residual(latest)? {
        Some((Residual::Noise, loss)) => is_there_at_rest(latest, &loss),
        _ => Ok(false),
    }
}

/// Whether the past of the noise also predicts what was found of it without the model, where the record shows that.
fn is_there_at_rest(state: &SearchState, loss: &Loss) -> Result<bool, Error> {
    let record = &state.prepared.record;
    let residuals = state.point.residuals(record)?;
    let floor = NoiseFloor::estimate(record, &residuals);
    let predicted = NoiseFloor::estimate(record, &loss.all_errors(&residuals));
    let mut outputs = loss.noise.iter().zip(predicted.rms.iter().zip(&floor.rms));
    Ok(floor.method == NoiseMethod::HighFrequencyResidual
        || outputs.all(|(noise, (predicted, all))| noise.is_white() || predicted < all))
}

/// What the search finds from a state on under another setup, and a last fit of it, by which it is judged.
fn searched<'a>(
    before: &SearchState<'a>,
    setup: &'a SearchSetup,
    progress: Progress,
) -> Result<SearchState<'a>, Error> {
    let mut next = before.under(setup)?;
    // errors of this search are those of the innovations, which are smaller than the errors of the model
    let mut progress = |report: &Report| progress(&Report { error: None, ..*report });
    run(&mut next, &mut progress)?;
    let (fitted, _) = refined(&next, false, &mut progress)?;
    (next.point, next.cost) = (fitted.point, fitted.linearization.cost);
    Ok(next)
}

/// What a residual is that could be autocorrelated noise.
enum Residual {
    /// It depends on the input or on time as well, or comes in bursts.
    WithStructure,
    /// No test of structure fails.
    Noise,
}

/// What the residual is and how it counts as noise with a memory; `None` where it is no such noise.
fn residual(state: &SearchState) -> Result<Option<(Residual, Loss)>, Error> {
    let setup = state.setup;
    if !setup.allowed.iter().any(|entry| entry.explains_autocorrelation) {
        return Ok(None);
    }
    let record = &state.prepared.record;
    let residuals = state.point.residuals(record)?;
    let floor = NoiseFloor::estimate(record, &residuals);
    let outputs = 0..record.outputs().len();
    let noises: Vec<Option<ColouredNoise>> =
        outputs.map(|output| memory(state, &residuals, output, &floor)).collect();
    if noises.iter().all(Option::is_none) {
        return Ok(None);
    }
    let model = state.point.to_model(record, record, &state.prepared.means)?;
    let tests = tests_of(&model, record, &residuals)?;
    let most = setup.policy.noise.predictable;
    if tests.iter().any(|test| test.name == PREDICTION && test.statistic > most) {
        return Ok(None);
    }
    let fails = |names: &[&str], output: usize| {
        let mut failed = tests.iter().filter(|test| !test.passed());
        failed.any(|test| test.output == output && names.contains(&test.name))
    };
    let mut is_structured = false;
    for (output, noise) in noises.iter().enumerate() {
        let is_alone = noise.as_ref().is_none_or(|own| is_alone(state, &residuals, own, &floor));
        is_structured |= !is_alone || fails(&STRUCTURE, output);
        if noise.is_none() && fails(&[WHITENESS], output) {
            return Ok(None);
        }
    }
    let sizes = residual_rms(&residuals, record);
    let (mut innovations, mut memories) = (Vec::new(), Vec::new());
    for (noise, size) in noises.into_iter().zip(sizes) {
        let (innovation, coefficients) =
            noise.map_or((size, Vec::new()), |noise| (noise.innovation, noise.coefficients));
        innovations.push(innovation);
        memories.push(Autoregression::new(&coefficients));
    }
    let loss =
        Loss { scales: balance(&innovations), noise: memories, ..setup.options.loss.clone() };
    let kind = if is_structured { Residual::WithStructure } else { Residual::Noise };
    Ok(Some((kind, loss)))
}
