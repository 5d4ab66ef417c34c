//! What an effect adds to the output of a fitted model.

use crate::chain::free_run::Signals;
use crate::chain::point::Point;
use crate::effects::Stage;
use crate::{Error, Experiment, Matrix};

/// The output with the effect less that without it, (samples, outputs): `c = y(theta) - y(theta without the effect)`.
pub(super) fn contribution(
    point: &Point,
    without: &Point,
    known: &Signals,
    experiment: &Experiment,
    index: usize,
) -> Result<Matrix, Error> {
    let with = point.output_from(Stage::Added, known, experiment, index)?;
    Ok(with - without.output_from(Stage::Input, known, experiment, index)?)
}
