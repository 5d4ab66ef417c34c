//! The whole chain: excitation, start, rounds, model.

use super::dynamics::{self, Dynamics};
use super::hysteresis::{fit, forgets_at, range};
use super::linearization::{Freedom, Point};
use super::sensitivity::{Derivatives, Parameters};
use super::{Grid, Progress, report};
use crate::linear::{self, Fir, StateSpace, excitation_limit};
use crate::{Error, Experiment, Matrix, Model, Record};

/// What [`identify`] chooses (`None`) and what is given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdentifyOptions {
    /// Taps of the FIR estimate.
    pub taps: Option<usize>,
    /// Order of the linear dynamics.
    pub order: Option<usize>,
    /// Half-widths of the plays, in the unit of the input.
    pub half_widths: Option<Grid>,
    /// Thresholds of the deadzones, in the unit of the input.
    pub thresholds: Option<Grid>,
    /// Restricts the linear part to a gain with a delay of this many samples.
    pub delay: Option<usize>,
}

/// One pass of hysteresis and dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Root mean square of what is left on the training data, in the output's unit.
    pub rms: f64,
    /// Order of G.
    pub order: usize,
    /// Taps of the FIR estimate behind it.
    pub taps: usize,
}

/// A model and what it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The model, in its best round.
    pub model: Model,
    /// The paper's first stage, u to y; `None` where the input excites no more than gain and delay.
    pub fir: Option<Fir>,
    /// Singular values of ERA's Hankel matrix in the best round.
    pub singular_values: Vec<f64>,
    /// Unstable poles that ERA reflected in the best round.
    pub reflected: usize,
    /// Taps that the input supports, `usize::MAX` when there is no limit in sight.
    pub supported_taps: usize,
    /// Delay in samples where the linear part is a gain with a delay.
    pub delay: Option<usize>,
    /// What was left after each round.
    pub rounds: Vec<Round>,
    /// Samples at the start of each experiment that were not scored: the plays' unknown past.
    pub warmups: Vec<usize>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}

/// Regularization of the FIR estimates, see [`linear::estimate`].
const RIDGE: f64 = 3e-2;

/// Identifies a model from a record.
///
/// A record whose input excites few directions (a sine, say) supports no dynamics beyond a gain and a
/// delay; the delay is then the one that fits best. Otherwise G has the order that the information
/// criterion prefers, and the rounds go on until nothing is gained.
///
/// # Errors
/// A constant input or output, more taps than the input excites or the samples allow, parameters out
/// of range, [`Error::Interrupted`] when `progress` returned false.
pub fn identify(
    record: &Record,
    options: &IdentifyOptions,
    progress: Progress,
) -> Result<Identification, Error> {
    record.require_moving()?;
    let inputs = record.inputs().len();
    let supported = excitation_limit(record)?;
    if options.taps == Some(0) {
        return Err(Error::parameter("taps", 0, "at least one tap is needed"));
    }
    if let Some(taps) = options.taps
        && taps > supported
    {
        let (unknowns, rank) = (taps * inputs, supported * inputs);
        return Err(Error::Excitation { taps, unknowns, rank, supported });
    }
    report(progress, "excitation", 1.0)?;
    let longest =
        record.experiments().iter().map(|e| e.input.nrows() - e.warmup).max().unwrap_or(0);
    let affordable = (longest / (4 * inputs)).max(1);
    let start = Start::new(record, options)?;
    let sizes = start.point.channels.iter().map(|c| c.half_widths.len() + c.thresholds.len());
    let needed = sizes.sum::<usize>() + record.outputs().len();
    if record.scored() < needed {
        let purpose = "plays, deadzones and offsets".to_owned();
        return Err(Error::TooFewSamples { samples: record.scored(), needed, purpose });
    }
    // With a gain and a delay nothing is left for more taps to tell.
    let taps = options.taps.unwrap_or(supported.min(affordable));
    let quasi_static = options.delay.is_some() || taps <= 4;
    if quasi_static {
        if let Some(order) = options.order {
            let requirement = format!(
                "the input supports {} taps, which is a gain and a delay; leave the order out",
                supported.min(affordable)
            );
            return Err(Error::parameter("order", order, requirement));
        }
        start.quasi_static(options.delay, supported, progress)
    } else {
        let largest = (1200 / inputs).min(1024).min(supported).min(affordable);
        let taps = options.taps.unwrap_or(largest.min(400));
        let largest = if options.taps.is_some() { taps } else { largest };
        start.dynamic(taps, largest, options.order, supported, progress)
    }
}

