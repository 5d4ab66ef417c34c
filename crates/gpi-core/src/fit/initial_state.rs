//! The initial state of a record, fitted with the model kept.

use crate::Progress;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::joint::fit_options;
use crate::fit::minimize::{FitOptions, fit};
use crate::fit::preparation::{Prepared, require_match};
use crate::fit::refinement::RefineOptions;
use crate::{Error, Matrix, Model, Record};

/// A point with the offsets and initial states that fit best, all else held. `options` says how fits of it proceed otherwise.
pub(crate) fn settled(
    point: Point,
    record: &Record,
    options: &FitOptions,
    phase: &str,
    progress: Progress,
) -> Result<Point, Error> {
    Ok(fit(point, record, &held(options.clone()), phase, progress)?.point)
}

/// A point of a model with forces inside the mechanics, with the offsets and states of G that fit best; any other point as it is: a fit of
/// the rest finds its start, and plays that are placed before the rest is known may stay at a wrong place.
pub(super) fn settled_anew(
    point: Point,
    prepared: &Prepared,
    progress: Progress,
) -> Result<Point, Error> {
    let steps = prepared.settings.initial_state.steps;
    let mut options = held(fit_options(prepared, &RefineOptions::default(), steps));
    options.freedom.derivatives.starts = false;
    match placed_without_forces(&point, &prepared.record, &options, progress)? {
        Some(other) => best_of(point, Some(other), &prepared.record, &options, progress),
        None => Ok(point),
    }
}

/// Everything held but offsets and initial states.
fn held(mut options: FitOptions) -> FitOptions {
    options.freedom.weights = false;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Nothing;
    options
}

/// A point with the initial states that fit best without the forces inside the mechanics, where there are any. From equilibrium, in which a
/// stage that integrates is far away, friction does not let a fit find the way to the measured position.
fn placed_without_forces(
    point: &Point,
    record: &Record,
    options: &FitOptions,
    progress: Progress,
) -> Result<Option<Point>, Error> {
    let mut free = point.clone();
    free.effects.retain(|effect| effect.place().closed_loops().is_none());
    if free.effects.len() == point.effects.len() || !options.freedom.states {
        return Ok(None);
    }
    let Point { pasts, offsets, .. } = fit(free, record, options, START, progress)?.point;
    Ok(Some(Point { pasts, offsets, ..point.clone() }))
}

/// The best of the fits that begin at some points.
fn best_of(
    first: Point,
    others: impl IntoIterator<Item = Point>,
    record: &Record,
    options: &FitOptions,
    progress: Progress,
) -> Result<Point, Error> {
    let mut best = fit(first, record, options, START, progress)?;
    for other in others {
        let fitted = fit(other, record, options, START, progress)?;
        if fitted.linearization.cost < best.linearization.cost {
            best = fitted;
        }
    }
    Ok(best.point)
}

/// What the progress calls these fits.
const START: &str = "start";

/// Measured minus simulated outputs of each experiment, (samples, outputs), where an
/// unknown initial state is fitted to the record and the model is kept.
///
/// Only the initial state is estimated: the place of every play between z(0) - r and z(0) + r, and the state of G. An
/// experiment that begins at rest is simulated as it is. A warm-up is not scored, but drives the model from the state that
/// fits the samples behind it best. MATLAB's `compare` estimates the initial state in the same way.
///
/// # Errors
/// Channels or rates that differ, [`Error::Interrupted`] when `progress` returned false.
pub fn residuals_from_fitted_start(
    model: &Model,
    record: &Record,
    progress: Progress,
) -> Result<Vec<Matrix>, Error> {
    let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
    let prepared = Prepared::scoring_all(record, channels)?;
    fitted_start(model, record, &prepared, progress)
}

/// The same for a record that is prepared.
pub(super) fn fitted_start(
    model: &Model,
    record: &Record,
    prepared: &Prepared,
    progress: Progress,
) -> Result<Vec<Matrix>, Error> {
    require_match(model, record)?;
    model.require_covariates_of(record)?;
    let mut point = prepared.point_of(model)?;
    for offsets in &mut point.offsets {
        for (output, mut column) in offsets.column_iter_mut().enumerate() {
            column.fill(model.offsets()[output] - prepared.means[output]);
        }
    }
    let own = &prepared.settings.initial_state;
    let mut options = held(fit_options(prepared, &RefineOptions::default(), own.steps));
    options.freedom.offsets = false;
    let at = |side: f64| {
        let mut placed = point.clone();
        let plays = placed.pasts.iter_mut().filter_map(|past| past.plays.as_mut()).flatten();
        plays.for_each(|plays| plays.fill(side));
        placed
    };
    let [first, others @ ..] = own.places.map(at);
    let others = others.into_iter().chain(placed_without_forces(
        &point,
        &prepared.record,
        &options,
        progress,
    )?);
    let fitted = best_of(first, others, &prepared.record, &options, progress)?;
    let with_start = fitted.residuals(&prepared.record)?;
    // what is known needs no fit
    let as_it_is = model.residuals(record)?;
    let choose = |(index, (fitted, known))| {
        if prepared.has_unknown_state[index] { fitted } else { known }
    };
    Ok(with_start.into_iter().zip(as_it_is).enumerate().map(choose).collect())
}
