//! What to drive an actuator with so that its output follows a reference: the model, run backwards.

mod dynamics;
mod input;
mod output;
mod plays;
mod solve;
mod streaming;

use crate::effects::{Effect, InputStage};
use crate::{Error, Experiment, Matrix, Model, Record, SimulationError};
use dynamics::Backward;
use std::cmp::Ordering;
pub use streaming::StreamingCompensator;

/// What a drive may do, and how it is found.
#[derive(Clone, Debug, PartialEq)]
pub struct CompensateOptions {
    /// Lowest and highest drive of each input, in its unit; one pair stands for all, none for no limit.
    pub limits: Vec<(f64, f64)>,
    /// The fastest drive, in units of the input per second.
    pub slew: f64,
    /// Whether the dynamics G are left alone: only their DC gain is inverted, and nothing looks ahead.
    pub quasi_static: bool,
    /// Samples by which the drive may begin before the reference; as many as G needs when `None`.
    pub preview: Option<usize>,
    /// Most passes in which what a simulation still misses is added to what is asked for.
    pub passes: usize,
}

impl Default for CompensateOptions {
    fn default() -> Self {
        Self { limits: vec![], slew: f64::INFINITY, quasi_static: false, preview: None, passes: 20 }
    }
}

/// A drive, and what the model says that it does.
#[derive(Clone, Debug)]
pub struct Compensation {
    /// u, (lead + samples, inputs).
    pub drive: Matrix,
    /// The reference with the lead, in which it stands at its first value, (lead + samples, outputs).
    pub reference: Matrix,
    /// The outputs of the model for `drive`, without the effects that no input drives.
    pub predicted: Matrix,
    /// The same for a drive in proportion to the reference: the straight line through `drive`.
    pub in_proportion: Matrix,
    /// Samples by which the drive begins before the reference.
    pub lead: usize,
    /// `reference` less `predicted` over the reference's own samples.
    pub error: SimulationError,
    /// `reference` less `in_proportion`.
    pub error_in_proportion: SimulationError,
    /// Root mean square error after each pass.
    pub passes: Vec<f64>,
    /// Samples at which a drive stands at a limit of `limits`, or of where the envelope rises.
    pub out_of_reach: usize,
    /// Samples at which a drive would have had to be faster than `slew`.
    pub too_fast: usize,
    /// Effects that are compensated.
    pub compensated: Vec<&'static str>,
    /// Effects that no drive compensates, and why.
    pub left: Vec<(&'static str, &'static str)>,
}

impl Model {
    /// The drive that makes the outputs follow a reference (samples, outputs).
    ///
    /// Backwards through the chain: the output stage sample by sample, G by its noncausal inverse (46), the hysteresis
    /// by its exact inverse ([`crate::operators::Gpi::inverse`]), a delay by driving earlier. Creep and loops around G
    /// have no such inverse; the model is simulated, what it misses is added to what is asked for, and the chain is
    /// gone through once more, as long as that helps. The actuator is taken to stand at the reference's first value, as
    /// by [`Model::start`], and the reference to stay at its last one.
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
    /// Another number of channels, unequal numbers of inputs and outputs, samples that are not finite, limits that leave
    /// nothing, a hysteresis or dynamics without an inverse.
    pub fn compensate(
        &self,
        reference: &Matrix,
        options: &CompensateOptions,
    ) -> Result<Compensation, Error> {
        /// Of the reference's span: what is left below is rounding.
        const EXACT: f64 = 1e-13;
        /// By how much a pass has to lower the error for another one to be tried.
        const WORTH: f64 = 0.9;
        let (compensated, left) = self.shares();
        let driven = self.driven();
        driven.require_reference(reference)?;
        let limits = driven.limits(&options.limits)?;
        if options.slew.is_nan() || options.slew <= 0.0 {
            return Err(Error::parameter(
                "slew",
                options.slew,
                "the fastest drive must be positive",
            ));
        }
        let known = if options.quasi_static { driven.quasi_static()? } else { driven.clone() };
        let backward = Backward::new(&known, options)?;
        let lead = backward.lead() + input::lead(&known);
        let rows = lead + reference.nrows();
        let reference =
            Matrix::from_fn(rows, reference.ncols(), |k, o| reference[(k.saturating_sub(lead), o)]);
        let mut asked = reference.clone();
        let mut best: Option<(Found, f64)> = None;
        let mut passes = Vec::new();
        for _ in 0..=options.passes {
            let found = known.drive_for(&asked, &backward, &limits, options.slew)?;
            let missed = &reference - known.simulate(&found.drive)?;
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
                "the chain run backwards grows without bounds; leave G alone with `quasi_static`";
            return Err(Error::parameter("reference", f64::NAN, requirement));
        };
        let predicted = driven.simulate(&found.drive)?;
        let plain = driven.simulate(&proportional(&driven, &reference, &found.drive)?)?;
        Ok(Compensation {
            error: driven.missed(&reference, &predicted, lead)?,
            error_in_proportion: driven.missed(&reference, &plain, lead)?,
            drive: found.drive,
            out_of_reach: found.out_of_reach,
            too_fast: found.too_fast,
            reference,
            predicted,
            in_proportion: plain,
            lead,
            passes,
            compensated,
            left,
        })
    }