/// What all rounds start from.
struct Start<'a> {
    given: &'a Record,
    /// The record without the samples that the plays' unknown past disturbs, and without the mean
    /// of each output.
    record: Record,
    means: Vec<f64>,
    unknown_past: bool,
    half_widths: Grid,
    point: Point,
    notes: Vec<String>,
}

impl<'a> Start<'a> {
    fn new(given: &'a Record, options: &IdentifyOptions) -> Result<Self, Error> {
        let half_widths = options.half_widths.clone().unwrap_or(Grid::Count(24));
        let thresholds = options.thresholds.clone().unwrap_or(Grid::Count(10));
        let inputs = given.inputs().len();
        let ranges: Vec<_> = (0..inputs).map(|input| range(given, input)).collect();
        let mut channels = Vec::new();
        for &(low, high) in &ranges {
            let zones = thresholds.thresholds((low, high))?;
            channels.push(Parameters::identity(zones, half_widths.half_widths(high - low)?));
        }
        let mut notes = Vec::new();
        let mut experiments = given.experiments().to_vec();
        let mut unknown_past = false;
        for (index, experiment) in experiments.iter_mut().enumerate() {
            if starts_at_rest(experiment) || experiment.warmup > 0 {
                continue;
            }
            let mut forgets = channels.iter().enumerate().map(|(input, channel)| {
                let widest = channel.half_widths.iter().copied().fold(0.0, f64::max);
                forgets_at(experiment.input.column(input).iter().copied(), widest)
            });
            let forgets = forgets.try_fold(0, |latest, at| Some(latest.max(at?)));
            match forgets {
                Some(at) if at <= experiment.input.nrows() / 10 => {
                    experiment.warmup = at;
                    notes.push(format!(
                        "experiment {index} starts in motion: its first {at} samples, in which the \
                         plays forget their past, are not scored"
                    ));
                }
                _ => {
                    unknown_past = true;
                    notes.push(format!(
                        "experiment {index} starts in motion and forgets its past late: the plays' \
                         start is fitted"
                    ));
                }
            }
        }
        // An offset far larger than what moves would cost digits.
        let columns = given.experiments()[0].output.column_iter();
        let means: Vec<f64> = columns.map(|column| column.mean()).collect();
        for experiment in &mut experiments {
            for (mut column, mean) in experiment.output.column_iter_mut().zip(&means) {
                column.add_scalar_mut(-mean);
            }
        }
        let starts = experiments
            .iter()
            .map(|e| {
                let start = |(input, c): (usize, &Parameters)| {
                    let value = if unknown_past { e.input[(0, input)] } else { 0.0 };
                    vec![value; c.half_widths.len()]
                };
                channels.iter().enumerate().map(start).collect()
            })
            .collect();
        let record = given.with_experiments(experiments)?;
        let point = Point { channels, starts };
        Ok(Self { given, record, means, unknown_past, half_widths, point, notes })
    }

    /// The linear part is a gain of plus or minus one with the delay that fits best.
    fn quasi_static(
        mut self,
        delay: Option<usize>,
        supported: usize,
        progress: Progress,
    ) -> Result<Identification, Error> {
        const LONGEST_DELAY: usize = 7;
        /// As many states: a longer delay is better cut out of the record.
        const LONGEST_GIVEN: usize = 500;
        if let Some(delay) = delay.filter(|&delay| delay > LONGEST_GIVEN) {
            let requirement = format!("at most {LONGEST_GIVEN} samples; shift the output instead");
            return Err(Error::parameter("delay", delay, requirement));
        }
        let gain = linear::estimate(&self.record, 1, 0.0)?.markov.remove(0);
        let delays = delay.map_or(0..=LONGEST_DELAY, |delay| delay..=delay);
        let derivatives = Derivatives { thresholds: false, starts: self.unknown_past };
        let freedom = Freedom { derivatives, numerator: false };
        let mut rounds = Vec::new();
        let mut best: Option<(usize, f64, Point, StateSpace)> = None;
        for delay in delays {
            report(progress, "delay", delay as f64 / (LONGEST_DELAY + 1) as f64)?;
            let mut linear = StateSpace::delayed_gain(&gain, delay);
            let mut point = self.point.clone();
            rescale(&mut point, &mut linear)?;
            let fitted = fit(point, &linear, &self.record, freedom, 15, progress)?;
            let scored = (self.record.scored() * self.record.outputs().len()) as f64;
            let rms = (fitted.history[fitted.history.len() - 1] / scored).sqrt();
            rounds.push(Round { rms, order: linear.order(), taps: delay + 1 });
            if best.as_ref().is_none_or(|(_, least, ..)| rms < *least) {
                best = Some((delay, rms, fitted.point, linear));
            }
        }
        let Some((delay, _, point, linear)) = best else {
            return Err(Error::parameter("delay", "none", "at least one delay is tried"));
        };
        if supported <= 4 {
            self.notes.push(format!(
                "the input excites {supported} directions per channel only, a gain and a delay: the \
                 linear part is a delay of {delay} samples"
            ));
        }
        let offsets = self.offsets(&point, &linear)?;
        let none = (None, Vec::new(), 0);
        self.finish(point, linear, &offsets, none, supported, Some(delay), rounds)
    }

