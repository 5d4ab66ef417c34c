//! The effect that slow poles of G may stand for, begun at these poles (see [`super::slow_poles`]).

use super::ranking::Ranked;
use super::score::Score;
use super::state::SearchState;
use crate::Error;
use crate::effects::FreeOrder;
use crate::fit::line_modes::is_same;
use nalgebra::Complex;

/// The model before slow poles were taken out, in which an effect of the candidates does what they did: another candidate.
pub(super) fn candidate(state: &SearchState, best: &[Ranked]) -> Result<Option<Ranked>, Error> {
    let hides = |one: &&Ranked| {
        one.entry.free_order == FreeOrder::HidesInSlowPoles && !state.has(one.entry)
    };
    let (Some(before), Some(known)) = (&state.with_lags, best.iter().find(hides)) else {
        return Ok(None);
    };
    let is_slow = |pole: &Complex<f64>| before.lags.iter().any(|lag| is_same(lag, pole));
    let Some(start) = before.point.with_lags_in(known.score.start.clone(), is_slow)? else {
        return Ok(None);
    };
    let gain = 1.0 - state.training_squares(&start)? / state.cost;
    let score = Score { gain, ..known.score.clone() };
    Ok(Some(Ranked { score, start: Some(start), others: Vec::new(), ..*known }))
}
