//! The initial state of a record, fitted with the model kept.

use crate::Progress;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::DynamicsFreedom;
use crate::fit::joint::fit_options;
use crate::fit::minimize::{Fitted, fit};
use crate::fit::preparation::{Prepared, require_match};
use crate::fit::refinement::RefineOptions;
use crate::{Error, Matrix, Model, Record};

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
    let mut options = fit_options(prepared, &RefineOptions::default(), own.steps);
    options.freedom.weights = false;
    options.freedom.offsets = false;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Nothing;
    let mut best: Option<Fitted> = None;
    for side in own.places {
        let mut placed = point.clone();
        placed
            .pasts
            .iter_mut()
            .filter_map(|past| past.plays.as_mut())
            .flatten()
            .for_each(|plays| plays.fill(side));
        let fitted = fit(placed, &prepared.record, &options, "start", progress)?;
        let cost = fitted.linearization.cost;
        if best.as_ref().is_none_or(|best| cost < best.linearization.cost) {
            best = Some(fitted);
        }
    }
    let fitted = best.map_or(point, |best| best.point);
    let with_start = fitted.residuals(&prepared.record)?;
    // what is known needs no fit
    let as_it_is = model.residuals(record)?;
    let choose = |(index, (fitted, known))| {
        if prepared.has_unknown_state[index] { fitted } else { known }
    };
    Ok(with_start.into_iter().zip(as_it_is).enumerate().map(choose).collect())
}
