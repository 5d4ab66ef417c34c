//! The last fit of a search, with everything free.

use super::policy::FitPolicy;
use super::search::drop_impossible;
use super::state::SearchState;
use super::stretches::in_stretches;
use crate::Error;
use crate::effects::Entry;
use crate::fit::RefineOptions;
use crate::fit::joint::{Refined, fit_options};
use crate::fit::minimize::{FitOptions, Fitted};
use crate::identify::{Progress, Refinement};

/// Refines everything once more, a stage that integrates forces in stretches, grids that were not given included, and estimates the parameters' uncertainty. An effect that this fit
/// makes impossible was none, unless it is required: the rest is then refined without it.
pub(super) fn finish(
    state: &mut SearchState,
    required: &[&'static Entry],
    interrupted: bool,
    progress: Progress,
) -> Result<Refinement, Error> {
    let (fitted, options) = loop {
        let own = if interrupted { None } else { in_stretches(state, progress)? };
        let (fitted, options) = match own {
            Some(own) => own,
            None => refined(state, interrupted, progress)?,
        };
        state.point = fitted.point.clone();
        if interrupted || !drop_impossible(state, required, progress)? {
            break (fitted, options);
        }
    };
    state.repair()?;
    let refined = Refined { fitted, options, outliers: 0, robust: false };
    let refinement = refined.finish(&state.prepared, progress)?;
    state.point = refinement.bands.point.clone();
    Ok(refinement)
}

/// The model of a state with everything fitted together, and how; with a single step where the search was interrupted.
pub(super) fn refined(
    state: &SearchState,
    interrupted: bool,
    progress: Progress,
) -> Result<(Fitted, FitOptions), Error> {
    let setup = state.setup;
    let FitPolicy { last_free_steps, last_held_steps, coarser, .. } = setup.policy.fits;
    let stage = |options: &RefineOptions, steps: usize| {
        let mut own = fit_options(&state.prepared, options, steps);
        own.loss.clone_from(&setup.options.loss);
        own
    };
    let mut options = stage(&setup.moving, if interrupted { 1 } else { last_free_steps });
    options.gain *= coarser;
    let mut fitted = state.fit(state.point.clone(), &options, "refinement", progress)?;
    if !interrupted && (setup.moving.thresholds || setup.moving.half_widths) {
        // with everything free at once, the kinks at which plays turn end the fit before the rest has settled
        let held = stage(&RefineOptions::default(), last_held_steps);
        let before = fitted.history;
        let settled = state.fit(fitted.point, &held, "refinement", progress)?.after(&before);
        let again = state.fit(settled.point, &options, "refinement", progress)?;
        fitted = again.after(&settled.history);
    }
    Ok((fitted, options))
}
