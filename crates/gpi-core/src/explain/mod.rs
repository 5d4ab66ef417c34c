//! Closing the loop: residual, missing effect, before and after.
//!
//! 1. The declared model (deadzones, plays, G) is identified on the training data: the record without ten
//!    blocks of time. G is kept from poles that would follow creep or a disturbance.
//! 2. Every candidate of the catalogue is ranked by a score test: the output's change with the effect,
//!    projected off the model's own sensitivities, takes a part of the residual.
//! 3. The best few are fitted jointly with the whole model. The one that explains most stays if it gains
//!    more than chance, and if the held-out blocks confirm it; effects that it makes superfluous go.
//! 4. Back to 2 until nothing is confirmed; then what the input drives takes the place of a slow function
//!    of time that it explains as well, and the residual is tested for what is left.

mod blocks;
mod concurrently;
mod explanation;
mod grid;
mod lags;
mod moved_resonance;
mod noise;
mod projection;
mod ranking;
mod residual;
mod revision;
pub(crate) mod score;
mod search;
mod trial;
mod verdict;

use crate::fit::minimize::fit;
use crate::fit::preparation::starts_at_rest;
use crate::fit::refine::{RefineOptions, Refined, settings};
use crate::identify::procedure::{compare, prepare};
use crate::identify::{Grid, IdentifyOptions, Progress, Refinement};
use crate::spectrum::is_one_sine;
use crate::{Error, Matrix, Record};
use explanation::summarise;
pub use explanation::{Errors, Explanation, Step};
pub use moved_resonance::Resonance;
pub use residual::{ResidualOptions, ResidualTest, residual_tests};
use search::Search;
pub use trial::Rejected;
pub use verdict::{NextExperiment, Verdict, structured};

/// What an explanation may use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainOptions {
    /// How the declared model is identified.
    pub identify: IdentifyOptions,
    /// Names of the effects that may be added; all of the catalogue when `None`.
    pub effects: Option<Vec<String>>,
    /// Names of effects that are added whatever they gain.
    pub require: Vec<String>,
}

/// Finds out what a record's model lacks.
///
/// `holdout` is another experiment of the same actuator to test on; effects that the input does not drive
/// (drift, disturbances) are left out there, because they are others in another experiment. The search
/// itself confirms effects on blocks of `record` that no fit sees. `progress` that returns false ends the
/// search; what was found so far is the result.
///
/// ```no_run
/// use gpi_core::explain::{ExplainOptions, explain};
/// # fn demo(record: &gpi_core::Record) -> Result<(), gpi_core::Error> {
/// let found = explain(record, None, &ExplainOptions::default(), &mut |_, _| true)?;
/// println!("{:?}: {} -> {}", found.effects, found.before.holdout.rms, found.after.holdout.rms);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As for [`identify`](crate::identify::identify); an effect that the catalogue does not know, a held-out
/// record of other channels, [`Error::Interrupted`] when not even the declared model was identified.
pub fn explain(
    record: &Record,
    holdout: Option<&Record>,
    options: &ExplainOptions,
    progress: Progress,
) -> Result<Explanation, Error> {
    let allowed = search::allowed("effects", options.effects.as_deref())?;
    let required = search::allowed("require", Some(&options.require))?;
    record.require_moving()?;
    let training = blocks::hold_out(record)?;
    let identify = usual_grids(&options.identify, &training);
    // Spikes that stand out of the output itself.
    let outputs: Vec<Matrix> = training.experiments().iter().map(|e| e.output.clone()).collect();
    let spikes =
        crate::uncertainty::outliers::places(&outputs, &revision::everything(&training)?, 0);
    let training = revision::repaired(&training, &outputs, &spikes)?;
    let mut prepared = prepare(&training, &identify)?;
    let measured = as_measured(&prepared.record, record, &prepared.means)?;
    let mut refined = compare(&mut prepared, &identify, true, progress)?.refined;
    refined.drop_undetermined(&prepared, progress)?;
    let base = refined.fitted.point.clone();
    let order_is_given = identify.order.is_some() || identify.delay.is_some();
    // none at all is a grid too
    let given = |grid: &Option<Grid>| matches!(grid, Some(Grid::Values(_) | Grid::Count(0)));
    let moving = RefineOptions {
        thresholds: !given(&identify.thresholds),
        half_widths: !given(&identify.half_widths),
        ..RefineOptions::default()
    };
    let mut search = Search::new(prepared, &refined, allowed, order_is_given, measured, moving)?;
    search.repair()?;
    let mut interrupted = is_interrupted(search.run(progress))?;
    search.settle_lags()?;
    for entry in required {
        interrupted = interrupted || is_interrupted(search.force(entry, progress))?;
    }
    let mut patient = |_: &str, _: f64| true;
    let last: Progress = if interrupted { &mut patient } else { progress };
    let refinement = finish(&mut search, interrupted, last)?;
    // what rules out that the input's side alone is wrong
    let is_inside = search.point.loops().next().is_some();
    let moved_resonance = if is_inside && !interrupted {
        moved_resonance::moved_resonance(&base, &search.prepared, &search.options, last)?
    } else {
        None
    };
    let found = summarise(record, holdout, &base, search, refinement, interrupted)?;
    Ok(Explanation { moved_resonance, ..found })
}

