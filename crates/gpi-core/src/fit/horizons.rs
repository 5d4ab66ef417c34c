//! The error of predictions over a limited time.
//!
//! Where the output integrates the input, a simulation adds up all small errors of the forces, and its error grows with the
//! length of the record. What a user of such a model asks is how well it predicts the next second. The record is therefore
//! cut into horizons of h samples, one behind the other, and each is simulated from an initial state of its own:
//!
//! 1. *Start.* The state of G and the places of the plays are fitted to the samples before the horizon, a quarter
//!    of its length, which are not scored. Nothing else of the model moves.
//! 2. *Offset and effects.* As in [`on_another_record`](super::another_record::on_another_record).
//! 3. *Score.* All samples of all horizons count, none twice. Samples before the first horizon, in the record's warm-up, or behind
//!    the last whole horizon do not count.

use super::another_record::{OnAnotherRecord, without_functions_of_time};
use super::initial_state::fitted_start;
use super::preparation::Prepared;
use crate::chain::hysteresis::Parameters;
use crate::progress::Progress;
use crate::{Error, Experiment, Model, Record, SimulationError};

/// The samples before a horizon to which its initial state is fitted, over the length of the horizon: long enough for a velocity,
/// short enough that the model has not drifted away within them.
const LEAD: f64 = 0.25;

/// The error of predictions over a horizon in seconds, from the rule of this module's documentation: an initial state that is fitted
/// to the samples before each horizon.
///
/// ```
/// use gpi_core::identify::over_horizons;
/// use gpi_core::linear::TransferFunction;
/// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
/// use gpi_core::{Channel, Experiment, Matrix, Model, Record};
/// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
/// let hysteresis = Gpi::new(envelope, PlayBank::new(vec![0.0], vec![1.0])?);
/// // a mass with friction that is too small in the model
/// let stage = |pole: f64| TransferFunction::new(&[0.0, 0.01], &[1.0, -0.999 - pole, 0.999 * pole])?.to_state_space();
/// let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "mm")]);
/// let model = |pole| Model::new(100.0, u.clone(), y.clone(), vec![hysteresis.clone()], stage(pole)?, vec![0.0]);
/// let input = Matrix::from_fn(3000, 1, |k, _| (0.02 * k as f64).sin() + (0.0071 * k as f64).cos());
/// let output = model(0.9)?.simulate(&input)?;
/// let record = Record::new(vec![Experiment::new(input, output)], 100.0, u.clone(), y.clone(), vec![])?;
/// let close = model(0.902)?;
/// let second = over_horizons(&close, &record, 1.0, &mut |_| true)?;
/// assert!(second.rms < 0.5 * close.error(&record, false)?.rms);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A horizon of less than two samples, or no experiment with a whole horizon and the samples before it;
/// channels or rates that differ, a measured column that an effect needs is not in the record, [`Error::Interrupted`] when
/// `progress` returned false.
pub fn over_horizons(
    model: &Model,
    record: &Record,
    horizon: f64,
    progress: Progress,
) -> Result<SimulationError, Error> {
    let samples = (horizon * record.rate()).round();
    let requirement = "must be at least two samples";
    Error::require(samples >= 2.0 && samples.is_finite(), "horizon", horizon, requirement)?;
    let (length, lead) = (samples as usize, (LEAD * samples).ceil() as usize);
    let pieces: Vec<Experiment> =
        record.experiments().iter().flat_map(|own| pieces(own, length, lead)).collect();
    let requirement =
        "must be so short that an experiment has a whole horizon and a quarter of it before";
    Error::require(!pieces.is_empty(), "horizon", horizon, requirement)?;
    let pieces = record.with_experiments(pieces)?;
    let (model, left_out) = without_functions_of_time(model)?;
    let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
    let prepared = Prepared::in_motion(&pieces, channels)?;
    let residuals = fitted_start(&model, &pieces, &prepared, progress)?;
    let found = OnAnotherRecord { model, left_out, residuals };
    Ok(found.error(&pieces.held_out_part()?, false))
}

/// The horizons of an experiment, each behind its lead and held out.
fn pieces(experiment: &Experiment, length: usize, lead: usize) -> Vec<Experiment> {
    let rows = experiment.input.nrows();
    let starts = (experiment.warmup..).step_by(length);
    let starts = starts.take_while(|start| start + lead + length <= rows);
    let piece = |start: usize| {
        let mut piece = experiment.rows(start..start + lead + length, 0);
        piece.held_out.push(lead..lead + length);
        piece
    };
    starts.map(piece).collect()
}
