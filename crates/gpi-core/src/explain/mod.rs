//! Which effects of the catalogue a record's model lacks.
//!
//! 1. The declared model (deadzones, plays, G) is identified on the training data: the record without ten blocks of
//!    time (`blocks`). G gets no poles that would follow creep or a disturbance.
//! 2. Every candidate of the catalogue is ranked by a score test (`score`): the change of the output by the effect,
//!    projected off the model's own sensitivities (`projection`), explains a part of the residual.
//!    Of a record with one input and one output that is far from the noise, the balance of forces of a mass (`force_balance`) proposes forces
//!    inside the mechanics as well, and the models at which their fits begin (`forces`). Where the output stands at a limit, the model of a
//!    sensor that clips is a candidate (`sensor_range`).
//! 3. The best few are fitted jointly with the whole model (`trial`). The one that explains most begins again at its other candidates
//!    if it leaves the model far above the noise (`restart`). It is accepted if it is
//!    significant and the held-out blocks confirm it (`judgement`), and if what it does is its own
//!    (`examination`). Effects that it makes superfluous are dropped (`revision`).
//!    Where none is accepted, two effects that are only confirmed together are tried (`pairs`), and a mass that slides with friction,
//!    perhaps between end stops (`sliding_mass`).
//! 4. Steps 2 and 3 are repeated until no effect is accepted. Then an effect that the input drives replaces a slow
//!    function of time that it explains as well, forces inside the mechanics enter where the input does if that explains nearly as
//!    much (`force_at_input`), and the residual is tested for remaining structure (`residual`).
//! 5. Stops instead of plays were found to fit the record better before any effect was known, and a drift, for example, makes a stage
//!    resemble a bank of stops. If the declared model has stops and the residual still has structure, everything is done once more
//!    beside plays. Their answer is given if it leaves no structure.
//!
//! The files import in one direction only: `policy` (every tolerance), `threshold`, `judgement`, `choice`, `base`, `projection`,
//! `score`, `setup` (what never changes), `state` (where the search stands), `ranking`, `force_balance`, `forces`, `sensor_range`, `slow_candidate`, `trial`,
//! `restart`, `moving`, `examination`, `grid`, `revision`, `round`, `slow_poles`, `pairs`, `sliding_mass`, `force_at_input`, `search`, `outside` (why the structure is wrong), `explanation`.

mod balance_start;
pub(crate) mod base;
mod blocks;
mod choice;
mod coloured;
mod concurrently;
mod examination;
mod exchange;
mod explanation;
mod finish;
mod force_at_input;
mod force_balance;
mod forces;
mod grid;
mod judgement;
mod limits;
mod moved_resonance;
mod moving;
mod noise;
mod outside;
mod pairs;
mod policy;
mod probability;
mod projection;
mod ranking;
mod refusal;
mod repair;
mod residual;
mod restart;
mod revision;
mod round;
mod score;
mod search;
mod sensor_range;
mod setup;
mod sliding_mass;
mod slip;
mod slow_candidate;
mod slow_poles;
mod state;
mod steps;
mod stretches;
mod surpassing;
mod threshold;
mod trial;
mod verdict;

use crate::chain::hysteresis::Elements;
use crate::effects::OutputKind;
use crate::fit::RefineOptions;
use crate::fit::preparation::starts_at_rest;
use crate::identify::long_record::compare;
use crate::identify::procedure::{Compared, prepare};
use crate::identify::{Grid, IdentifyOptions, Progress, Quick, Report};
use crate::progress::{Overall, ProgressSettings};
use crate::spectrum::is_one_sine;
use crate::uncertainty::outliers;
use crate::{Error, Matrix, Record};
use explanation::summarise;
pub use explanation::{Errors, Explanation, Step};
use finish::finish;
pub use moved_resonance::Resonance;
pub use outside::{Signs, signs};
use policy::{GridPolicy, SearchPolicy};
pub use residual::{ResidualOptions, ResidualTest, Significance, residual_tests};
use setup::SearchSetup;
pub use state::Rejected;
use state::SearchState;
use std::cell::OnceCell;
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
/// let found = explain(record, None, &ExplainOptions::default(), &mut |_| true)?;
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
    let steps = ProgressSettings::usual()?;
    let mut overall = Overall::new(progress, steps.light, steps.declared, steps.declaring);
    let (mut found, of_plays) = explain_once(record, holdout, options, &mut overall)?;
    let is_open = !found.interrupted && found.verdict != Verdict::Explained;
    // stops were compared with plays before any effect was known
    if is_open && of_plays.is_some_and(|part| part > GridPolicy::default().of_plays) {
        let identify =
            IdentifyOptions { elements: Some(Elements::Plays), ..options.identify.clone() };
        let options = ExplainOptions { identify, ..options.clone() };
        match explain_once(record, holdout, &options, &mut overall) {
            Ok((other, _)) if other.verdict == Verdict::Explained => found = other,
            Ok((other, _)) => found.interrupted = other.interrupted,
            Err(Error::Interrupted) => found.interrupted = true,
            // the structure of stops stands
            Err(_) => {}
        }
    }
    if !found.interrupted {
        overall.finish();
    }
    Ok(found)
}

