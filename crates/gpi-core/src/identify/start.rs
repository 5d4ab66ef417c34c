//! What every identification starts from: the grids, the past, the training data.

use super::Grid;
use super::hysteresis::{forgets_at, range};
use super::identification::{Identification, IdentifyOptions, Round};
use super::linearization::Point;
use super::sensitivity::Parameters;
use crate::linear::{Fir, StateSpace};
use crate::{Error, Experiment, Matrix, Model, Record};

/// What all rounds start from.
pub(super) struct Start<'a> {
    given: &'a Record,
    /// The record without the samples that the plays' unknown past disturbs, and without the mean
    /// of each output.
    pub(super) record: Record,
    means: Vec<f64>,
    pub(super) unknown_past: bool,
    pub(super) half_widths: Grid,
    pub(super) point: Point,
    pub(super) notes: Vec<String>,
}

impl<'a> Start<'a> {
    /// Places the grids and finds out which past is known.
    pub(super) fn new(given: &'a Record, options: &IdentifyOptions) -> Result<Self, Error> {
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

    /// Spreads counted half-widths over the present span of z; the weights are fitted next anyway.
    pub(super) fn place(&self, point: &mut Point) -> Result<(), Error> {
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
    pub(super) fn driven(&self, point: &Point) -> Result<Record, Error> {
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

    /// Runs the model free over the training data: root mean square of what is left, with the mean
    /// of each experiment, (experiments, outputs), taken out.
    pub(super) fn free_run(
        &self,
        point: &Point,
        linear: &StateSpace,
    ) -> Result<(f64, Matrix), Error> {
        let driven = self.driven(point)?;
        let mut offsets = Matrix::zeros(driven.experiments().len(), linear.outputs());
        let mut squares = 0.0;
        for (index, experiment) in driven.experiments().iter().enumerate() {
            let mut state = linear.equilibrium(&experiment.input.row(0).transpose());
            let rest = &experiment.output - linear.simulate_from(&mut state, &experiment.input)?;
            let scored = rest.rows(experiment.warmup, rest.nrows() - experiment.warmup);
            let means = scored.row_mean();
            for (column, mean) in scored.column_iter().zip(means.iter()) {
                squares += column.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
            }
            offsets.set_row(index, &means);
        }
        let count = (self.record.scored() * linear.outputs()) as f64;
        Ok(((squares / count).sqrt(), offsets))
    }

    /// The model and what it rests on.
    pub(super) fn finish(
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

/// Whether all inputs stand at zero for a while before anything moves.
fn starts_at_rest(experiment: &Experiment) -> bool {
    const QUIET: usize = 10;
    let input = &experiment.input;
    let largest = input.amax();
    input.nrows() > QUIET && input.rows(0, QUIET).amax() <= 1e-9 * largest
}

/// Moves the gain of G into the play weights.
pub(super) fn rescale(point: &mut Point, linear: &mut StateSpace) -> Result<(), Error> {
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
