//! What an effect adds to the output of a fitted model.
//!
//! All other parameters keep their fitted values: c is not what a new fit without the effect would lose, but what the
//! effect does in this model. The model without the effect is simulated as a whole, because an effect may
//! act anywhere; its initial states are those of the model with it, less the states of the effect's own sections.

use crate::chain::free_run::Signals;
use crate::chain::point::Point;
use crate::{Error, Experiment, Matrix};

/// The output with the effect less that without it, `c = y(theta) - y(theta without the effect)`, and the latter; each
/// (samples, outputs).
pub(super) fn contribution(
    point: &Point,
    without: &Point,
    known: &Signals,
    experiment: &Experiment,
    index: usize,
) -> Result<(Matrix, Matrix), Error> {
    let with = point.output(known, index);
    let rest = without.output(&without.signals(experiment, index)?, index);
    Ok((with - &rest, rest))
}
