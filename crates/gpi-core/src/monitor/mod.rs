//! Has the machine changed since its model was made?
//!
//! A [`Monitor`] simulates the model along with the machine and tests what is left,
//!
//! ```text
//! r(k) = y(k) - y_hat(k) = sum_i d_i phi_i(k) + m(k) + w(k)
//! ```
//!
//! with the noise w of the training record, an error m that is known to be possible, and the changes d_i: of the offset, the
//! gain, the first resonance, and the width of the hysteresis, whose `phi_i = dy_hat / dd_i` are simulated along (`moved`).
//! [`crate::operators::ResidualMonitor`] decides which changes two successive windows agree upon, for windows of all
//! lengths; `lines` searches for sines. What is known to be possible is the misfit of the training record, the
//! uncertainty of the parameters, effects of time such as drift, and the unknown start, whose share ends when the
//! drive has swept its range.
//!
//! The rate of false alarms is bounded by the sum over all tests, which each have the same probability. The windows double in
//! length, so that a block needs two tests for each quantity on average.

mod change;
mod drawn;
mod history;
mod lines;
mod moved;
mod settings;
mod tracks;
mod watch;

pub use change::Change;
pub use moved::Watched;

use crate::operators::{Limits, POSSIBLE};
use crate::{Error, Matrix, Model};
use drawn::drawn_models;
use lines::{Line, Lines};
use moved::moved_models;
use settings::MonitorSettings;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use tracks::Tracks;
use watch::{Found, Watch};

/// Monitors a machine with a model of it.
///
/// ```
/// use gpi_core::linear::TransferFunction;
/// use gpi_core::monitor::{Monitor, Watched};
/// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
/// use gpi_core::{Channel, Matrix, Model};
/// let machine = |gain: f64| {
///     let envelope = Deadzones::new(vec![0.0], vec![gain], Reading::OneSided)?;
///     let plays = PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.4])?;
///     let linear = TransferFunction::new(&[0.3], &[1.0, -0.7])?.to_state_space()?;
///     let channel = |name, unit| vec![Channel::new(name, unit)];
///     let gpi = vec![Gpi::new(envelope, plays)];
///     Model::new(100.0, channel("u", "V"), channel("y", "um"), gpi, linear, vec![0.0])
/// };
/// let u = Matrix::from_fn(6000, 1, |k, _| (0.031 * k as f64).sin() + (0.0071 * k as f64).cos());
/// let noise = Matrix::from_fn(6000, 1, |k, _| 0.01 * (7.1 * (k * k) as f64).sin());
/// let mut monitor = Monitor::new(&machine(1.0)?, Some(&[0.01]), 1e-4)?;
/// monitor.push(&u, &(machine(1.0)?.simulate(&u)? + &noise), &Matrix::zeros(6000, 0))?;
/// assert!(monitor.changes().is_empty());
/// monitor.end_experiment();
/// monitor.push(&u, &(machine(1.02)?.simulate(&u)? + &noise), &Matrix::zeros(6000, 0))?;
/// let changes = monitor.changes();
/// assert!(changes.iter().any(|change| change.watched == Watched::Gain && (change.size - 0.02).abs() < 0.005));
/// # Ok::<(), gpi_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Monitor {
    /// With all effects, and without those of time.
    model: Model,
    driven: Model,
    settings: MonitorSettings,
    noise: Vec<f64>,
    block: usize,
    /// What is tested in the order of the regressors, and models in which it has changed.
    watched: Vec<Watched>,
    neighbours: Vec<Model>,
    draws: Vec<(Model, f64)>,
    deviations: f64,
    /// Samples until a transient of the dynamics has decayed, and those that have to decay still.
    memory: usize,
    waiting: usize,
    tracks: Option<Tracks>,
    outputs: Vec<(Watch, Lines)>,
    samples: usize,
}

