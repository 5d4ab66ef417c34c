//! What every fit starts from: the past of each experiment, and outputs without their means.

use crate::chain::hysteresis::Parameters;
use crate::chain::point::{Past, Point};
use crate::effects::{PlaceMut, Sees};
use crate::fit::Grid;
use crate::fit::hysteresis::forgets_at;
use crate::fit::model_sections::sections_of;
use crate::linear::Sections;
use crate::{Error, Experiment, Matrix, Model, Record};
use nalgebra::DVector;

/// A record made ready, and hysteresis parameters to start from.
pub(crate) struct Prepared<'a> {
    pub given: &'a Record,
    /// The record without the samples that the plays' unknown past disturbs, and without the mean
    /// of each output.
    pub record: Record,
    pub means: Vec<f64>,
    /// Of each experiment: whether the start of its plays is to be fitted.
    pub unknown_past: Vec<bool>,
    /// Of each experiment: whether it began in motion, so that the state of G is to be fitted.
    pub moving: Vec<bool>,
    pub channels: Vec<Parameters>,
    pub notes: Vec<String>,
}

impl<'a> Prepared<'a> {
    /// Finds out which past is known. Samples in which the plays forget an unknown past are left out
    /// of the score where they are few.
    pub(crate) fn new(given: &'a Record, channels: Vec<Parameters>) -> Result<Self, Error> {
        Self::with_forgetting(given, channels, 0.1)
    }

    /// The same with all starts in motion to be fitted, and all samples scored.
    pub(crate) fn scoring_all(given: &'a Record, channels: Vec<Parameters>) -> Result<Self, Error> {
        Self::with_forgetting(given, channels, 0.0)
    }

    /// `fraction` of an experiment may be left out.
    fn with_forgetting(
        given: &'a Record,
        channels: Vec<Parameters>,
        fraction: f64,
    ) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let mut experiments = given.experiments().to_vec();
        let mut unknown_past = vec![false; experiments.len()];
        let mut moving = vec![false; experiments.len()];
        for (index, experiment) in experiments.iter_mut().enumerate() {
            // A warm-up is there to hide the past, but where plays stick it never ends.
            let is_hidden = experiment.warmup > 0 && fraction > 0.0;
            if starts_at_rest(experiment) || is_hidden {
                continue;
            }
            moving[index] = true;
            let mut forgets = channels.iter().enumerate().map(|(input, channel)| {
                let widest = channel.half_widths.iter().copied().fold(0.0, f64::max);
                let mut previous = 0.0;
                let u = experiment.input.column(input).into_owned();
                let z = u.iter().map(|&u| channel.envelope(std::mem::replace(&mut previous, u), u));
                forgets_at(z, widest)
            });
            let forgets = forgets.try_fold(0, |latest, at| Some(latest.max(at?)));
            match forgets {
                Some(at) if (at as f64) < fraction * experiment.input.nrows() as f64 => {
                    experiment.warmup = at;
                    experiment.held_out.retain(|held| held.start >= at);
                    notes.push(format!(
                        "experiment {index} starts in motion: its first {at} samples, in which the \
                         plays forget their past, are not scored"
                    ));
                }
                _ => {
                    unknown_past[index] = true;
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
        let record = given.with_experiments(experiments)?;
        Ok(Self { given, record, means, unknown_past, moving, channels, notes })
    }

    /// The prepared hysteresis before given dynamics.
    pub(crate) fn point(&self, dynamics: Sections) -> Point {
        let state = DVector::zeros(dynamics.order());
        let past = |&moving: &bool| Past { plays: None, moving, state: state.clone() };
        let pasts: Vec<Past> = self.moving.iter().map(past).collect();
        let offsets = vec![Matrix::zeros(1, self.means.len()); pasts.len()];
        let channels = self.channels.clone();
        let (effects, rate) = (Vec::new(), self.record.rate());
        let mut point = Point { channels, dynamics, effects, rate, pasts, offsets };
        self.settle(&mut point);
        point
    }

    /// The dynamics and effects of a model behind the prepared hysteresis, the gain in the plays.
    pub(crate) fn point_of(&self, model: &Model) -> Result<Point, Error> {
        let (dynamics, effects) = sections_of(model)?;
        let point = self.point(dynamics);
        let mut point = effects.into_iter().fold(point, |point, effect| point.with_effect(effect));
        rescale(&mut point);
        Ok(point)
    }

    /// Spreads counted half-widths over the present span of z; the weights are fitted next anyway.
    pub(crate) fn place(&self, point: &mut Point, half_widths: &Grid) -> Result<(), Error> {
        let spans = self.spans(point);
        for (channel, span) in point.channels.iter_mut().zip(spans) {
            channel.half_widths = half_widths.half_widths(span)?;
        }
        Ok(())
    }

    /// The span of z of each input.
    pub(crate) fn spans(&self, point: &Point) -> Vec<f64> {
        let span = |(input, channel): (usize, &Parameters)| {
            let experiments = self.record.experiments().iter();
            let ranges =
                experiments.map(|e| channel.envelope_range(e.input.column(input).iter().copied()));
            let (low, high) = ranges
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), next| {
                    (low.min(next.0), high.max(next.1))
                });
            high - low
        };
        point.channels.iter().enumerate().map(span).collect()
    }