    /// Hysteresis and dynamics in turn.
    fn dynamic(
        mut self,
        taps: usize,
        largest: usize,
        order: Option<usize>,
        supported: usize,
        progress: Progress,
    ) -> Result<Identification, Error> {
        const ROUNDS: usize = 5;
        /// Further rounds in which the thresholds move too.
        const POLISH: usize = 3;
        /// Levenberg-Marquardt steps a round.
        const STEPS: usize = 6;
        /// A round that lowers the rms by less than this fraction is the last one.
        const GAIN: f64 = 5e-3;
        let mut taps = taps;
        let mut current = dynamics_of(&self.record, &mut taps, largest, order, progress)?;
        let fir = linear::estimate(&self.record, taps, 0.0)?;
        let mut rounds = Vec::new();
        let mut point = self.point.clone();
        let mut best = (current.refit.rms, point.clone(), current.clone());
        let mut polish = false;
        for round in 0..ROUNDS + POLISH {
            report(progress, "rounds", round as f64 / (ROUNDS + POLISH) as f64)?;
            polish |= round == ROUNDS;
            // While placing anew, a round may be worse before the next is better; the polish goes on
            // from the best.
            if polish {
                (point, current) = (best.1.clone(), best.2.clone());
            }
            rescale(&mut point, &mut current.refit.system)?;
            if !polish {
                self.place(&mut point)?;
            }
            let numerator = current.refit.system.order() * self.record.outputs().len() <= 24;
            let derivatives = Derivatives { thresholds: polish, starts: self.unknown_past };
            let freedom = Freedom { derivatives, numerator };
            let linear = &current.refit.system;
            point = fit(point, linear, &self.record, freedom, STEPS, progress)?.point;
            current = dynamics_of(&self.driven(&point)?, &mut taps, largest, order, progress)?;
            let rms = current.refit.rms;
            rounds.push(Round { rms, order: current.refit.system.order(), taps });
            let least = best.0;
            if rms < least {
                best = (rms, point.clone(), current.clone());
            }
            let stalled = rms > (1.0 - GAIN) * least;
            if stalled && round == 0 {
                self.notes.push(format!(
                    "hysteresis at the input hardly helps: training error {rms:.4e} with it, \
                     {least:.4e} without"
                ));
            }
            if stalled && (polish || round == 0) {
                break;
            }
            polish |= stalled;
        }
        let (_, mut point, dynamics) = best;
        let mut linear = dynamics.refit.system;
        rescale(&mut point, &mut linear)?;
        if dynamics.reflected > 0 {
            self.notes.push(format!(
                "{} poles of the realization were unstable and reflected into the unit circle",
                dynamics.reflected
            ));
        }
        let stages = (Some(fir), dynamics.singular_values, dynamics.reflected);
        self.finish(point, linear, &dynamics.refit.offsets, stages, supported, None, rounds)
    }

    /// Spreads counted half-widths over the present span of z; the weights are fitted next anyway.
    fn place(&self, point: &mut Point) -> Result<(), Error> {
        for (input, channel) in point.channels.iter_mut().enumerate() {
            let experiments = self.record.experiments().iter();
            let ranges =
                experiments.map(|e| channel.envelope_range(e.input.column(input).iter().copied()));
            let (low, high) = ranges
                .reduce(|(low, high), next| (low.min(next.0), high.max(next.1)))
                .unwrap_or((0.0, 0.0));
            channel.half_widths = self.half_widths.half_widths(high - low)?;
        }
        Ok(())
    }

