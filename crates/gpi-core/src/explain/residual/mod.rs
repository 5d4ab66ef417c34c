//! What a residual still contains: named tests, each with what it points to.
//!
//! Every test has a chance of a hundredth over the number of tests to fail where there is nothing, so that
//! all together fail once in a hundred records of pure noise, or less often.

mod chance;
mod families;
mod independence;
mod level_to_level;
mod lines;
mod mean;
#[cfg(test)]
mod simulated;
mod whiteness;
mod wrong_samples;

use crate::fit::refine::require_match;
use crate::identify::{Progress, residuals_from_fitted_start};
use crate::{Error, Matrix, Model, Record};
use families::{Family, Signals};

/// One test of a residual.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualTest {
    /// Such as `whiteness`.
    pub name: &'static str,
    /// The output it looks at.
    pub output: usize,
    /// What is compared with the threshold.
    pub statistic: f64,
    /// What the statistic must not exceed: the value that it exceeds with a chance of a hundredth over the
    /// number of tests (of all outputs) where there is nothing.
    ///
    /// It is raised where that would be of no practical size: for `whiteness` to a hundredth of the
    /// residual's variance in its correlations; for the statistics t of `mean`, `level-to-level`,
    /// `higher-order` and all dependences, whose chance is shared by their regressors, to 4. `outliers`
    /// allows two.
    pub threshold: f64,
    /// The chance, at most, that a residual without structure gives a statistic this large or larger; all
    /// regressors or lines of this one test are allowed for, the other tests are not.
    pub p_value: f64,
    /// What it points to when it fails.
    pub points_to: &'static str,
}

impl ResidualTest {
    /// Whether the residual shows nothing here.
    pub fn passed(&self) -> bool {
        self.statistic <= self.threshold
    }
}

/// How the residual of a model is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResidualOptions {
    /// Fit what was before the first sample, see [`residuals_from_fitted_start`].
    pub fit_start: bool,
    /// Take the mean of each experiment's residual out, for sensors whose offset moves between them.
    pub remove_mean: bool,
}

/// Tests of every output.
const NAMES: [&str; 13] = [
    "mean",
    "whiteness",
    "lines",
    "past-input",
    "past-intermediate",
    "level",
    "speed",
    "direction",
    "amplitude",
    "trend",
    "level-to-level",
    "higher-order",
    "outliers",
];

/// Names of the tests that show a dependence on the input or on time: more than noise with memory.
pub(crate) const STRUCTURE: [&str; 11] = [
    "mean",
    "lines",
    "past-input",
    "past-intermediate",
    "level",
    "speed",
    "direction",
    "amplitude",
    "trend",
    "level-to-level",
    "higher-order",
];

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
/// let tests = residual_tests(&model, &record, &options, &mut |_, _| true)?;
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

/// All tests of residuals that a model leaves.
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
    Ok(analyse(&Beside { record, residuals, simulated: &simulated, intermediate: &intermediate }))
}

/// Signals that the residual is compared with, each (samples, channels), one an experiment.
#[derive(Clone, Copy)]
struct Beside<'a> {
    record: &'a Record,
    residuals: &'a [Matrix],
    /// The simulated output.
    simulated: &'a [Matrix],
    /// The model's v, from rest.
    intermediate: &'a [Matrix],
}

impl Beside<'_> {
    /// Experiment and place of every scored sample.
    fn scored(&self) -> impl Iterator<Item = (usize, usize)> {
        let experiments = self.record.experiments().iter().enumerate();
        experiments.flat_map(|(index, e)| e.scored_runs().flatten().map(move |k| (index, k)))
    }

    /// A signal of the residuals' shape without the mean of each output's scored samples.
    fn centred(&self, signals: &[Matrix]) -> Vec<Matrix> {
        let mut centred = signals.to_vec();
        for output in 0..self.record.outputs().len() {
            let sum: f64 = self.scored().map(|(index, k)| signals[index][(k, output)]).sum();
            let mean = sum / self.record.scored() as f64;
            centred.iter_mut().for_each(|m| m.column_mut(output).add_scalar_mut(-mean));
        }
        centred
    }
}

/// All tests of every output.
fn analyse(given: &Beside) -> Vec<ResidualTest> {
    let known = above_rounding(given);
    let given = &Beside { residuals: &known, ..*given };
    let centred = given.centred(&known);
    let beside = &Beside { residuals: &centred, ..*given };
    let flat = lines::flattened(beside);
    let whitened = Beside { residuals: &flat, ..*beside };
    let squares: Vec<Matrix> = centred.iter().map(|m| m.map(|value| value * value)).collect();
    let squares = beside.centred(&squares);
    let loudness = Beside { residuals: &squares, ..*beside };
    let outputs = beside.record.outputs().len();
    let chance = 0.01 / (outputs * NAMES.len()) as f64;
    let mut tests = Vec::new();
    for output in 0..outputs {
        tests.push(mean::mean(given, output, chance));
        tests.push(whiteness::whiteness(beside, output, chance));
        tests.push(lines::lines(&whitened, output, chance));
        let signals = Signals::new(beside, output);
        let families = signals.families();
        for family in &families {
            tests.push(independence::independence(beside, output, family, chance));
        }
        tests.push(level_to_level::level_to_level(beside, output, &signals, chance));
        let present = families.into_iter().filter(|family| !family.name.starts_with("past-"));
        let all = Family {
            name: "higher-order",
            points_to: "noise that depends on the input or on time, many small effects",
            regressors: present.flat_map(|family| family.regressors).collect(),
        };
        tests.push(independence::independence(&loudness, output, &all, chance));
        tests.push(wrong_samples::wrong_samples(beside, output));
    }
    tests
}

/// Residuals, zero where they are no larger than what rounding leaves of the simulation.
fn above_rounding(beside: &Beside) -> Vec<Matrix> {
    const ROUNDING: f64 = 1e-13;
    let sized = |(residual, simulated): (&Matrix, &Matrix)| {
        let least = ROUNDING * simulated.amax();
        residual.map(|value| if value.abs() <= least { 0.0 } else { value })
    };
    beside.residuals.iter().zip(beside.simulated).map(sized).collect()
}
