//! The error on a record that took no part in the fit: one rule for all commands, files and reports.
//!
//! 1. *Start.* What happened before the record is unknown. Where its inputs are not zero at first, the place of every
//!    play between z(0) - r and z(0) + r and the state of G are fitted to the record; nothing else of the model moves.
//!    An experiment that begins at rest is simulated from rest.
//! 2. *Offset.* The model's own, that of its training record, is kept. A sensor whose zero has moved since counts as
//!    error.
//! 3. *Warm-up.* The samples behind the record's declared warm-up count, all others only drive the model.
//! 4. *Effects.* An effect that neither the input nor a measured column drives (drift, disturbances, a changing gain) is a
//!    function of the time of the record that it was fitted to. It says nothing of another record and is left out. The lag of a
//!    measured column begins at the column's first value.
//!
//! MATLAB's `compare` estimates the initial state in the same way.

use super::initial_state::residuals_from_fitted_start;
use crate::effects::Effect;
use crate::progress::Progress;
use crate::{Error, Matrix, Model, Record, SimulationError};

/// What a model leaves of a record that took no part in its fit.
#[derive(Clone, Debug, PartialEq)]
pub struct OnAnotherRecord {
    /// The model without the effects that are functions of the time of their own record.
    pub model: Model,
    /// Names of these effects.
    pub left_out: Vec<&'static str>,
    /// Measured minus simulated outputs of each experiment, (samples, outputs), warm-ups included.
    pub residuals: Vec<Matrix>,
}

/// What a model leaves of a record that took no part in its fit, by the rule of this module's documentation: the unknown
/// initial state is fitted, the offset of the model is kept, effects that are functions of time are left out.
///
/// Without `fit_start`, every experiment is simulated from the steady state at its first input instead.
///
/// ```
/// use gpi_core::identify::on_another_record;
/// use gpi_core::linear::TransferFunction;
/// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
/// use gpi_core::{Channel, Experiment, Matrix, Model, Record};
/// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
/// let hysteresis = Gpi::new(envelope, PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.5])?);
/// let linear = TransferFunction::new(&[0.3], &[1.0, -0.7])?.to_state_space()?;
/// let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
/// let model = Model::new(1e3, u.clone(), y.clone(), vec![hysteresis], linear, vec![0.0])?;
/// // a record that begins in motion: the past of its plays and of G is not in it
/// let input = Matrix::from_fn(3000, 1, |k, _| 2.0 * (0.02 * k as f64).sin());
/// let output = model.simulate(&input)?;
/// let later = |signal: &Matrix| signal.rows(1000, 2000).into_owned();
/// let record = Record::new(vec![Experiment::new(later(&input), later(&output))], 1e3, u, y, vec![])?;
/// let found = on_another_record(&model, &record, true, &mut |_| true)?;
/// assert!(found.error(&record, false).rms < 1e-3 * model.error(&record, false)?.rms);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// Channels or rates that differ, a measured column that an effect needs is not in the record, [`Error::Interrupted`]
/// when `progress` returned false.
pub fn on_another_record(
    model: &Model,
    record: &Record,
    fit_start: bool,
    progress: Progress,
) -> Result<OnAnotherRecord, Error> {
    let (model, left_out) = without_functions_of_time(model)?;
    let residuals = if fit_start {
        residuals_from_fitted_start(&model, record, progress)?
    } else {
        model.residuals(record)?
    };
    Ok(OnAnotherRecord { model, left_out, residuals })
}

/// The model without the effects that are functions of the time of their own record, and the names of these.
pub(super) fn without_functions_of_time(
    model: &Model,
) -> Result<(Model, Vec<&'static str>), Error> {
    let kept = model.effects().iter().filter(|effect| effect.entry().driven);
    let kept = kept.map(Effect::without_start).collect();
    Ok((model.clone().with_effects(kept)?, functions_of_time(model)))
}

/// Names of the effects of a model that are functions of the time of the record that it was fitted to, each once.
pub fn functions_of_time(model: &Model) -> Vec<&'static str> {
    let mut names = Vec::new();
    for effect in model.effects() {
        // what only describes the residual is no part of a simulation
        if !effect.entry().driven && effect.block().is_some() && !names.contains(&effect.name()) {
            names.push(effect.name());
        }
    }
    names
}

impl OnAnotherRecord {
    /// The simulation error over the scored samples of the record; `remove_mean` as in [`Model::error`].
    pub fn error(&self, record: &Record, remove_mean: bool) -> SimulationError {
        SimulationError::of(record, &self.residuals, remove_mean)
    }
}
