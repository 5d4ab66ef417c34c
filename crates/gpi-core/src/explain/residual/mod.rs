//! Named tests of a residual, each with the effects that it points to.
//!
//! The significance level of every test is at most one hundredth over the number of tests (Bonferroni's correction), so
//! that at most one record of pure noise in a hundred fails any of them. A test with a p-value fails exactly where the
//! p-value is below its level. A test whose threshold is one of practical size has no p-value.
//!
//! | test | statistic | if the residual e is noise |
//! |---|---|---|
//! | `mean` | t of blocks of e | normal ([`independence`]) |
//! | `whiteness` | Ljung and Box's Q | chi-square; white noise only ([`whiteness`]) |
//! | `lines` | periodogram of whitened e over its local median | order statistics of exponential numbers ([`lines`]) |
//! | `past-input` to `trend` | largest t of blocks of e times a function of u, v, y or t | normal ([`independence`], [`families`]) |
//! | `prediction` | part of the whitened variance that u predicts, cross-validated | at most about zero ([`prediction`]) |
//! | `level-to-level` | largest t of slopes that differ between amplitudes | normal ([`level_to_level`]) |
//! | `higher-order` | as `level` to `trend`, of e^2 without its mean | normal ([`independence`]) |
//! | `outliers` | number of isolated samples | Poisson ([`wrong_samples`]) |
//!
//! All tests but `whiteness` hold for autocorrelated noise. The residual is taken without its mean except for `mean`.
//! Values that are no larger than what rounding leaves of the simulation are set to zero, so that an exact model
//! passes.

mod compared;
mod families;
mod independence;
mod level_to_level;
mod lines;
mod mean;
mod outcome;
mod policy;
mod prediction;
pub(super) mod significance;
#[cfg(test)]
mod simulated;
mod whiteness;
mod wrong_samples;

use super::outside::within_limits;
use super::policy::OutsidePolicy;
use crate::fit::preparation::require_match;
use crate::identify::{Progress, residuals_from_fitted_start};
use crate::{Error, Matrix, Model, Record};
use compared::Compared;
use families::{Family, ScaledSignals};
use outcome::{NAMES, points_to};
pub(super) use outcome::{PREDICTION, STRUCTURE, WHITENESS};
pub use outcome::{ResidualTest, Significance};
use policy::ResidualPolicy;

/// How the residual of a model is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResidualOptions {
    /// Fit the unknown initial state, see [`residuals_from_fitted_start`].
    pub fit_start: bool,
    /// Take the mean of each experiment's residual out, for sensors whose offset moves between them.
    pub remove_mean: bool,
}

/// Tests what a model leaves of a record: measured output minus the simulation from the input alone, with
/// the model's effects and the record's covariates.
///
/// The model may come from anywhere; it is simulated from rest, or from a start that is fitted.
///
/// ```
/// use gpi_core::explain::{ResidualOptions, residual_tests};
/// use gpi_core::linear::TransferFunction;
/// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
/// use gpi_core::{Channel, Experiment, Matrix, Model, Record};
/// # fn main() -> Result<(), gpi_core::Error> {
/// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
/// let hysteresis = Gpi::new(envelope, PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.5])?);
/// let linear = TransferFunction::new(&[0.3], &[1.0, -0.7])?.to_state_space()?;
/// let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
/// let model = Model::new(1e3, u.clone(), y.clone(), vec![hysteresis], linear, vec![0.0])?;
///
/// let input = Matrix::from_fn(2000, 1, |k, _| (0.02 * k as f64).sin() + (0.9 * k as f64).cos());
/// let disturbance = Matrix::from_fn(2000, 1, |k, _| 0.1 * (0.314 * k as f64).sin());
/// let output = model.simulate(&input)? + disturbance;
/// let run = Experiment {
///     input, output, covariates: Matrix::zeros(2000, 0), warmup: 0, held_out: vec![],
/// };
/// let record = Record::new(vec![run], 1e3, u, y, vec![])?;
/// let options = ResidualOptions::default();
/// let tests = residual_tests(&model, &record, &options, &mut |_| true)?;
/// assert!(tests.iter().any(|test| test.name == "lines" && !test.passed()));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Channels or rates that differ; [`Error::Interrupted`] when `progress` returned false.
pub fn residual_tests(
    model: &Model,
    record: &Record,
    options: &ResidualOptions,
    progress: Progress,
) -> Result<Vec<ResidualTest>, Error> {
    require_match(model, record)?;
    let mut residuals = if options.fit_start {
        residuals_from_fitted_start(model, record, progress)?
    } else {
        model.residuals(record)?
    };
    if options.remove_mean {
        for (residual, experiment) in residuals.iter_mut().zip(record.experiments()) {
            for mut column in residual.column_iter_mut() {
                let scored = experiment.scored_runs().flatten();
                let mean = scored.map(|k| column[k]).sum::<f64>() / experiment.scored() as f64;
                column.add_scalar_mut(-mean);
            }
        }
    }
    tests_of(model, record, &residuals)
}

