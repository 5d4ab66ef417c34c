//! The result of a search, as the user sees it.

use super::moved_resonance::Resonance;
use super::noise;
use super::outside::{Situation, outside};
use super::residual::{self, ResidualTest};
use super::slip;
use super::state::{Addition, Rejected, SearchState};
use super::steps;
use super::verdict::{self, NextExperiment, Verdict};
use crate::chain::point::Point;
use crate::effects::Effect;
use crate::identify::on_another_record;
use crate::identify::{Parameter, Refinement};
use crate::rivals::{self, Fitted, Rival, RivalPolicy};
use crate::{Error, Matrix, Model, Record, SimulationError};
use std::ops::Range;

/// One step: the declared model, or an effect that was added to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The effect; `None` for the declared model.
    pub effect: Option<&'static str>,
    /// The effect's parameters after the last refinement: names, values and standard deviations.
    pub parameters: Vec<Parameter>,
    /// The unit of each parameter, empty for a pure number.
    pub units: Vec<String>,
    /// The part of the residual's squares that the score test promised, 0 to 1.
    pub promised: f64,
    /// Twice the rise of the log-likelihood: `N ln(squares before / squares after)`.
    pub deviance: f64,
    /// The significance threshold of the deviance, for as many parameters and the residual's autocorrelation.
    pub chance: f64,
    /// Effects that this one made superfluous.
    pub dropped: Vec<&'static str>,
    /// How probable it is, by the held-out blocks, that it predicts better than the other effects of its round that would also
    /// be accepted; `None` where there are none.
    pub probability: Option<f64>,
    /// These other effects, with their probabilities.
    pub alternatives: Vec<(&'static str, f64)>,
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
    /// The model as each step found it. The last refinement changes all of it.
    pub models: Vec<Model>,
    /// Effects that were tried and not taken.
    pub rejected: Vec<Rejected>,
    /// Errors of the declared model.
    pub before: Errors,
    /// Errors with all effects; isolated wrong samples that were found are not scored.
    pub after: Errors,
    /// Tests of the residual.
    pub tests: Vec<ResidualTest>,
    /// A resonance whose frequency depends on the outputs' amplitude, at the smallest and at the largest amplitude.
    /// Where loops were closed around G, it rules out that something in front of G is the only cause.
    pub moved_resonance: Option<[Resonance; 2]>,
    /// Simple models, scored on the same data as `after`.
    pub rivals: Vec<Rival>,
    /// How far the record is explained.
    pub verdict: Verdict,
    /// Why the declared structure is wrong, as clauses; none unless the verdict is [`Verdict::OutsideClass`].
    pub reasons: Vec<String>,
    /// What else the user should know of the record, in sentences.
    pub notes: Vec<String>,
    /// What to measure next, where that would show more.
    pub next_experiment: Option<NextExperiment>,
    /// Isolated wrong samples, which are not scored: rows of each output, in each experiment.
    pub wrong_samples: Vec<Vec<Vec<usize>>>,
    /// Samples at the start of each experiment that the fit could not use.
    pub warmups: Vec<usize>,
    /// Measured minus simulated outputs of the declared model, (samples, outputs), one an experiment.
    pub residuals_before: Vec<Matrix>,
    /// The same with all effects.
    pub residuals_after: Vec<Matrix>,
    /// Samples of each experiment that were held out.
    pub held_out: Vec<Vec<Range<usize>>>,
    /// Whether the search was stopped before it had finished.
    pub interrupted: bool,
}

