//! What every fit starts from: the initial state of each experiment, and outputs without their means.
//!
//! A play of half-width r holds its output within `z(k) - r <= F(k) <= z(k) + r`. From the first sample k* at which
//! `max z - min z >= 2 r`, its output no longer depends on F(-1), because it has touched both bounds. Where the
//! inputs are zero at first, the actuator starts at rest and the initial state is known. Elsewhere it is unknown:
//!
//! - If all plays lose it early (k* is at most a tenth of the experiment), and z reaches as far behind k* as in the whole
//!   experiment, the samples before k* are not scored. Where the amplitude decays, these samples alone show the widest plays.
//! - Otherwise `F(-1) = z(0) + s r` with `-1 <= s <= 1` is fitted, one s for each play.
//!
//! In both cases the state of G (one vector for each experiment, as long as the order) is fitted as well.

use crate::chain::hysteresis::Parameters;
use crate::chain::point::{Past, Point};
use crate::effects::{Drives, PlaceMut, Sees};
use crate::fit::Grid;
use crate::fit::model_sections::sections_of;
use crate::fit::settings::{FitSettings, PreparationSettings};
use crate::linear::Sections;
use crate::{Error, Experiment, Intersample, Matrix, Model, Record};

/// A record made ready, and hysteresis parameters to start from.
#[derive(Clone)]
pub(crate) struct Prepared<'a> {
    pub given: &'a Record,
    /// The record without the samples that the plays' unknown initial state disturbs, and without the
    /// mean of each output.
    pub record: Record,
    pub means: Vec<f64>,
    /// Of each experiment: whether the initial state of its plays is to be fitted.
    pub has_unknown_plays: Vec<bool>,
    /// Of each experiment: whether its initial state is unknown, so that the state of G is to be fitted.
    pub has_unknown_state: Vec<bool>,
    pub channels: Vec<Parameters>,
    pub notes: Vec<String>,
    pub settings: FitSettings,
}

impl<'a> Prepared<'a> {
    /// Finds out which initial states are known. Samples that depend on an unknown initial state of the plays are left
    /// out of the score where they are few.
    pub(crate) fn new(given: &'a Record, channels: Vec<Parameters>) -> Result<Self, Error> {
        Self::with_settings(given, channels, FitSettings::default())
    }

    /// The same with all unknown initial states to be fitted, and all samples scored.
    pub(crate) fn scoring_all(given: &'a Record, channels: Vec<Parameters>) -> Result<Self, Error> {
        let mut settings = FitSettings::default();
        settings.preparation.forgetting = 0.0;
        Self::with_settings(given, channels, settings)
    }

    /// The same, and no experiment begins at rest.
    pub(crate) fn in_motion(given: &'a Record, channels: Vec<Parameters>) -> Result<Self, Error> {
        let mut settings = FitSettings::default();
        settings.preparation.forgetting = 0.0;
        // no input is zero for longer
        settings.preparation.quiet = given.longest();
        Self::with_settings(given, channels, settings)
    }

