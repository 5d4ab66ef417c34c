//! Backlash in the plays: a bank in which no play of half-width zero has weight.
//!
//! Behind a reversal such a bank does not move until z has crossed the gap `2 r` of its narrowest play. Its inverse is
//! set-valued: while v rests, z may be anywhere in the gap, and when v turns, z jumps across it. The jump does not excite the
//! dynamics, because v does not jump. The inverse bank has no such slope, so a play of half-width zero with a small weight
//! stands in for it: it crosses the gap while v moves by a millionth of the bank's slope. What this changes in v is removed
//! by the next passes, up to what the gap itself leaves.

use crate::operators::{Gpi, GpiState, Operator, PlayBank};
use crate::{Error, Hysteresis, ModelState};
use std::borrow::Cow;

/// Weight of the play that stands in for a jump, as a part of the sum of all weights: far above the rounding of v, which
/// must not move the drive in the gap, and far below what a stage shows.
const EDGE: f64 = 1e-6;

/// Half the gap: the half-width of the narrowest play that has weight, if this is a backlash.
pub(super) fn half_gap(hysteresis: &Hysteresis) -> Option<f64> {
    let plays = hysteresis.plays();
    let all: f64 = plays.weights().iter().sum();
    let pairs = || plays.half_widths().iter().copied().zip(plays.weights().iter().copied());
    let at_zero: f64 = pairs().filter(|(r, _)| *r == 0.0).map(|(_, p)| p).sum();
    let is_gap = all > 0.0 && plays.weights().iter().all(|&p| p >= 0.0) && at_zero < EDGE * all;
    let with_weight = pairs().filter(|&(r, p)| r > 0.0 && p > 0.0).map(|(r, _)| r);
    is_gap.then(|| with_weight.fold(f64::INFINITY, f64::min))
}

/// The hysteresis with a small weight at half-width zero if it is a backlash.
pub(super) fn rising(hysteresis: &Hysteresis) -> Result<Cow<'_, Hysteresis>, Error> {
    if half_gap(hysteresis).is_none() {
        return Ok(Cow::Borrowed(hysteresis));
    }
    let plays = hysteresis.plays();
    let all: f64 = plays.weights().iter().sum();
    let mut half_widths = plays.half_widths().to_vec();
    let mut weights = plays.weights().to_vec();
    half_widths.push(0.0);
    weights.push(EDGE * all);
    Ok(Cow::Owned(Gpi::new(hysteresis.envelope().clone(), PlayBank::new(half_widths, weights)?)))
}

/// The state of one input's [`rising`] hysteresis where the hysteresis itself is in a state.
pub(super) fn continued(
    hysteresis: &Hysteresis,
    state: &ModelState,
    input: usize,
) -> Result<GpiState<f64, Vec<f64>>, Error> {
    let own = &state.hysteresis[input];
    let mut places = own.plays.plays().to_vec();
    if half_gap(hysteresis).is_some() {
        let mut envelope = own.envelope;
        let z = hysteresis.envelope().step(&mut envelope, own.envelope.previous);
        places.push(z);
    }
    let plays = rising(hysteresis)?.plays().state_from(places)?;
    Ok(GpiState { envelope: own.envelope, plays })
}
