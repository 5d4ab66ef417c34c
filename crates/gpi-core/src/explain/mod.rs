//! Closing the loop: residual, missing effect, before and after.

mod blocks;
mod noise;
mod residual;
mod score;
mod search;

use crate::effects::Effect;
use crate::identify::chain::{compare, prepare};
use crate::identify::levenberg_marquardt::fit;
use crate::identify::point::Point;
use crate::identify::preparation::starts_at_rest;
use crate::identify::refine::{RefineOptions, settings};
use crate::identify::{Grid, IdentifyOptions, NoiseFloor, Progress};
use crate::{Error, Matrix, Model, Record, SimulationError};
pub use residual::ResidualTest;
pub use search::Rejected;
use search::Search;

/// What an explanation may use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainOptions {
    /// How the declared model is identified.
    pub identify: IdentifyOptions,
    /// Names of the effects that may be added; all of the catalogue when `None`.
    pub effects: Option<Vec<String>>,
}

/// One step of an explanation: the declared model, or an effect that was added to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The effect; `None` for the declared model.
    pub effect: Option<&'static str>,
    /// By how much the log-likelihood rose, twice: `N ln(squares before / squares after)`.
    pub deviance: f64,
    /// What chance alone would give at most.
    pub chance: f64,
    /// Root mean square error on the training data.
    pub train_rms: f64,
    /// Root mean square error on the held-out blocks.
    pub holdout_rms: f64,
}

/// What a record's model lacked.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The declared model.
    pub base: Model,
    /// The model with all effects.
    pub model: Model,
    /// Names of the effects, in the order they were added.
    pub effects: Vec<&'static str>,
    pub steps: Vec<Step>,
    pub rejected: Vec<Rejected>,
    pub before: (SimulationError, SimulationError),
    pub after: (SimulationError, SimulationError),
    pub noise_floor: NoiseFloor,
    pub residuals: Vec<Matrix>,
    pub blocks: Vec<Effect>,
    pub tests: Vec<ResidualTest>,
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

/// Explains a record.
pub fn explain(
    record: &Record,
    options: &ExplainOptions,
    progress: Progress,
) -> Result<Explanation, Error> {
    let allowed = search::allowed(options.effects.as_deref())?;
    let (training, _) = blocks::hold_out(record)?;
    // Where the past is unknown, many plays are needed to find it.
    let in_motion = |e: &crate::Experiment| e.warmup == 0 && !starts_at_rest(e);
    let plays = if training.experiments().iter().any(in_motion) { 24 } else { 16 };
    let identify = IdentifyOptions {
        half_widths: Some(options.identify.half_widths.clone().unwrap_or(Grid::Count(plays))),
        thresholds: Some(options.identify.thresholds.clone().unwrap_or(Grid::Count(7))),
        robust: Some(false),
        ..options.identify.clone()
    };
    // Spikes that stand out of the output itself.
    let outputs: Vec<Matrix> = training.experiments().iter().map(|e| e.output.clone()).collect();
    let spikes = crate::identify::outliers::places(&outputs, &search::everything(&training)?);
    let training = search::repaired(&training, &outputs, &spikes)?;
    let mut prepared = prepare(&training, &identify)?;
    let given = as_measured(&prepared.record, record, &prepared.means)?;
    let mut refined = compare(&mut prepared, &identify, true, progress)?.refined;
    refined.drop_undetermined(&prepared, progress)?;
    let means = prepared.means.clone();
    let base = refined.fitted.point.clone();
    let mut search =
        Search::new(prepared, &refined, allowed, options.identify.order.is_some(), spikes)?;
    search.repair()?;
    // with its outliers, and without
    let error = |search: &Search, point: &Point, record: &Record| -> Result<_, Error> {
        let residuals = point.residuals(record)?;
        let train = SimulationError::of(record, &residuals, false);
        Ok((train, SimulationError::of(&search.test, &residuals, false)))
    };
    let before = error(&search, &base, &given)?;
    search.run(progress)?;
    // The grids were placed before the effects were known.
    let polish = RefineOptions { thresholds: true, half_widths: true, ..RefineOptions::default() };
    let mut options = settings(&search.prepared, &polish, 25);
    options.weighting.outputs.clone_from(&search.options.weighting.outputs);
    let fitted =
        fit(search.point.clone(), &search.prepared.record, &options, "refinement", progress)?;
    search.point = fitted.point;
    let after = error(&search, &search.point, &search.prepared.record)?;
    let mut steps = vec![Step {
        effect: None,
        deviance: 0.0,
        chance: 0.0,
        train_rms: before.0.rms,
        holdout_rms: before.1.rms,
    }];
    let values = search.prepared.values();
    let mut rejected = search.last.clone();
    for round in &search.rounds {
        steps.push(Step {
            effect: Some(round.trial.entry.name),
            deviance: round.trial.deviance,
            chance: round.trial.chance,
            train_rms: (round.trial.cost / values).sqrt(),
            holdout_rms: search.holdout_rms(&round.trial.held_out),
        });
        rejected.extend(round.others.iter().cloned());
    }
    let mut effects: Vec<&'static str> = Vec::new();
    let present: Vec<&'static str> = search.point.effects.iter().map(Effect::name).collect();
    for step in steps.iter().filter_map(|step| step.effect) {
        if present.contains(&step) && !effects.contains(&step) {
            effects.push(step);
        }
    }
    let residuals = search.point.residuals(&search.prepared.record)?;
    let simulated: Vec<Matrix> = residuals
        .iter()
        .zip(search.prepared.record.experiments())
        .map(|(residual, experiment)| &experiment.output - residual)
        .collect();
    let beside = residual::Beside {
        record: &search.prepared.record,
        residuals: &residuals,
        simulated: &simulated,
    };
    let tests = residual::analyse(&beside)?;
    let noise = noise::effects(&search, &residuals, &tests, &given)?;
    let allowed = |effect: &&Effect| search.allowed.iter().any(|e| e.name == effect.name());
    let noise: Vec<Effect> = noise.iter().filter(allowed).cloned().collect();
    effects.extend(noise.iter().map(Effect::name));
    let mut blocks = search.point.blocks();
    blocks.extend(noise);
    Ok(Explanation {
        base: base.to_model(record, &search.prepared.record, &means)?,
        model: search.point.to_model(record, &search.prepared.record, &means)?,
        effects,
        steps,
        rejected,
        before,
        after,
        noise_floor: NoiseFloor::estimate(&search.prepared.record, &residuals),
        residuals,
        blocks,
        tests,
    })
}
