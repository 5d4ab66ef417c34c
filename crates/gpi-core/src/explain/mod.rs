//! Closing the loop: residual, missing effect, before and after.
//!
//! 1. The declared model (deadzones, plays, G) is identified on the training data: the record without ten
//!    blocks of time. G is kept from poles that would follow creep or a disturbance.
//! 2. Every candidate of the catalogue is ranked by a score test: the output's change with the effect,
//!    projected off the model's own sensitivities, takes a part of the residual.
//! 3. The best few are fitted jointly with the whole model. The one that explains most stays if it gains
//!    more than chance, and if the held-out blocks confirm it; effects that it makes superfluous go.
//! 4. Back to 2 until nothing is confirmed; then the residual is tested for what is left.

mod blocks;
mod grid;
mod lags;
mod noise;
mod residual;
mod revision;
mod score;
mod search;
mod trial;
mod verdict;

use crate::effects::Effect;
use crate::identify::chain::{compare, prepare};
use crate::identify::levenberg_marquardt::fit;
use crate::identify::point::Point;
use crate::identify::preparation::starts_at_rest;
use crate::identify::refine::{RefineOptions, Refined, settings};
use crate::identify::residuals_from_fitted_start;
use crate::identify::{Grid, IdentifyOptions, Parameter, Progress, Refinement};
use crate::{Error, Matrix, Model, Record, SimulationError};
pub use residual::{ResidualOptions, ResidualTest, residual_tests};
use search::{Round, Search};
use std::ops::Range;
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

/// One step: the declared model, or an effect that was added to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The effect; `None` for the declared model.
    pub effect: Option<&'static str>,
    /// What the effect's parameters came to when all was refined: names, values and standard deviations.
    pub parameters: Vec<Parameter>,
    /// The unit of each parameter, empty for a pure number.
    pub units: Vec<String>,
    /// The part of the residual's squares that the score test promised, 0 to 1.
    pub promised: f64,
    /// Twice the rise of the log-likelihood: `N ln(squares before / squares after)`.
    pub deviance: f64,
    /// What chance alone would give at most, with as many parameters and the residual's own colour.
    pub chance: f64,
    /// Effects that this one made superfluous.
    pub dropped: Vec<&'static str>,
    /// Root mean square error on the training data.
    pub train_rms: f64,
    /// Root mean square error on the held-out blocks.
    pub holdout_rms: f64,
}

/// Errors on the data of the fit, and on data that took no part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// On the training data.
    pub train: SimulationError,
    /// On the held-out record, or on the held-out blocks where there is none.
    pub holdout: SimulationError,
}

/// What a record's model lacked.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The declared model alone.
    pub base: Model,
    /// The model with all effects.
    pub model: Model,
    /// How the model was refined, and how sure its parameters are.
    pub refinement: Refinement,
    /// Names of the effects, in the order they were added.
    pub effects: Vec<&'static str>,
    /// The declared model, then every effect that was added.
    pub steps: Vec<Step>,
    /// Effects that were tried and not taken.
    pub rejected: Vec<Rejected>,
    /// Errors of the declared model.
    pub before: Errors,
    /// Errors with all effects; isolated wrong samples that were found are not scored.
    pub after: Errors,
    /// Tests of what is left.
    pub tests: Vec<ResidualTest>,
    /// What it comes to.
    pub verdict: Verdict,
    /// What to measure next, when that would tell more.
    pub next_experiment: Option<NextExperiment>,
    /// Measured minus simulated outputs of the declared model, (samples, outputs), one an experiment.
    pub residuals_before: Vec<Matrix>,
    /// The same with all effects.
    pub residuals_after: Vec<Matrix>,
    /// Samples of each experiment that were held out.
    pub held_out: Vec<Vec<Range<usize>>>,
    /// Whether the search was stopped before it had finished.
    pub interrupted: bool,
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
    let spikes = crate::identify::outliers::places(&outputs, &revision::everything(&training)?, 0);
    let training = revision::repaired(&training, &outputs, &spikes)?;
    let mut prepared = prepare(&training, &identify)?;
    let measured = as_measured(&prepared.record, record, &prepared.means)?;
    let mut refined = compare(&mut prepared, &identify, true, progress)?.refined;
    refined.drop_undetermined(&prepared, progress)?;
    let base = refined.fitted.point.clone();
    let order_is_given = identify.order.is_some() || identify.delay.is_some();
    let given = |grid: &Option<Grid>| matches!(grid, Some(Grid::Values(_)));
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
    summarise(record, holdout, &base, search, refinement, interrupted)
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
    // Where the past is unknown, many plays are needed to find it.
    let in_motion = |e: &crate::Experiment| e.warmup == 0 && !starts_at_rest(e);
    let plays = if training.experiments().iter().any(in_motion) { 24 } else { 16 };
    IdentifyOptions {
        half_widths: Some(options.half_widths.clone().unwrap_or(Grid::Count(plays))),
        thresholds: Some(options.thresholds.clone().unwrap_or(Grid::Count(7))),
        robust: Some(false),
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
    const STEPS: usize = 25;
    let mut options =
        settings(&search.prepared, &search.moving, if interrupted { 1 } else { STEPS });
    options.weighting.outputs.clone_from(&search.options.weighting.outputs);
    let fitted =
        fit(search.point.clone(), &search.prepared.record, &options, "refinement", progress)?;
    search.point = fitted.point.clone();
    search.repair()?;
    let refined = Refined { fitted, options, outliers: 0, robust: false };
    let refinement = refined.finish(&search.prepared, progress)?;
    search.point = refinement.point.clone();
    Ok(refinement)
}