/// One search, beside the declared model that `options` ask for, and the part of the squares of plays that the model leaves where it has
/// stops although plays were compared.
fn explain_once(
    record: &Record,
    holdout: Option<&Record>,
    options: &ExplainOptions,
    overall: &mut Overall,
) -> Result<(Explanation, Option<f64>), Error> {
    let policy = SearchPolicy::default();
    policy.validate()?;
    let steps = ProgressSettings::usual()?;
    let allowed = setup::allowed("effects", options.effects.as_deref())?;
    let required = setup::allowed("require", Some(&options.require))?;
    record.require_moving()?;
    let training = blocks::hold_out(record, &policy.holdout)?;
    let identify = usual_grids(&options.identify, &training, &policy.grid);
    let fewer = [&options.identify.half_widths, &options.identify.thresholds].map(Option::is_none);
    let quick = Quick { fewer };
    // spikes of the output itself
    let outputs: Vec<Matrix> = training.experiments().iter().map(|e| e.output.clone()).collect();
    let spikes = outliers::places(&outputs, &repair::everything(&training)?, 0);
    let training = repair::repaired(&training, &outputs, &spikes)?;
    let mut prepared = prepare(&training, &identify)?;
    let measured = as_measured(&prepared.record, record, &prepared.means)?;
    let mut progress = |report: &Report| overall.take(report);
    let Compared { mut refined, of_plays, .. } =
        compare(&mut prepared, &identify, Some(quick), &mut progress)?;
    refined.drop_undetermined(&prepared, &mut progress)?;
    let clipping = sensor_range::clipping(
        &training,
        &prepared.means,
        (&identify, quick),
        &policy.outside,
        &mut progress,
    )?;
    let order_is_given = identify.order.is_some() || identify.delay.is_some();
    // none at all is a grid too
    let given = |grid: &Option<Grid>| matches!(grid, Some(Grid::Values(_) | Grid::Count(0)));
    // a bank of stops that has no deadzones gets none later
    let is_held = quick.fewer[1] && refined.fitted.point.output_kind() == OutputKind::Force;
    let moving = RefineOptions {
        thresholds: !(is_held || given(&identify.thresholds)),
        half_widths: !given(&identify.half_widths),
        ..RefineOptions::default()
    };
    let weights = &refined.options.loss.scales;
    let setup =
        SearchSetup::new(&prepared, weights, measured, allowed, order_is_given, moving, policy)?;
    let setup = SearchSetup { clipping, ..setup };
    let weighed = vec![OnceCell::new(); setup.policy.noise.rounds];
    let mut state = SearchState::new(&setup, prepared, &refined);
    state.repair()?;
    overall.part(steps.searched, steps.search);
    let mut progress = |report: &Report| overall.take(report);
    revision::shed_lines(&mut state, &mut progress)?;
    let base = state.point.clone();
    let mut interrupted = is_interrupted(search::run(&mut state, &mut progress))?;
    if !interrupted {
        interrupted =
            is_interrupted(coloured::search_weighed(&mut state, &weighed, &mut progress))?;
    }
    for &entry in &required {
        if !interrupted {
            let forced = search::force(&mut state, entry, &mut progress);
            interrupted = is_interrupted(forced)?;
        }
    }
    let mut patient = |_: &Report| true;
    overall.part(1.0, steps.last * steps.light);
    let mut progress = |report: &Report| overall.take(report);
    let last: Progress = if interrupted { &mut patient } else { &mut progress };
    let refinement = finish(&mut state, &required, interrupted, last)?;
    // rules out that something in front of G is the only cause
    let has_loops = state.point.loops().next().is_some();
    let moved_resonance = if has_loops && !interrupted {
        let policy = &setup.policy.resonance;
        moved_resonance::moved_resonance(&base, &state.prepared, &setup.options, policy, last)?
    } else {
        None
    };
    let found = summarise(record, holdout, &base, state, refinement, interrupted)?;
    let estimates = found.refinement.estimates(&found.model)?;
    let model = found.model.clone().with_estimates(estimates);
    Ok((Explanation { moved_resonance, model, ..found }, of_plays))
}

/// The record with blocks of its time held out, as [`explain`] does it: ten blocks of each experiment, a fifth of its time.
///
/// ```
/// use gpi_core::{Channel, Experiment, Matrix, Record, explain::hold_out};
/// let u = Matrix::from_fn(1000, 1, |k, _| (0.1 * k as f64).sin());
/// let channel = || vec![Channel::new("u", "")];
/// let run = Experiment::new(u.clone(), u);
/// let record = hold_out(&Record::new(vec![run], 1.0, channel(), channel(), vec![])?)?;
/// assert_eq!(record.experiments()[0].held_out.len(), 10);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// As for [`Record::new`].
pub fn hold_out(record: &Record) -> Result<Record, Error> {
    blocks::hold_out(record, &policy::HoldoutPolicy::default())
}

/// Whether a search ended because it was to stop: what it has found so far stands.
fn is_interrupted(result: Result<(), Error>) -> Result<bool, Error> {
    match result {
        Err(Error::Interrupted) => Ok(true),
        other => other.map(|()| false),
    }
}

/// Grids that are rich enough for a base model and cheap enough for a search.
fn usual_grids(
    options: &IdentifyOptions,
    training: &Record,
    policy: &GridPolicy,
) -> IdentifyOptions {
    let robust = Some(false);
    if is_one_sine(training) {
        // One cycle cannot tell many plays apart: as few as it asks for.
        return IdentifyOptions { robust, ..options.clone() };
    }
    let in_motion = |e: &crate::Experiment| e.warmup == 0 && !starts_at_rest(e);
    let is_in_motion = training.experiments().iter().any(in_motion);
    let plays = if is_in_motion { policy.half_widths_in_motion } else { policy.half_widths };
    IdentifyOptions {
        half_widths: Some(options.half_widths.clone().unwrap_or(Grid::Count(plays))),
        thresholds: Some(options.thresholds.clone().unwrap_or(Grid::Count(policy.thresholds))),
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