    fn with_settings(
        given: &'a Record,
        channels: Vec<Parameters>,
        settings: FitSettings,
    ) -> Result<Self, Error> {
        settings.validate()?;
        let fraction = settings.preparation.forgetting;
        let mut notes = Vec::new();
        let mut experiments = given.experiments().to_vec();
        let mut has_unknown_plays = vec![false; experiments.len()];
        let mut has_unknown_state = vec![false; experiments.len()];
        for (index, experiment) in experiments.iter_mut().enumerate() {
            // A warm-up ends the effect of the initial state, but not where plays are wider than the input's range.
            let is_hidden = experiment.warmup > 0 && fraction > 0.0;
            if is_quiet_at_first(experiment, &settings.preparation) || is_hidden {
                continue;
            }
            has_unknown_state[index] = true;
            let mut forgets = channels.iter().enumerate().map(|(input, channel)| {
                let widest = channel.half_widths.iter().copied().fold(0.0, f64::max);
                let mut previous = 0.0;
                let u = experiment.input.column(input).into_owned();
                let z = u.iter().map(|&u| channel.envelope(std::mem::replace(&mut previous, u), u));
                let z: Vec<f64> = z.collect();
                let at = forgets_at(&z, widest)?;
                (span(&z[at..]) >= settings.preparation.reach * span(&z)).then_some(at)
            });
            let forgets = forgets.try_fold(0, |latest, at| Some(latest.max(at?)));
            match forgets {
                Some(at) if (at as f64) < fraction * experiment.input.nrows() as f64 => {
                    experiment.warmup = at;
                    for held in &mut experiment.held_out {
                        held.start = held.start.max(at);
                    }
                    experiment.held_out.retain(|held| !held.is_empty());
                    notes.push(format!(
                        "experiment {index} has an unknown initial state: its first {at} samples, in which \
                         the plays depend on it, are not scored"
                    ));
                }
                _ => {
                    has_unknown_plays[index] = true;
                    notes.push(format!(
                        "experiment {index} has an unknown initial state, and the samples that depend on it are many or \
                         the only ones of their amplitude: the initial state of the plays is fitted"
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
        Ok(Self {
            given,
            record,
            means,
            has_unknown_plays,
            has_unknown_state,
            channels,
            notes,
            settings,
        })
    }

    /// The prepared hysteresis before given dynamics.
    pub(crate) fn point(&self, dynamics: Sections) -> Point {
        let past = |&has_unknown_state: &bool| Past {
            has_unknown_state,
            ..Past::rest(dynamics.order(), self.means.len())
        };
        let pasts: Vec<Past> = self.has_unknown_state.iter().map(past).collect();
        let offsets = vec![Matrix::zeros(1, self.means.len()); pasts.len()];
        let channels = self.channels.clone();
        let (effects, rate) = (Vec::new(), self.record.rate());
        let intersample = Intersample::default();
        let mut point = Point { channels, dynamics, intersample, effects, rate, pasts, offsets };
        self.settle(&mut point);
        point
    }

    /// The dynamics and effects of a model behind the prepared hysteresis, the gain in the plays.
    pub(crate) fn point_of(&self, model: &Model) -> Result<Point, Error> {
        let (dynamics, effects) = sections_of(model)?;
        let mut point = self.point(dynamics);
        point.intersample = model.intersample();
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

    /// Sets the initial state of the plays: at rest, or at z where it is unknown.
    pub(crate) fn settle(&self, point: &mut Point) {
        let at_z = || point.channels.iter().map(|c| vec![0.0; c.half_widths.len()]).collect();
        for (past, &unknown) in point.pasts.iter_mut().zip(&self.has_unknown_plays) {
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

    /// Runs the model free over the training data: root mean square residual. The point's
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

/// The first sample from which no play remembers its start: z has spanned twice the widest half-width.
fn forgets_at(z: &[f64], widest: f64) -> Option<usize> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    z.iter().position(|&value| {
        (low, high) = (low.min(value), high.max(value));
        high - low >= 2.0 * widest
    })
}

fn span(z: &[f64]) -> f64 {
    let (low, high) = z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
        (low.min(value), high.max(value))
    });
    high - low
}

/// Refuses a model whose channels or rate are not those of a record.
pub(crate) fn require_match(model: &Model, record: &Record) -> Result<(), Error> {
    let inputs = (("model", model.inputs().len()), ("record", record.inputs().len()));
    let outputs = (("model", model.outputs().len()), ("record", record.outputs().len()));
    Error::require_equal("inputs", inputs.0, inputs.1)?;
    Error::require_equal("outputs", outputs.0, outputs.1)?;
    if (model.rate() / record.rate() - 1.0).abs() > 1e-6 {
        let requirement = format!("the model runs at {} Hz; resample the record", model.rate());
        return Err(Error::parameter("rate", record.rate(), requirement));
    }
    Ok(())
}

/// Whether all inputs are zero for a while before anything moves.
pub(crate) fn starts_at_rest(experiment: &Experiment) -> bool {
    is_quiet_at_first(experiment, &PreparationSettings::default())
}

fn is_quiet_at_first(experiment: &Experiment, settings: &PreparationSettings) -> bool {
    let &PreparationSettings { quiet, zero, .. } = settings;
    let input = &experiment.input;
    let largest = input.amax();
    input.nrows() > quiet && input.rows(0, quiet).amax() <= zero * largest
}

/// Moves the gain of G into the play weights.
pub(crate) fn rescale(point: &mut Point) {
    let gains = point.dynamics.normalize_gain();
    for (channel, gain) in point.channels.iter_mut().zip(&gains) {
        channel.weights.iter_mut().for_each(|weight| *weight *= gain);
    }
    let rate = point.rate;
    for effect in &mut point.effects {
        if let PlaceMut::Parallel(own) = effect.place_mut() {
            let (gain, mut sections) = (gains[own.input()], own.sections(rate));
            sections.iter_mut().flat_map(|(_, b)| b).for_each(|b| *b /= gain);
            own.set_sections(&sections, rate);
        }
        let PlaceMut::Loops(closed) = effect.place_mut() else { continue };
        for inner in closed.loops_mut() {
            if let Sees::Mixture { inputs, .. } = &mut inner.sees {
                inputs.iter_mut().zip(&gains).for_each(|(seen, gain)| *seen /= gain);
            }
            if let Drives::Input { input, force, .. } = &mut inner.drives {
                *force *= gains[*input];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;
    use crate::chain::hysteresis::{Elements, Prior};
    use crate::operators::Reading;

    /// A record that begins in motion, of an input u.
    fn moving(u: Vec<f64>, held_out: Vec<std::ops::Range<usize>>) -> Record {
        let samples = u.len();
        let input = Matrix::from_vec(samples, 1, u);
        let run = Experiment { held_out, ..Experiment::new(input.clone(), input) };
        let (inputs, outputs) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        Record::new(vec![run], 100.0, inputs, outputs, vec![]).unwrap()
    }

    /// Two plays, the wider one of half-width 1.
    fn plays() -> Vec<Parameters> {
        vec![Parameters {
            elements: Elements::Plays,
            reading: Reading::OneSided,
            thresholds: vec![0.0],
            slopes: vec![1.0],
            half_widths: vec![0.0, 1.0],
            weights: vec![1.0, 0.5],
            prior: Prior::default(),
        }]
    }

    #[test]
    fn the_only_samples_of_the_largest_amplitude_are_scored() {
        let sine = |decay: f64| {
            let at =
                move |k: i32| 2.0 * (-decay * f64::from(k)).exp() * (0.1 * f64::from(k + 5)).sin();
            moving((0..2000).map(at).collect(), vec![])
        };
        for (decay, is_fitted) in [(0.0, false), (1e-3, true)] {
            let record = sine(decay);
            let prepared = Prepared::new(&record, plays()).unwrap();
            assert_eq!(prepared.has_unknown_plays, [is_fitted]);
            assert_eq!(prepared.record.experiments()[0].warmup == 0, is_fitted);
        }
    }

    #[test]
    fn held_out_ranges_end_where_they_did_and_begin_after_the_warm_up() {
        // plays of half-width 1 have touched both bounds after half a period of this sine, in motion from the start
        let u: Vec<f64> = (0..400).map(|k| 2.0 * (0.1 * f64::from(k + 5)).sin()).collect();
        let record = moving(u, vec![0..4, 6..60, 200..250]);
        let prepared = Prepared::new(&record, plays()).unwrap();
        let own = &prepared.record.experiments()[0];
        assert!((7..40).contains(&own.warmup), "{}", own.warmup);
        assert_eq!(own.held_out, [own.warmup..60, 200..250]);
        assert!(own.scored_runs().flatten().all(|k| !(0..60).contains(&k)));
    }
}