/// Collects what was found.
pub(super) fn summarise(
    record: &Record,
    holdout: Option<&Record>,
    base: &Point,
    state: SearchState,
    refinement: Refinement,
    interrupted: bool,
) -> Result<Explanation, Error> {
    let (mended, measured) = (&state.prepared.record, &state.setup.measured);
    let means = &state.prepared.means;
    let (residuals_before, residuals_after) =
        (base.residuals(measured)?, state.point.residuals(mended)?);
    let base = base.to_model(record, mended, means)?;
    let mut model = state.point.to_model(record, mended, means)?;
    let test = holdout.unwrap_or(&state.setup.test);
    let tested = |model: &Model, residuals: &[Matrix]| match holdout {
        Some(other) => {
            on_another_record(model, other, true, &mut |_| true).map(|found| found.residuals)
        }
        None => Ok(residuals.to_vec()),
    };
    let errors = |record: &Record, residuals: &[Matrix], tested: &[Matrix]| Errors {
        train: SimulationError::of(record, residuals, false),
        holdout: SimulationError::of(test, tested, false),
    };
    let before = errors(measured, &residuals_before, &tested(&base, &residuals_before)?);
    let tested_after = tested(&model, &residuals_after)?;
    let after = errors(mended, &residuals_after, &tested_after);
    let tests = residual::tests_of(&model, mended, &residuals_after)?;
    let noise: Vec<Effect> =
        noise::effects(&state, &residuals_after, &tests, &refinement.noise_floor)
            .into_iter()
            .filter(|effect| state.setup.allowed.iter().any(|entry| entry.name == effect.name()))
            .collect();
    let mut steps = vec![declared(&before)];
    steps.extend(state.additions.iter().map(added));
    steps.extend(noise.iter().map(|effect| of_noise(effect, &after)));
    describe(&mut steps, &state.point, &refinement, &noise, &model)?;
    let found = |one: &Addition| one.trial.point.to_model(record, mended, means);
    let mut models = vec![base.clone()];
    models.extend(state.additions.iter().map(found).collect::<Result<Vec<_>, _>>()?);
    let mut effects: Vec<&'static str> = Vec::new();
    for name in steps.iter().filter(|s| !s.parameters.is_empty()).filter_map(|s| s.effect) {
        if !effects.contains(&name) {
            effects.push(name);
        }
    }
    let mut all = model.effects().to_vec();
    all.extend(noise);
    model = model.with_effects(all)?;
    models.resize(steps.len(), model.clone());
    let mut rejected = state.refused.clone();
    rejected.extend(state.last.iter().cloned());
    rejected.extend(state.additions.iter().flat_map(|one| one.others.iter().cloned()));
    rejected.retain(|one| !effects.contains(&one.effect));
    let fitted = fit_rivals(mended, holdout, means)?;
    let is_structured = verdict::structured(&effects, &tests);
    let situation = Situation {
        record: mended,
        residuals: &residuals_after,
        over_noise: over_noise(&after, &refinement),
        is_structured,
        test: (test, &tested_after),
        rivals: &fitted,
    };
    let mut answer = outside(&situation, &state.setup.policy.outside)?;
    answer.notes.extend(steps::in_words(&state.point));
    answer.notes.extend(slip::in_words(&state.point, record));
    let verdict = verdict::verdict(is_structured, !answer.reasons.is_empty(), !effects.is_empty());
    let policy = &state.setup.policy.proposal;
    let next = verdict::next_experiment(&rejected, &effects, &tests, verdict, record, policy);
    Ok(Explanation {
        next_experiment: next,
        rivals: fitted.iter().map(|rival| rival.scored(mended, Some(test))).collect(),
        reasons: answer.reasons,
        notes: answer.notes,
        held_out: mended.experiments().iter().map(|e| e.held_out.clone()).collect(),
        wrong_samples: state.wrong.clone(),
        warmups: mended.experiments().iter().map(|e| e.warmup).collect(),
        base,
        model,
        refinement,
        effects,
        steps,
        models,
        rejected,
        before,
        after,
        tests,
        moved_resonance: None,
        verdict,
        residuals_before,
        residuals_after,
        interrupted,
    })
}

/// The rivals of the model, fitted to a record whose outputs have lost their `means`.
fn fit_rivals(
    mended: &Record,
    holdout: Option<&Record>,
    means: &[f64],
) -> Result<Vec<Fitted>, Error> {
    let shifted = holdout.map(|other| {
        let mut experiments = other.experiments().to_vec();
        for experiment in &mut experiments {
            for (mut column, mean) in experiment.output.column_iter_mut().zip(means) {
                column.add_scalar_mut(-mean);
            }
        }
        other.with_experiments(experiments)
    });
    rivals::fit(mended, shifted.transpose()?.as_ref(), &RivalPolicy::default())
}

/// The residual of the training data over the noise floor, all outputs together.
fn over_noise(after: &Errors, refinement: &Refinement) -> f64 {
    let floor = &refinement.noise_floor.rms;
    let mean = floor.iter().map(|rms| rms * rms).sum::<f64>() / floor.len() as f64;
    after.train.rms / mean.sqrt().max(f64::MIN_POSITIVE)
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
        probability: None,
        alternatives: Vec::new(),
        train_rms: before.train.rms,
        holdout_rms: before.holdout.rms,
    }
}

fn added(addition: &Addition) -> Step {
    let trial = &addition.trial;
    Step {
        effect: Some(trial.entry.name),
        parameters: Vec::new(),
        units: Vec::new(),
        promised: trial.promised,
        deviance: trial.deviance,
        chance: trial.threshold,
        dropped: addition.dropped.clone(),
        probability: addition.probability,
        alternatives: addition.others.iter().filter_map(probable).collect(),
        train_rms: trial.rms[0],
        holdout_rms: trial.rms[1],
    }
}

/// The name and the probability of another effect that would be accepted.
fn probable(other: &Rejected) -> Option<(&'static str, f64)> {
    other.probability.map(|probability| (other.effect, probability))
}

fn of_noise(effect: &Effect, after: &Errors) -> Step {
    Step {
        effect: Some(effect.name()),
        train_rms: after.train.rms,
        holdout_rms: after.holdout.rms,
        ..declared(after)
    }
}

/// Fills in the effects' parameters.
fn describe(
    steps: &mut [Step],
    point: &Point,
    refinement: &Refinement,
    noise: &[Effect],
    model: &Model,
) -> Result<(), Error> {
    let blocks = point.blocks();
    let deviations = refinement.bands.effect_deviations()?;
    let certain = noise.iter().map(|effect| (effect.clone(), Vec::new()));
    let mut all: Vec<(Effect, Vec<f64>)> =
        blocks.into_iter().zip(deviations).chain(certain).collect();
    for step in steps {
        let Some(place) = all.iter().position(|(e, _)| Some(e.name()) == step.effect) else {
            continue;
        };
        let (effect, deviations) = all.remove(place);
        for (i, quantity) in model.quantities(&effect).into_iter().enumerate() {
            step.units.push(quantity.unit.clone());
            step.parameters.push(Parameter {
                name: quantity.name,
                value: quantity.value,
                deviation: deviations.get(i).copied().unwrap_or(0.0),
                unit: quantity.unit,
                zero_is_absence: quantity.zero_is_absence,
            });
        }
    }
    Ok(())
}
