//! Fits of an effect that begin again at other candidates.
//!
//! The score test promises most for one candidate of each effect, and a trial begins there. Where the effect has a law of its own (the
//! exponent of a rate dependence, the time constants of creep), the fit may end in a minimum of another law, far above the noise. The
//! effect that is about to be taken is then fitted again from its other candidates that promise nearly as much.

use super::state::{SearchState, Trial};
use super::trial::{fitted, own, start};
use crate::Error;
use crate::progress::{Progress, as_trial};

/// The best of the fits of a trial's effect that begin at its other candidates, where it is better than the trial. They are asked for as
/// long as the model stays far above the noise.
pub(super) fn from_others(
    state: &SearchState,
    trial: &Trial,
    progress: Progress,
) -> Result<Option<Trial>, Error> {
    let enough = state.setup.policy.judgement.near_noise * state.noise_squares()?;
    let (entry, mut best) = (trial.entry, None::<Trial>);
    for (number, score) in trial.others.iter().enumerate() {
        let goal = best.as_ref().map_or(trial.cost, |best| best.cost);
        if goal <= enough || state.setup.is_long(&state.point) {
            break;
        }
        let (gain, place) = (score.gain, (number, trial.others.len()));
        let next = as_trial(progress, ("trials", entry.name), place, |progress| {
            let start = start(state, &state.point, score.clone())?;
            let (fitted, options) = fitted(state, start, entry, goal, progress)?;
            let is_better = fitted.linearization.cost < goal;
            is_better.then(|| own(state, entry, fitted, options, gain, progress)).transpose()
        });
        // the failure of one does not concern the others, and one that diverges on what is held out predicts nothing
        let next = Error::unless_interrupted(next)?.ok().flatten();
        let predicts = |next: &Trial| next.held_out.iter().all(|squares| squares.is_finite());
        best = next.filter(predicts).or(best);
    }
    Ok(best)
}
