//! Simple rivals of the Hammerstein model: what a few lines of least squares predict.
//!
//! A model with hysteresis and dynamics is worth its parameters only where it predicts better than these four:
//!
//! ```text
//! static-polynomial   y(k) = c + sum_i sum_{n=1..N} a_{i,n} u_i(k)^n
//! plays               y(k) = c + sum_i (a_i u_i(k-d) + sum_{j=1..20} p_{i,j} F_{r_{i,j}}[u_i](k-d))
//! fir                 y(k) = c + sum_i sum_{l=0..L-1} h_{i,l} u_i(k-l)
//! arx                 y(k) = c + sum_{l=1..na} a_l y(k-l) + sum_i sum_{l=0..nb} b_{i,l} u_i(k-l)
//! ```
//!
//! u is (samples, inputs); every output has coefficients of its own. The half-widths are `r_j = (j / 21) (span / 2)`, and
//! weights may have any sign. Degree, delay, length, and a ridge are chosen by cross-validation over blocks of the training
//! data: blocks are dealt to folds in turn, so that every fold has a part of every excitation. The orders of `arx` are those
//! with the smallest simulation error on the training data, among the stable ones.
//!
//! One rule gives every error. The offset c of the training data is kept. Before the first sample of an experiment, u has its
//! first value, and each play starts there. `arx` starts from the measured first na outputs and then runs freely, as a
//! model whose initial state was fitted. All coefficients come from scored samples of the training record.
//!
//! The cost is bounded: of a long record, evenly spread samples are used for the sums.

mod arx;
mod fir;
mod plays;
mod polynomial;
pub(crate) mod regression;
mod settings;
mod units;

pub(crate) use plays::Plays;
pub(crate) use settings::RivalPolicy;
pub(crate) use units::Units;

use crate::parallel::install;
use crate::{Error, Matrix, Record, SimulationError};
use rayon::prelude::*;

/// A simple model of the same record.
#[derive(Clone, Debug, PartialEq)]
pub struct Rival {
    /// `static-polynomial`, `plays`, `fir` or `arx`.
    pub name: &'static str,
    /// Root mean square error on the training data, in the output's unit.
    pub train_rms: f64,
    /// Root mean square error on held-out data, in the output's unit; `None` where nothing is held out.
    pub holdout_rms: Option<f64>,
    /// What was chosen, such as `degree 3`.
    pub detail: String,
}

/// The simulated outputs of a record, (samples, outputs), one matrix an experiment.
type Simulate = dyn Fn(&Record) -> Vec<Matrix> + Send;

/// A rival that has been fitted to a record in the units of [`Units`].
struct Model {
    name: &'static str,
    detail: String,
    /// Of a record in the same units.
    simulate: Box<Simulate>,
}

/// A rival with what it leaves of the data.
pub(crate) struct Fitted {
    pub name: &'static str,
    pub detail: String,
    /// Measured minus simulated outputs of the training record, held-out samples included.
    pub residuals: Vec<Matrix>,
    /// The same of another record.
    pub elsewhere: Option<Vec<Matrix>>,
}

impl Fitted {
    /// The residuals that `test` scores.
    pub(crate) fn tested(&self) -> &[Matrix] {
        self.elsewhere.as_ref().unwrap_or(&self.residuals)
    }

    /// The errors on the training record, and on what is held out.
    pub(crate) fn scored(&self, training: &Record, test: Option<&Record>) -> Rival {
        let rms = |record: &Record, residuals: &[Matrix]| {
            SimulationError::of(record, residuals, false).rms
        };
        Rival {
            name: self.name,
            train_rms: rms(training, &self.residuals),
            holdout_rms: test.map(|test| rms(test, self.tested())),
            detail: self.detail.clone(),
        }
    }
}

/// Fits a static polynomial, a bank of plays with a delay, FIR and ARX to the scored samples of a record.
///
/// `training` is (samples, inputs) and (samples, outputs) in each experiment. Errors are scored on `holdout`, or else on the
/// samples that the experiments of `training` hold out; both are in the output's unit. The equations and the rule for offset
/// and start are those of the module's documentation. A rival that the data cannot determine is left out.
///
/// ```
/// use gpi_core::rivals::rivals;
/// use gpi_core::{Channel, Experiment, Matrix, Record};
/// let u = Matrix::from_fn(400, 1, |k, _| (0.1 * k as f64).sin() + (0.037 * k as f64).cos());
/// let run = Experiment { held_out: vec![200..260], ..Experiment::new(u.clone(), u.map(|u| u * u)) };
/// let channel = |name| vec![Channel::new(name, "")];
/// let record = Record::new(vec![run], 100.0, channel("u"), channel("y"), vec![])?;
/// let found = rivals(&record, None)?;
/// assert_eq!(found[0].name, "static-polynomial"); // of degree 2 or more
/// assert!(found[0].holdout_rms.unwrap() < 1e-6);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// `holdout` has other numbers of inputs or outputs.
pub fn rivals(training: &Record, holdout: Option<&Record>) -> Result<Vec<Rival>, Error> {
    let fitted = fit(training, holdout, &RivalPolicy::default())?;
    let is_held_out = training.experiments().iter().any(|e| !e.held_out.is_empty());
    let own = if is_held_out { Some(training.held_out_part()?) } else { None };
    let test = holdout.or(own.as_ref());
    Ok(fitted.iter().map(|rival| rival.scored(training, test)).collect())
}

/// All rivals that the training record determines, with their residuals there and on another record.
pub(crate) fn fit(
    training: &Record,
    holdout: Option<&Record>,
    policy: &RivalPolicy,
) -> Result<Vec<Fitted>, Error> {
    policy.validate()?;
    if let Some(other) = holdout {
        let own = ("training inputs", training.inputs().len());
        Error::require_equal("channels", own, ("held-out inputs", other.inputs().len()))?;
        let own = ("training outputs", training.outputs().len());
        Error::require_equal("channels", own, ("held-out outputs", other.outputs().len()))?;
    }
    let units = Units::of(training);
    let scaled = units.scaled(training)?;
    let elsewhere = holdout.map(|other| units.scaled(other)).transpose()?;
    let kinds = [polynomial::fit, plays::fit, fir::fit, arx::fit];
    let models: Vec<Option<Model>> =
        install(|| kinds.par_iter().map(|fit| fit(&scaled, policy)).collect());
    let finished = |model: Model| Fitted {
        name: model.name,
        residuals: units.residuals(&scaled, &(model.simulate)(&scaled)),
        elsewhere: elsewhere.as_ref().map(|r| units.residuals(r, &(model.simulate)(r))),
        detail: model.detail,
    };
    Ok(models.into_iter().flatten().map(finished).collect())
}

#[cfg(test)]
mod tests;