    /// The record with u replaced by the hysteresis' output v.
    fn driven(&self, point: &Point) -> Result<Record, Error> {
        let driven = |(experiment, starts): (&Experiment, &Vec<Vec<f64>>)| {
            let mut v = experiment.input.clone();
            let columns = v.as_mut_slice().chunks_exact_mut(experiment.input.nrows());
            for ((channel, start), column) in point.channels.iter().zip(starts).zip(columns) {
                channel.apply(start, column);
            }
            Experiment { input: v, ..experiment.clone() }
        };
        let experiments = self.record.experiments().iter().zip(&point.starts).map(driven);
        self.record.with_experiments(experiments.collect())
    }

    /// Mean of what the model leaves, (experiments, outputs).
    fn offsets(&self, point: &Point, linear: &StateSpace) -> Result<Matrix, Error> {
        let driven = self.driven(point)?;
        let mut offsets = Matrix::zeros(driven.experiments().len(), linear.outputs());
        for (index, experiment) in driven.experiments().iter().enumerate() {
            let mut state = linear.equilibrium(&experiment.input.row(0).transpose());
            let rest = &experiment.output - linear.simulate_from(&mut state, &experiment.input)?;
            let scored = rest.rows(experiment.warmup, rest.nrows() - experiment.warmup);
            offsets.set_row(index, &scored.row_mean());
        }
        Ok(offsets)
    }

    fn finish(
        self,
        point: Point,
        linear: StateSpace,
        offsets: &Matrix,
        (fir, singular_values, reflected): (Option<Fir>, Vec<f64>, usize),
        supported_taps: usize,
        delay: Option<usize>,
        rounds: Vec<Round>,
    ) -> Result<Identification, Error> {
        let hysteresis: Result<_, _> = point.channels.iter().map(Parameters::to_operator).collect();
        let (inputs, outputs) = (self.given.inputs().to_vec(), self.given.outputs().to_vec());
        let experiments = self.record.experiments();
        let weight =
            |e: &Experiment| (e.input.nrows() - e.warmup) as f64 / self.record.scored() as f64;
        let offset = |output: usize| {
            let parts = experiments.iter().enumerate();
            let rest: f64 = parts.map(|(index, e)| weight(e) * offsets[(index, output)]).sum();
            self.means[output] + rest
        };
        let offsets = (0..outputs.len()).map(offset).collect();
        let rate = self.given.rate();
        Ok(Identification {
            model: Model::new(rate, inputs, outputs, hysteresis?, linear, offsets)?,
            fir,
            singular_values,
            reflected,
            supported_taps,
            delay,
            rounds,
            warmups: experiments.iter().map(|e| e.warmup).collect(),
            notes: self.notes,
        })
    }
}

/// G of a record whose input is v, with as many taps as its slowest pole needs.
fn dynamics_of(
    record: &Record,
    taps: &mut usize,
    largest: usize,
    order: Option<usize>,
    progress: Progress,
) -> Result<Dynamics, Error> {
    let mut check = || report(progress, "dynamics", 0.0);
    let found = dynamics::estimate(record, *taps, RIDGE, order, &mut check)?;
    // taps until the slowest pole has decayed to one percent
    let radius = found.refit.system.spectral_radius()?;
    let needed = (0.01_f64.ln() / radius.ln()) as usize;
    if needed > *taps + *taps / 5 && *taps < largest {
        *taps = needed.min(largest);
        return dynamics::estimate(record, *taps, RIDGE, order, &mut check);
    }
    Ok(found)
}

/// Whether all inputs stand at zero for a while before anything moves.
fn starts_at_rest(experiment: &Experiment) -> bool {
    const QUIET: usize = 10;
    let input = &experiment.input;
    let largest = input.amax();
    input.nrows() > QUIET && input.rows(0, QUIET).amax() <= 1e-9 * largest
}

/// Moves the gain of G into the play weights.
fn rescale(point: &mut Point, linear: &mut StateSpace) -> Result<(), Error> {
    for (channel, gain) in point.channels.iter_mut().zip(scale(linear)?) {
        channel.weights.iter_mut().for_each(|weight| *weight *= gain);
    }
    Ok(())
}

/// Gives every column of G a largest DC gain of plus or minus one; returns what was divided by.
fn scale(linear: &mut StateSpace) -> Result<Vec<f64>, Error> {
    let dc = linear.dc_gain()?;
    let mut gains = Vec::new();
    for input in 0..linear.inputs() {
        let gain = dc.column(input).amax();
        let gain = if gain > 0.0 && gain.is_finite() { gain } else { 1.0 };
        linear.scale_input(input, 1.0 / gain);
        gains.push(gain);
    }
    Ok(gains)
}