/// Whether a search ended because it was to stop: what it has found so far stands.
fn is_interrupted(result: Result<(), Error>) -> Result<bool, Error> {
    match result {
        Err(Error::Interrupted) => Ok(true),
        other => other.map(|()| false),
    }
}

/// Grids that are rich enough for a base model and cheap enough for a search.
fn usual_grids(options: &IdentifyOptions, training: &Record) -> IdentifyOptions {
    let robust = Some(false);
    if is_one_sine(training) {
        // One cycle cannot tell many plays apart: as few as it asks for.
        return IdentifyOptions { robust, ..options.clone() };
    }
    // Where the past is unknown, many plays are needed to find it.
    let in_motion = |e: &crate::Experiment| e.warmup == 0 && !starts_at_rest(e);
    let plays = if training.experiments().iter().any(in_motion) { 24 } else { 16 };
    IdentifyOptions {
        half_widths: Some(options.half_widths.clone().unwrap_or(Grid::Count(plays))),
        thresholds: Some(options.thresholds.clone().unwrap_or(Grid::Count(7))),
        robust,
        ..options.clone()
    }
}

/// The prepared record with its outputs as they were measured, wrong samples included.
fn as_measured(prepared: &Record, given: &Record, means: &[f64]) -> Result<Record, Error> {
    let mut experiments = prepared.experiments().to_vec();
    for (experiment, given) in experiments.iter_mut().zip(given.experiments()) {
        experiment.output.copy_from(&given.output);
        for (mut column, mean) in experiment.output.column_iter_mut().zip(means) {
            column.add_scalar_mut(-mean);
        }
    }
    prepared.with_experiments(experiments)
}

/// Refines everything once more, grids that were not given included, and works out how sure it is.
fn finish(search: &mut Search, interrupted: bool, progress: Progress) -> Result<Refinement, Error> {
    const STEPS: usize = 15;
    /// With the grids held.
    const STILL: usize = 30;
    /// Times the gain at which a refinement by itself would end: as much as chance gives one parameter.
    const COARSER: f64 = 10.0;
    let stage = |options: &RefineOptions, steps: usize| {
        let mut own = settings(&search.prepared, options, steps);
        own.loss.scales.clone_from(&search.options.loss.scales);
        own
    };
    let mut options = stage(&search.moving, if interrupted { 1 } else { STEPS });
    options.gain *= COARSER;
    let record = &search.prepared.record;
    let mut fitted = fit(search.point.clone(), record, &options, "refinement", progress)?;
    if !interrupted && (search.moving.thresholds || search.moving.half_widths) {
        // with all that moves at once, the kinks at which plays turn end the fit before the rest has settled
        let still = stage(&RefineOptions::default(), STILL);
        let before = fitted.history;
        let settled = fit(fitted.point, record, &still, "refinement", progress)?.after(&before);
        fitted =
            fit(settled.point, record, &options, "refinement", progress)?.after(&settled.history);
    }
    search.point = fitted.point.clone();
    search.repair()?;
    let refined = Refined { fitted, options, outliers: 0, robust: false };
    let refinement = refined.finish(&search.prepared, progress)?;
    search.point = refinement.bands.point.clone();
    Ok(refinement)
}