impl Monitor {
    /// A monitor for at most so many false alarms per hour of data.
    ///
    /// `noise` is the standard deviation of each output's noise; without it, that of the model's training record.
    ///
    /// # Errors
    /// A rate that is not between 0 and 1000, a model without estimates where `noise` is not given, noise that is not positive.
    pub fn new(
        model: &Model,
        noise: Option<&[f64]>,
        false_alarms_per_hour: f64,
    ) -> Result<Self, Error> {
        let settings = MonitorSettings::default();
        settings.validate()?;
        if !(false_alarms_per_hour > 0.0 && false_alarms_per_hour <= 1000.0) {
            let requirement = "must be above 0 and at most 1000";
            return Err(Error::parameter(
                "false_alarms_per_hour",
                false_alarms_per_hour,
                requirement,
            ));
        }
        let noise = noise.map_or_else(|| noise_of(model), |noise| Ok(noise.to_vec()))?;
        let outputs = ("model", model.outputs().len());
        Error::require_equal("outputs", ("noise", noise.len()), outputs)?;
        for &size in &noise {
            let is_positive = size > 0.0 && size.is_finite();
            Error::require(is_positive, "noise", size, "the standard deviation must be positive")?;
        }
        let block = settings.samples.max((settings.seconds * model.rate()).round() as usize);
        let hours = block as f64 / model.rate() / 3600.0;
        let rate = false_alarms_per_hour * hours / noise.len() as f64;
        let driven = model.driven();
        let (moved, neighbours): (Vec<Watched>, _) =
            moved_models(&driven, &settings)?.into_iter().unzip();
        let watched: Vec<Watched> =
            [Watched::Offset, Watched::Gain].into_iter().chain(moved).collect();
        // two directions of each quantity and of the noise, on two levels of windows on average, and as much for lines
        let tests = 8.0 * (watched.len() + 1) as f64;
        let chance = (rate / tests).sqrt();
        let deviations = Normal::standard().inverse_cdf(1.0 - chance);
        let draws = drawn_models(&driven, &settings);
        // the variance is an estimate from as many draws
        let of_draws = StudentsT::new(0.0, 1.0, draws.len() as f64)
            .map_or(0.0, |student| student.inverse_cdf(1.0 - chance));
        // a resonance oscillates within a block; a slower one looks like a change of the state
        let is_fast = |own: &Watched| match own {
            Watched::Resonance { frequency } => frequency * block as f64 >= model.rate(),
            _ => false,
        };
        let fast = (watched.iter().enumerate()).filter(|(_, own)| is_fast(own));
        let fast = fast.fold(0, |bits, (place, _)| bits | 1 << place);
        let frame = settings.frame * block;
        let of_lines = 0.5 * rate * settings.frame as f64;
        let tests_of = |&noise: &f64| {
            let limits = Limits {
                noise,
                deviations,
                least_noise: settings.least_noise,
                hidden: settings.hidden * noise,
                fast,
                of_draws,
            };
            let watch = Watch::new(limits, watched.len(), draws.len(), &settings)?;
            Ok::<_, Error>((watch, Lines::new(frame, noise, of_lines, &settings)))
        };
        let radius = driven.linear().spectral_radius()?;
        // without a decay the quotient is infinite or NaN
        let samples = if radius > 0.0 { settings.decayed.ln() / radius.ln() } else { 0.0 };
        let most = settings.waiting * block;
        let memory =
            if samples >= 0.0 && samples < most as f64 { samples.ceil() as usize } else { most };
        Ok(Self {
            memory,
            waiting: memory,
            outputs: noise.iter().map(tests_of).collect::<Result<_, _>>()?,
            model: model.clone(),
            driven,
            settings,
            noise,
            block,
            watched,
            neighbours,
            draws,
            deviations,
            tracks: None,
            samples: 0,
        })
    }

    /// The model that is simulated: that of the machine, without effects that are functions of the time of its training record.
    pub fn simulated(&self) -> &Model {
        &self.driven
    }