    /// Starts the plays anew: from rest, or where the past is unknown at z.
    pub(crate) fn settle(&self, point: &mut Point) {
        let at_z = || point.channels.iter().map(|c| vec![0.0; c.half_widths.len()]).collect();
        for (past, &unknown) in point.pasts.iter_mut().zip(&self.unknown_past) {
            past.plays = unknown.then(at_z);
        }
    }

    /// How many output values are scored.
    pub(crate) fn values(&self) -> f64 {
        (self.record.scored() * self.means.len()) as f64
    }

    /// The record with u replaced by the hysteresis' output v.
    pub(crate) fn driven(&self, point: &Point) -> Result<Record, Error> {
        let driven = |(experiment, past): (&Experiment, &Past)| {
            let input = point.intermediate(&experiment.input, past);
            Experiment { input, ..experiment.clone() }
        };
        let experiments = self.record.experiments().iter().zip(&point.pasts).map(driven);
        self.record.with_experiments(experiments.collect())
    }

    /// Runs the model free over the training data: root mean square of what is left. The point's
    /// offsets become those that fit best.
    pub(crate) fn free_run(&self, point: &mut Point) -> Result<f64, Error> {
        let mut squares = 0.0;
        let residuals = point.residuals(&self.record)?;
        for (index, experiment) in self.record.experiments().iter().enumerate() {
            let runs: Vec<_> = experiment.scored_rows(&residuals[index]).collect();
            let count = experiment.scored() as f64;
            let none = nalgebra::RowDVector::zeros(self.means.len());
            let means = runs.iter().fold(none, |sum, run| sum + run.row_sum()) / count;
            for run in &runs {
                for (column, mean) in run.column_iter().zip(means.iter()) {
                    squares += column.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
                }
            }
            for mut knot in point.offsets[index].row_iter_mut() {
                knot += &means;
            }
        }
        Ok((squares / self.values()).sqrt())
    }
}

/// Whether all inputs stand at zero for a while before anything moves.
pub(crate) fn starts_at_rest(experiment: &Experiment) -> bool {
    const QUIET: usize = 10;
    let input = &experiment.input;
    let largest = input.amax();
    input.nrows() > QUIET && input.rows(0, QUIET).amax() <= 1e-9 * largest
}

/// Moves the gain of G into the play weights.
pub(crate) fn rescale(point: &mut Point) {
    let gains = point.dynamics.normalize_gain();
    for (channel, gain) in point.channels.iter_mut().zip(&gains) {
        channel.weights.iter_mut().for_each(|weight| *weight *= gain);
    }
    for effect in &mut point.effects {
        let PlaceMut::Loops(closed) = effect.place_mut() else { continue };
        for inner in closed.loops_mut() {
            if let Sees::Mixture { inputs, .. } = &mut inner.sees {
                inputs.iter_mut().zip(&gains).for_each(|(seen, gain)| *seen /= gain);
            }
        }
    }
}
