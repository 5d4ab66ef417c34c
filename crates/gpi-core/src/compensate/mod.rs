//! Compensation: the drive for which the model's output follows a reference.

mod backlash;
mod compensation;
mod dynamics;
mod expected;
mod input;
mod output;
mod plays;
mod solve;
mod start;
mod static_curve;
mod streaming;

use crate::effects::InputStage;
use crate::linear::NoncausalFir;
use crate::record::require_finite;
use crate::{Error, Experiment, Matrix, Model, ModelState, Record, SimulationError};
pub use compensation::{CompensateOptions, Compensation};
pub use expected::ExpectedError;
use expected::Run;
pub use start::Start;
pub use streaming::StreamingCompensator;

/// An error below this fraction of the largest reference is rounding.
const EXACT: f64 = 1e-13;

/// Another pass is made only if the last one reduced the error to less than this fraction: passes that gain less than
/// 10 % approach a limit, such as that of the drive.
const WORTH: f64 = 0.9;

impl Model {
    /// The drive for which the outputs follow a `reference` (samples, outputs).
    ///
    /// The parts of the model are inverted from the output to the input: the output effects sample by sample, G by its
    /// noncausal inverse (46), the hysteresis by its exact inverse ([`crate::operators::Gpi::inverse`]), and a delay by an
    /// earlier drive. Creep and loops around G have no such inverse. Therefore the model is simulated, the remaining error
    /// is added to the signal that is inverted, and the inversion is repeated as long as the error falls. Unless a
    /// [`Start`] is given, the actuator is initially in the steady state of [`Model::start`] at the reference's first
    /// value; after its last sample, the reference is taken as constant. [`Compensation::expected_error`] says how far the
    /// stage itself will be from the reference.
    ///
    /// ```
    /// use gpi_core::compensate::CompensateOptions;
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
    /// use gpi_core::{Channel, Matrix, Model};
    /// let scalar = |value| Matrix::from_element(1, 1, value);
    /// let linear = StateSpace::new(scalar(0.5), scalar(0.5), scalar(1.0), scalar(0.0))?;
    /// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.4])?);
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let model = Model::new(1e3, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])?;
    /// let reference = Matrix::from_fn(500, 1, |k, _| (0.05 * k as f64).sin());
    /// let found = model.compensate(&reference, &CompensateOptions::default())?;
    /// assert!(found.error.rms < 1e-12 && found.lead == 1);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The reference has another number of channels than the model, is not finite or beyond the range of a sensor that clips, the
    /// numbers of inputs and outputs differ, the limits leave no interval, or the hysteresis or the dynamics have no inverse.
    pub fn compensate(
        &self,
        reference: &Matrix,
        options: &CompensateOptions,
    ) -> Result<Compensation, Error> {
        let (compensated, left) = self.shares();
        let driven = self.driven();
        driven.require_reference(reference)?;
        let limits = driven.limits(&options.limits)?;
        options.start.iter().try_for_each(|start| start.validate(&driven))?;
        let requirement = "the largest slope of the drive must be positive";
        Error::require(options.slew > 0.0, "slew", options.slew, requirement)?;
        let known = if options.quasi_static { driven.quasi_static()? } else { driven.clone() };
        let inverse = dynamics::inverse(&known, options)?;
        let lead = inverse.noncausal + input::lead(&known);
        let rows = lead + reference.nrows();
        let mut reference =
            Matrix::from_fn(rows, reference.ncols(), |k, o| reference[(k.saturating_sub(lead), o)]);
        let start = options.start.as_ref().map(|own| own.of_part(self, &driven));
        if let Some(start) = &start {
            let held = Matrix::from_row_slice(1, start.input().len(), start.input());
            let shown = driven.simulate_from(&mut start.state(&driven)?, &held)?;
            reference.rows_mut(0, lead).row_iter_mut().for_each(|mut row| row.copy_from(&shown));
        }
        let begin = |model: &Self| {
            let own = start.as_ref().map(|own| own.of_part(&driven, model).state(model));
            own.transpose()
        };
        let begins =
            Beginning { state: begin(&known)?, input: options.start.as_ref().map(Start::input) };
        let mut asked = reference.clone();
        let mut best: Option<(Found, f64)> = None;
        let mut passes = Vec::new();
        for _ in 0..=options.passes {
            let found = known.drive_for(&asked, &inverse, &limits, options.slew, &begins)?;
            let missed = &reference - known.simulate_begun(&begins.state, &found.drive)?;
            let scored = missed.rows(lead, rows - lead);
            let rms = (scored.norm_squared() / scored.len() as f64).sqrt();
            passes.push(rms);
            let before = best.as_ref().map_or(f64::INFINITY, |(_, rms)| *rms);
            if rms < before {
                best = Some((found, rms));
            }
            let helps = rms < WORTH * before;
            if !helps || rms <= EXACT * reference.amax() {
                break;
            }
            asked += missed;
        }
        let Some((found, _)) = best else {
            let requirement =
                "the inverse of the model is unbounded; invert the DC gain only (`quasi_static`)";
            return Err(Error::parameter("reference", f64::NAN, requirement));
        };
        let begun = begin(&driven)?;
        let predicted = driven.simulate_begun(&begun, &found.drive)?;
        let simulate = |drive: &Matrix| driven.simulate_begun(&begun, drive);
        let curve = static_curve::static_curve(&driven, &reference, &found.drive, simulate)?;
        // zero stays zero after rounding, because the past is known there
        let rounding = EXACT * found.drive.amax();
        let exact = |input: &f64| if input.abs() <= rounding { 0.0 } else { *input };
        let first = || found.drive.row(0).iter().map(exact).collect();
        let start = start.clone().unwrap_or_else(|| Start::Input(first()));
        let run = Run {
            model: &driven,
            drive: &found.drive,
            reference: &reference,
            predicted: &predicted,
            start: &start,
            lead,
        };
        Ok(Compensation {
            expected_error: run.expected_error()?,
            error: driven.missed(&reference, &predicted, lead)?,
            error_static_curve: driven.missed(&reference, &curve, lead)?,
            drive: found.drive,
            out_of_reach: found.out_of_reach,
            too_fast: found.too_fast,
            reference,
            predicted,
            static_curve: curve,
            lead,
            passes,
            compensated,
            left,
        })
    }

    /// The outputs from a state, or from the steady state at the first input.
    fn simulate_begun(&self, state: &Option<ModelState>, drive: &Matrix) -> Result<Matrix, Error> {
        match state {
            Some(state) => self.simulate_from(&mut state.clone(), drive),
            None => self.simulate(drive),
        }
    }

    /// The names of the effects that a drive compensates, and those of the others with the reason.
    fn shares(&self) -> (Vec<&'static str>, Vec<(&'static str, &'static str)>) {
        let (mut compensated, mut left) = (Vec::new(), Vec::new());
        for effect in self.effects() {
            if !effect.entry().driven {
                left.push((effect.name(), "the input does not drive it"));
            } else if effect.is_added() {
                left.push((effect.name(), "the column that drives it is not known in advance"));
            } else if effect.place().input_stage().is_some_and(is_limited) {
                left.push((
                    effect.name(),
                    "the slope of the drive is kept below its limit instead",
                ));
            } else {
                compensated.push(effect.name());
            }
        }
        (compensated, left)
    }

    fn require_reference(&self, reference: &Matrix) -> Result<(), Error> {
        let (inputs, outputs) = (self.inputs().len(), self.outputs().len());
        let columns = ("reference", reference.ncols());
        Error::require_equal("outputs", columns, ("model", outputs))?;
        Error::require_equal("channels", ("the model's inputs", inputs), ("its outputs", outputs))?;
        Error::require_samples(reference.nrows(), 1, "a reference")?;
        require_finite(reference, self.outputs())?;
        output::require_in_range(self, reference)
    }

    /// The limits of each input's drive.
    fn limits(&self, given: &[(f64, f64)]) -> Result<Vec<[f64; 2]>, Error> {
        let inputs = self.inputs().len();
        let limits: Vec<[f64; 2]> = match given {
            [] => vec![[f64::NEG_INFINITY, f64::INFINITY]; inputs],
            [(lower, upper)] => vec![[*lower, *upper]; inputs],
            _ => given.iter().map(|&(lower, upper)| [lower, upper]).collect(),
        };
        Error::require_equal("inputs", ("limits", limits.len()), ("model", inputs))?;
        for [lower, upper] in &limits {
            let requirement = "the lower limit must be below the upper limit";
            Error::require(lower < upper, "limits", format!("{lower}, {upper}"), requirement)?;
        }
        Ok(limits)
    }

    /// The drive for given outputs, without corrections.
    fn drive_for(
        &self,
        asked: &Matrix,
        inverse: &NoncausalFir,
        limits: &[[f64; 2]],
        slew: f64,
        begins: &Beginning,
    ) -> Result<Found, Error> {
        let v = dynamics::invert(inverse, &output::before_sensor(self, asked))?;
        let (mut drive, out_of_reach) = plays::undone(self, &v, limits, begins.state.as_ref())?;
        input::advance(self, &mut drive);
        let too_fast = input::slow_down(self, &mut drive, slew, begins.input);
        Ok(Found { drive, out_of_reach, too_fast })
    }

    /// The error of a prediction behind the lead.
    fn missed(
        &self,
        reference: &Matrix,
        predicted: &Matrix,
        lead: usize,
    ) -> Result<SimulationError, Error> {
        let input = Matrix::zeros(reference.nrows(), self.inputs().len());
        let runs = vec![Experiment { warmup: lead, ..Experiment::new(input, reference.clone()) }];
        let (inputs, outputs) = (self.inputs().to_vec(), self.outputs().to_vec());
        let record = Record::new(runs, self.rate(), inputs, outputs, vec![])?;
        Ok(SimulationError::of(&record, &[reference - predicted], false))
    }
}

/// Whether it limits the slope of the drive.
fn is_limited(effect: &dyn InputStage) -> bool {
    effect.fastest().is_finite()
}

/// What is known of the stage before the drive begins.
struct Beginning<'a> {
    state: Option<ModelState>,
    input: Option<&'a [f64]>,
}

/// A drive, and the numbers of samples at which a limit or the slew rate clamped it.
struct Found {
    drive: Matrix,
    out_of_reach: usize,
    too_fast: usize,
}