    /// Standard deviation of the noise of each output, in its unit.
    pub fn noise(&self) -> &[f64] {
        &self.noise
    }

    /// The standard errors by which a change must exceed what is possible without it, in each of two windows.
    pub fn deviations(&self) -> f64 {
        self.deviations
    }

    /// The smallest part by which the noise must have changed.
    pub fn least_noise(&self) -> f64 {
        self.settings.least_noise
    }

    /// The error of an output that may have any shape, in its unit: twice the misfit of the whole training record, or the misfit
    /// of its worst second.
    pub fn misfit(&self, output: usize) -> f64 {
        self.model.prediction().map_or(0.0, |own| {
            let largest = own.largest_misfit().get(output).copied().unwrap_or(0.0);
            largest.max(self.settings.unseen * own.misfit()[output])
        })
    }

    /// The slow error of an output that the training record may hide, in its unit.
    pub fn hidden(&self, output: usize) -> f64 {
        self.settings.hidden * self.noise[output]
    }

    /// Length of a block, in samples: tests are made at the end of each.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Samples so far.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Whether a change was noticed.
    pub fn has_changed(&self) -> bool {
        self.outputs.iter().any(|(watch, lines)| watch.has_changed() || lines.strongest.is_some())
    }

    /// Names of what is tested.
    pub fn watched(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = Vec::new();
        for name in self.watched.iter().map(Watched::name).chain(["noise", "line"]) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The samples that follow belong to another record of the same machine: what happened in between is unknown.
    pub fn end_experiment(&mut self) {
        self.tracks = None;
    }

    /// Counts samples: input (samples, inputs), output (samples, outputs) and measured columns (samples, covariates). An
    /// output that is NaN is left out.
    ///
    /// The first run after the start or after [`Monitor::end_experiment`] should contain a second of data or more: its
    /// range of inputs is taken for the range in which the machine moved before.
    ///
    /// # Errors
    /// Other numbers of channels or samples; an input that is not finite.
    pub fn push(
        &mut self,
        input: &Matrix,
        output: &Matrix,
        covariates: &Matrix,
    ) -> Result<(), Error> {
        let channels = ("model", self.noise.len());
        Error::require_equal("outputs", ("output", output.ncols()), channels)?;
        let samples = ("input", input.nrows());
        Error::require_equal("samples", ("output", output.nrows()), samples)?;
        Error::require_equal("samples", ("covariates", covariates.nrows()), samples)?;
        if let Some(place) = input.iter().position(|value| !value.is_finite()) {
            let row = place % input.nrows();
            return Err(Error::parameter(
                "input",
                input[place],
                format!("row {row} is not finite"),
            ));
        }
        let mut first = 0;
        while first < input.nrows() {
            let rest = self.block - self.samples % self.block;
            let count = rest.min(input.nrows() - first);
            let rows = |signal: &Matrix| signal.rows(first, count).into_owned();
            if self.tracks.is_none() {
                self.tracks = Some(Tracks::new(
                    (&self.model, &self.driven),
                    (&self.neighbours, &self.draws),
                    &self.settings,
                    input,
                    covariates,
                )?);
                self.waiting = self.memory;
            }
            self.run(&rows(input), &rows(output), &rows(covariates))?;
            first += count;
        }
        Ok(())
    }

    /// Counts samples of one block.
    fn run(&mut self, input: &Matrix, output: &Matrix, covariates: &Matrix) -> Result<(), Error> {
        let Some(tracks) = &mut self.tracks else { return Ok(()) };
        let forgotten: Vec<f64> =
            self.noise.iter().map(|noise| self.settings.forgotten * noise).collect();
        let simulated = tracks.run(input, covariates, &forgotten)?;
        let of_time = tracks.of_time.clone();
        let mut regressors = vec![1.0; self.watched.len()];
        let mut draws = vec![0.0; self.draws.len()];
        let constants: Vec<f64> =
            (0..self.noise.len()).map(|o| self.misfit(o).powi(2) + of_time[o]).collect();
        let hidden: Vec<f64> = (0..self.noise.len()).map(|o| self.hidden(o).powi(2)).collect();
        for (place, (watch, lines)) in self.outputs.iter_mut().enumerate() {
            let constant = constants[place];
            let offset = self.model.offsets()[place];
            for k in 0..input.nrows() {
                let predicted = simulated.predicted[(k, place)];
                regressors[1] = predicted - offset;
                let derivatives = simulated.derivatives.iter().map(|own| own[(k, place)]);
                // at rest, a derivative that has decayed is rounding, which would look like an offset
                let least = forgotten[place];
                let counted = derivatives.map(|own| if own.abs() < least { 0.0 } else { own });
                regressors[2..].iter_mut().zip(counted).for_each(|(to, from)| *to = from);
                draws
                    .iter_mut()
                    .zip(&simulated.draws)
                    .for_each(|(to, from)| *to = from[(k, place)]);
                let start = simulated.start[(k, place)];
                let is_counted = k >= self.waiting;
                let residual = if is_counted { output[(k, place)] - predicted } else { f64::NAN };
                watch.add((&regressors, &draws), residual, constant, start);
                let drawn = POSSIBLE * draws.iter().map(|draw| draw * draw).sum::<f64>();
                let possible = constant + start + drawn + hidden[place];
                lines.add(residual, predicted, possible)?;
            }
        }
        self.waiting = self.waiting.saturating_sub(input.nrows());
        self.samples += input.nrows();
        if self.samples.is_multiple_of(self.block) {
            self.outputs.iter_mut().for_each(|(watch, _)| watch.end_block());
        }
        Ok(())
    }

    /// What has changed, as the strongest evidence so far shows it; empty if nothing was noticed.
    pub fn changes(&self) -> Vec<Change> {
        let seconds = self.block as f64 / self.model.rate();
        let mut changes = Vec::new();
        for (output, (watch, lines)) in self.outputs.iter().enumerate() {
            let found = watch.found(&self.watched);
            // a change of the hysteresis, for example, leaves harmonics of the drive
            let is_known = |own: &&Found| own.watched != Watched::Noise;
            let began = found.iter().filter(is_known).map(|own| own.onset).min();
            let is_before =
                |line: &Line| began.is_none_or(|began| line.until * self.settings.frame <= began);
            let line = lines.strongest.filter(is_before);
            let power =
                line.map_or(0.0, |line| 0.5 * (line.amplitude / self.noise[output]).powi(2));
            for own in found {
                // the noise that a line explains is none
                let is_of_line =
                    own.watched == Watched::Noise && (1.0 + own.size).powi(2) - 1.0 <= 2.0 * power;
                if !is_of_line {
                    let since = own.onset as f64 * seconds;
                    changes.push(Change::of(own, output, since));
                }
            }
            changes.extend(line.map(|line| {
                let onset = lines.first.unwrap_or(line.onset) * self.settings.frame;
                Change::of_line(line, output, self.model.rate(), onset as f64 * seconds)
            }));
        }
        changes
    }
}

/// The noise of the training record: what is left of the residual without the misfit.
fn noise_of(model: &Model) -> Result<Vec<f64>, Error> {
    let Some(estimates) = model.estimates() else {
        let requirement = "the model file does not contain the noise of a training record: give `noise`, or identify the model \
                           with this version";
        return Err(Error::parameter("model", "no estimates", requirement));
    };
    let misfit = |output: usize| model.prediction().map_or(0.0, |own| own.misfit()[output]);
    let of = |(output, rms): (usize, &f64)| (rms.powi(2) - misfit(output).powi(2)).max(0.0).sqrt();
    Ok(estimates.residual_rms.iter().enumerate().map(of).collect())
}