/// Puts everything into words and numbers.
fn summarise(
    record: &Record,
    holdout: Option<&Record>,
    base: &Point,
    search: Search,
    refinement: Refinement,
    interrupted: bool,
) -> Result<Explanation, Error> {
    let (mended, measured) = (&search.prepared.record, &search.measured);
    let means = &search.prepared.means;
    let (residuals_before, residuals_after) =
        (base.residuals(measured)?, search.point.residuals(mended)?);
    let base = base.to_model(record, mended, means)?;
    let mut model = search.point.to_model(record, mended, means)?;
    let errors = |record: &Record, model: &Model, residuals: &[Matrix]| -> Result<Errors, Error> {
        let train = SimulationError::of(record, residuals, false);
        let test = match holdout {
            Some(other) => on_another(model, other)?,
            None => SimulationError::of(&search.test, residuals, false),
        };
        Ok(Errors { train, holdout: test })
    };
    let before = errors(measured, &base, &residuals_before)?;
    let after = errors(mended, &model, &residuals_after)?;
    let tests = residual::tests_of(&model, mended, &residuals_after)?;
    let noise: Vec<Effect> =
        noise::effects(&search, &residuals_after, &tests, &refinement.noise_floor)?
            .into_iter()
            .filter(|effect| search.allowed.iter().any(|entry| entry.name == effect.name()))
            .collect();
    let values = search.prepared.values();
    let mut steps = vec![declared(&before)];
    steps.extend(search.rounds.iter().map(|round| added(round, &search, values)));
    steps.extend(noise.iter().map(|effect| of_noise(effect, &after)));
    describe(&mut steps, &search.point, &refinement, &noise, &model)?;
    let mut effects: Vec<&'static str> = Vec::new();
    for name in steps.iter().filter(|s| !s.parameters.is_empty()).filter_map(|s| s.effect) {
        if !effects.contains(&name) {
            effects.push(name);
        }
    }
    let mut all = model.effects().to_vec();
    all.extend(noise);
    model = model.with_effects(all)?;
    let mut rejected = search.last.clone();
    rejected.extend(search.rounds.iter().flat_map(|round| round.others.iter().cloned()));
    rejected.retain(|one| !effects.contains(&one.effect));
    let verdict = verdict::verdict(&effects, &tests);
    Ok(Explanation {
        next_experiment: verdict::next_experiment(&rejected, &effects, &tests, verdict, record),
        held_out: mended.experiments().iter().map(|e| e.held_out.clone()).collect(),
        base,
        model,
        refinement,
        effects,
        steps,
        rejected,
        before,
        after,
        tests,
        verdict,
        residuals_before,
        residuals_after,
        interrupted,
    })
}

/// The error on another experiment, without effects that are others there.
fn on_another(model: &Model, record: &Record) -> Result<SimulationError, Error> {
    let driven = model.effects().iter().filter(|effect| effect.entry().driven).cloned();
    let model = model.clone().with_effects(driven.collect())?;
    let residuals = residuals_from_fitted_start(&model, record, &mut |_, _| true)?;
    Ok(SimulationError::of(record, &residuals, false))
}

fn declared(before: &Errors) -> Step {
    Step {
        effect: None,
        parameters: Vec::new(),
        units: Vec::new(),
        promised: 0.0,
        deviance: 0.0,
        chance: 0.0,
        dropped: Vec::new(),
        train_rms: before.train.rms,
        holdout_rms: before.holdout.rms,
    }
}

fn added(round: &Round, search: &Search, values: f64) -> Step {
    let trial = &round.trial;
    Step {
        effect: Some(trial.entry.name),
        parameters: Vec::new(),
        units: Vec::new(),
        promised: trial.promised,
        deviance: trial.deviance,
        chance: trial.chance,
        dropped: round.dropped.clone(),
        train_rms: (trial.cost / values).sqrt(),
        holdout_rms: search.holdout_rms(&trial.held_out),
    }
}

fn of_noise(effect: &Effect, after: &Errors) -> Step {
    Step {
        effect: Some(effect.name()),
        train_rms: after.train.rms,
        holdout_rms: after.holdout.rms,
        ..declared(after)
    }
}

/// Fills in what the parameters of the effects came to.
fn describe(
    steps: &mut [Step],
    point: &Point,
    refinement: &Refinement,
    noise: &[Effect],
    model: &Model,
) -> Result<(), Error> {
    let blocks = point.blocks();
    let deviations = refinement.effect_deviations()?;
    let certain = noise.iter().map(|effect| (effect.clone(), Vec::new()));
    let mut all: Vec<(Effect, Vec<f64>)> =
        blocks.into_iter().zip(deviations).chain(certain).collect();
    for step in steps {
        let Some(place) = all.iter().position(|(e, _)| Some(e.name()) == step.effect) else {
            continue;
        };
        let (effect, deviations) = all.remove(place);
        for (i, quantity) in model.quantities(&effect).into_iter().enumerate() {
            step.units.push(quantity.unit);
            step.parameters.push(Parameter {
                name: quantity.name,
                value: quantity.value,
                deviation: deviations.get(i).copied().unwrap_or(0.0),
            });
        }
    }
    Ok(())
}