    /// Names of the effects that a drive compensates, and of the others with the reason.
    fn shares(&self) -> (Vec<&'static str>, Vec<(&'static str, &'static str)>) {
        let (mut compensated, mut left) = (Vec::new(), Vec::new());
        for effect in self.effects() {
            if !effect.entry().driven {
                left.push((effect.name(), "the input does not drive it"));
            } else if is_added(effect) {
                left.push((effect.name(), "the column that drives it is not known beforehand"));
            } else if effect.place().input_stage().is_some_and(is_limited) {
                left.push((effect.name(), "the drive is kept below its limit instead"));
            } else {
                compensated.push(effect.name());
            }
        }
        (compensated, left)
    }

    /// The model without what no input drives.
    fn driven(&self) -> Self {
        let mut driven = self.clone();
        driven.effects.retain(|effect| effect.entry().driven && !is_added(effect));
        driven
    }

    fn require_reference(&self, reference: &Matrix) -> Result<(), Error> {
        let (inputs, outputs) = (self.inputs().len(), self.outputs().len());
        let columns = ("reference", reference.ncols());
        Error::require_equal("outputs", columns, ("model", outputs))?;
        Error::require_equal("channels", ("the model's inputs", inputs), ("its outputs", outputs))?;
        if reference.nrows() == 0 {
            let purpose = "a reference".to_owned();
            return Err(Error::TooFewSamples { samples: 0, needed: 1, purpose });
        }
        for (column, channel) in reference.column_iter().zip(self.outputs()) {
            let count = column.iter().filter(|value| !value.is_finite()).count();
            if let Some(row) = column.iter().position(|value| !value.is_finite()) {
                return Err(Error::NotFinite { column: channel.name.clone(), row, count });
            }
        }
        Ok(())
    }

    /// The limits of each input.
    fn limits(&self, given: &[(f64, f64)]) -> Result<Vec<[f64; 2]>, Error> {
        let inputs = self.inputs().len();
        let limits: Vec<[f64; 2]> = match given {
            [] => vec![[f64::NEG_INFINITY, f64::INFINITY]; inputs],
            [(lower, upper)] => vec![[*lower, *upper]; inputs],
            _ => given.iter().map(|&(lower, upper)| [lower, upper]).collect(),
        };
        Error::require_equal("inputs", ("limits", limits.len()), ("model", inputs))?;
        match limits.iter().find(|[lower, upper]| lower.partial_cmp(upper) != Some(Ordering::Less))
        {
            Some([lower, upper]) => {
                let value = format!("{lower}, {upper}");
                Err(Error::parameter("limits", value, "the lower one must be below the upper one"))
            }
            None => Ok(limits),
        }
    }

    /// The drive for what is asked of the outputs.
    fn drive_for(
        &self,
        asked: &Matrix,
        backward: &Backward,
        limits: &[[f64; 2]],
        slew: f64,
    ) -> Result<Found, Error> {
        let displacement = output::before_sensor(self, asked);
        let v = backward.run(&displacement)?;
        let (mut drive, out_of_reach) = plays::undone(self, &v, limits)?;
        input::advance(self, &mut drive);
        let too_fast = input::slow_down(self, &mut drive, slew);
        Ok(Found { drive, out_of_reach, too_fast })
    }

    /// How far a prediction is from the reference behind the lead.
    fn missed(
        &self,
        reference: &Matrix,
        predicted: &Matrix,
        lead: usize,
    ) -> Result<SimulationError, Error> {
        let experiment = Experiment {
            input: Matrix::zeros(reference.nrows(), self.inputs().len()),
            output: reference.clone(),
            covariates: Matrix::zeros(reference.nrows(), 0),
            warmup: lead,
            held_out: vec![],
        };
        let channels = (self.inputs().to_vec(), self.outputs().to_vec());
        let record = Record::new(vec![experiment], self.rate(), channels.0, channels.1, vec![])?;
        Ok(SimulationError::of(&record, &[reference - predicted], false))
    }
}

/// Whether it limits the slope of the drive.
fn is_limited(effect: &dyn InputStage) -> bool {
    effect.fastest().is_finite()
}

/// Whether it comes on top of what the input does.
fn is_added(effect: &Effect) -> bool {
    effect.place().added().is_some()
}

struct Found {
    drive: Matrix,
    out_of_reach: usize,
    too_fast: usize,
}

/// A drive in proportion to what G at rest asks for: the straight line through another drive, by least squares.
fn proportional(model: &Model, reference: &Matrix, drive: &Matrix) -> Result<Matrix, Error> {
    let still = Matrix::from_fn(reference.nrows(), reference.ncols(), |k, o| {
        reference[(k, o)] - model.offsets()[o]
    });
    let v = still * dynamics::inverse_gain(model.linear())?.transpose();
    let mut line = v.clone();
    for ((mut line, v), u) in line.column_iter_mut().zip(v.column_iter()).zip(drive.column_iter()) {
        let (v_mean, u_mean) = (v.mean(), u.mean());
        let (mut squares, mut products) = (0.0, 0.0);
        for (v, u) in v.iter().zip(u.iter()) {
            squares += (v - v_mean) * (v - v_mean);
            products += (v - v_mean) * (u - u_mean);
        }
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        line.iter_mut().for_each(|value| *value = u_mean + slope * (*value - v_mean));
    }
    Ok(line)
}