/// All tests of residuals that a model leaves. Those of a sensor that clips are zero at the ends of its range, where they say nothing.
pub(crate) fn tests_of(
    model: &Model,
    record: &Record,
    residuals: &[Matrix],
) -> Result<Vec<ResidualTest>, Error> {
    let pairs = residuals.iter().zip(record.experiments());
    let simulated: Vec<Matrix> = pairs.map(|(residual, e)| &e.output - residual).collect();
    let intermediate: Vec<Matrix> = record
        .experiments()
        .iter()
        .map(|e| model.intermediate(&e.input))
        .collect::<Result<_, _>>()?;
    let policy = &ResidualPolicy::default();
    policy.validate()?;
    let (simulated, intermediate) = (&simulated, &intermediate);
    let mut sensors = model.effects().iter().filter_map(|effect| effect.place().output_stage());
    let clips = sensors.any(|sensor| sensor.range().iter().any(|end| end.is_finite()));
    let within = clips.then(|| within_limits(record, &OutsidePolicy::default())).transpose()?;
    let record = within.as_ref().unwrap_or(record);
    Ok(analyse(&Compared { policy, record, residuals, simulated, intermediate }))
}

/// All tests of every output.
fn analyse(measured: &Compared) -> Vec<ResidualTest> {
    let policy = measured.policy;
    let known = above_rounding(measured);
    let measured = &Compared { residuals: &known, ..*measured };
    let centred = measured.centred(&known);
    let given = &Compared { residuals: &centred, ..*measured };
    let flat = lines::flattened(given);
    let whitened = Compared { residuals: &flat, ..*given };
    let squares: Vec<Matrix> = centred.iter().map(|m| m.map(|value| value * value)).collect();
    let squares = given.centred(&squares);
    let power = Compared { residuals: &squares, ..*given };
    let outputs = given.record.outputs().len();
    let significance = policy.significance / (outputs * NAMES.len()) as f64;
    let mut tests = Vec::new();
    for output in 0..outputs {
        tests.push(mean::mean(measured, output, significance));
        tests.push(whiteness::whiteness(given, output, significance));
        tests.push(lines::lines(&whitened, output, significance));
        let signals = ScaledSignals::new(given, output);
        let families = signals.families(policy);
        for family in &families {
            tests.push(independence::independence(given, output, family, significance));
        }
        tests.push(prediction::prediction(given, output, &signals.all()));
        tests.push(level_to_level::level_to_level(given, output, &signals, significance));
        let present = families.into_iter().filter(|family| !family.name.starts_with("past-"));
        let name = "higher-order";
        let cause = "noise that depends on the input or on time, many small effects";
        let regressors = present.flat_map(|family| family.regressors).collect();
        let all = Family { name, points_to: points_to(name, cause), regressors };
        tests.push(independence::independence(&power, output, &all, significance));
        tests.push(wrong_samples::wrong_samples(given, output));
    }
    tests
}

/// Residuals, zero where they are no larger than what rounding leaves of the simulation.
fn above_rounding(given: &Compared) -> Vec<Matrix> {
    let sized = |(residual, simulated): (&Matrix, &Matrix)| {
        let least = given.policy.rounding * simulated.amax();
        residual.map(|value| if value.abs() <= least { 0.0 } else { value })
    };
    given.residuals.iter().zip(given.simulated).map(sized).collect()
}
