//! A line in the spectrum that the input does not drive, such as mains hum, a pump or a vibration.
//!
//! `y += a cos(2 pi f t) + b sin(2 pi f t)`, (E12) in the documentation's theory. The sinusoid
//! `A cos(2 pi f t + phi)` has `a = A cos phi` and `b = -A sin phi`.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Added, Block, Moment, Proposal, Quantity, Situation, Stage, Units};
use crate::Matrix;
use crate::spectrum::{Strongest, near, peak, power};

/// A sinusoid is added: `y += a cos(2 pi f t) + b sin(2 pi f t)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PeriodicDisturbance {
    /// The output to which it is added.
    pub output: usize,
    /// Whether it is a disturbance at the plant's output, before the sensor.
    #[serde(default)]
    pub moves_stage: bool,
    /// f in Hz.
    pub frequency: f64,
    /// a, in the output's unit.
    pub cosine: f64,
    /// b, in the output's unit.
    pub sine: f64,
    /// Length of the record in seconds, which bounds the error of the frequency.
    pub duration: f64,
    /// The span of the output, which scales the steps.
    pub span: f64,
}

impl PeriodicDisturbance {
    pub(super) const NAME: &'static str = "periodic-disturbance";
    pub(super) const WHAT: &'static str =
        "a sinusoidal disturbance of fixed frequency, such as mains hum";
    pub(super) const SYNONYMS: &'static [&'static str] = &[
        "mains",
        "mains hum",
        "hum",
        "ripple",
        "line",
        "tone",
        "50 hz",
        "60 hz",
        "vibration",
        "pump",
        "periodic",
    ];
    pub(super) const STAGE: Stage = Stage::Added;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::Unique;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["lines"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// The line of the residual's spectrum with the largest ratio to its neighbours, and the strongest of those that stand out.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let duration = situation.duration();
        let of_output = |output: usize| {
            let span = situation.span(output);
            let block = move |frequency: f64| {
                let (moves_stage, cosine, sine) = (false, 0.0, 0.0);
                let block = Self { output, moves_stage, frequency, cosine, sine, duration, span };
                Proposal::linear(block, 1..3)
            };
            outstanding(situation, output).into_iter().map(block)
        };
        situation.outputs().flat_map(of_output).collect()
    }
}

/// Lines on either side whose median is the background of a line.
const AROUND: usize = 50;

/// Power over the background from which a line stands out: among a million lines of white noise the largest ratio is 20.
const OUTSTANDING: f64 = 30.0;

/// The frequencies of the residual's line with the largest ratio of its power to the median around it, and of the line with the largest
/// power of those that stand out, interpolated between the lines of a Hann window. A harmonic may stand out more than the fundamental,
/// where the error of the model is smaller.
fn outstanding(situation: &Situation, output: usize) -> Vec<f64> {
    /// A line of fewer periods cannot be told from drift.
    const FEWEST_PERIODS: usize = 20;
    /// Power of a line of the residual over that of the measured output there, at most. By hand: half of the amplitude. A line that the
    /// measured output does not have is one of the model.
    const SHOWN: f64 = 4.0;
    let longest = (0..situation.residuals.len()).max_by_key(|&i| situation.residuals[i].nrows());
    let Some(place) = longest else { return Vec::new() };
    let residual = behind_warmup(situation, place, &situation.residuals[place], output);
    let n = residual.len();
    let power = power(&residual);
    let driven = driven(situation, place, output);
    let measured = measured(situation, place, output);
    let is_driven =
        |line: usize| driven[line] > power[line] || power[line] > SHOWN * measured[line];
    let (mut best, mut strongest): (Option<(f64, usize)>, Option<usize>) = (None, None);
    let mut first = FEWEST_PERIODS;
    // the median of a piece estimates its background
    while first + AROUND < power.len() {
        let last = (first + 2 * AROUND).min(power.len());
        let background = background(&power, (first + AROUND) as f64);
        for line in (first..last).filter(|&line| !is_driven(line)) {
            let ratio = power[line] / background;
            if best.is_none_or(|(most, _)| ratio > most) {
                best = Some((ratio, line));
            }
            if ratio > OUTSTANDING && strongest.is_none_or(|most| power[line] > power[most]) {
                strongest = Some(line);
            }
        }
        first += AROUND;
    }
    let best = best.map(|(_, line)| line);
    // lines of one peak are proposed once
    let other = strongest
        .filter(|&line| best.is_some_and(|best| !near(best as f64, power.len()).contains(&line)));
    let frequency = |line| peak(&power, line) * situation.record.rate() / n as f64;
    best.into_iter().chain(other).map(frequency).collect()
}

/// The power that an error of the model may have at each line. A weaker line is no evidence of a disturbance.
///
/// An error of the model is strong where the displacement is. If the only input has most of its power in one line (a sine, a
/// triangle), it is also strong at the harmonics, and then at many of them: a disturbance at one of them leaves its neighbours weak.
fn driven(situation: &Situation, experiment: usize, output: usize) -> Vec<f64> {
    /// The n-th harmonic of an error of the model is at most this over n of the displacement's fundamental.
    const MISFIT: f64 = 0.02;
    /// Smallest part of the input's power in its strongest line for this. By hand: a triangle has 0.986.
    const MOST: f64 = 0.9;
    /// The same for a comparison of harmonics with each other. By hand: of an input of several parts, one may be a sine.
    const HALF: f64 = 0.5;
    /// The error of the model over the displacement at a line, over the same for the whole signals, at most. By hand: an error
    /// may be larger at one line than on average.
    const CONCENTRATED: f64 = 3.0;
    let of = |signals: &[Matrix], column| {
        behind_warmup(situation, experiment, &signals[experiment], column)
    };
    let displacement = of(situation.displacements, output);
    let residual = of(situation.residuals, output);
    let ratio = CONCENTRATED * (variance(&residual) / variance(&displacement)).sqrt();
    let displacement = power(&displacement);
    let count = displacement.len();
    let part = ratio.clamp(0.0, 1.0).powi(2);
    let mut most: Vec<f64> =
        (0..count).map(|line| part * largest(&displacement, line as f64)).collect();
    let strongest = (situation.drives[experiment].ncols() == 1)
        .then(|| Strongest::of(&power(&of(situation.drives, 0))))
        .flatten();
    let Some(line) = strongest else { return most };
    let mut raise = |place: f64, error: f64| {
        near(place, count).for_each(|line| most[line] = most[line].max(error));
    };
    if line.part > MOST {
        let fundamental = largest(&displacement, line.place);
        for n in 1..=(count as f64 / line.place) as usize {
            raise(n as f64 * line.place, fundamental * (MISFIT / n as f64).powi(2));
        }
    }
    if line.part > HALF {
        for (place, error) in among_harmonics(&power(&residual), line.place, residual.len()) {
            raise(place, error);
        }
    }
    most
}

/// For each harmonic of a line at `fundamental` (in lines) of `samples` values: where it is in the spectrum of the model's error, and the
/// power that it may have there because of the harmonics around it.
///
/// The harmonics of a sampled signal that lie above half of the sampling rate are found below it, too: those up to h times this half
/// are `fundamental / h` lines apart on average. There are none to compare where they are too near together.
fn among_harmonics(errors: &[f64], fundamental: f64, samples: usize) -> Vec<(f64, f64)> {
    /// The n-th harmonic over the largest of the four harmonics around it, at most. By hand: a resonance amplifies it by as much.
    const AMPLIFIED: f64 = 10.0;
    /// Least distance of the harmonics in lines. By hand: nearer together, the peak of a disturbance at one of them would be
    /// counted as an error at the next.
    const APART: f64 = 20.0;
    /// The highest harmonic, over half of the sampling rate. By hand: the harmonics of the kinks at which plays turn fall with the square of
    /// their number, and are weak beyond.
    const HIGHEST: f64 = 4.0;
    if fundamental < APART {
        return Vec::new();
    }
    let count = errors.len() as f64;
    let highest = HIGHEST.min(fundamental / APART);
    let place = |n: usize| {
        let place = (n as f64 * fundamental).rem_euclid(samples as f64);
        place.min(samples as f64 - place)
    };
    let is_fundamental =
        |n: usize| near(fundamental, errors.len()).contains(&(place(n).round() as usize));
    // one that does not stand out is the noise
    let standing = |n: usize| {
        let power = largest(errors, place(n));
        if power > OUTSTANDING * background(errors, place(n)) { power } else { 0.0 }
    };
    let last = (highest * count / fundamental) as usize;
    let errors: Vec<f64> = (0..=last + 2)
        .map(|n| if n < 2 || is_fundamental(n) { 0.0 } else { standing(n) })
        .collect();
    let around = |n: usize| {
        let around = [n.saturating_sub(2), n.saturating_sub(1), n + 1, n + 2];
        around.into_iter().map(|n| errors[n]).fold(0.0, f64::max)
    };
    (1..=last).map(|n| (place(n), AMPLIFIED.powi(2) * around(n))).collect()
}

/// The largest power of the lines that belong to the peak at a place.
fn largest(power: &[f64], place: f64) -> f64 {
    power[near(place, power.len())].iter().copied().fold(0.0, f64::max)
}

/// The median of the power around a place.
fn background(power: &[f64], place: f64) -> f64 {
    let line = place.round() as usize;
    let mut around = power
        [line.saturating_sub(AROUND).min(power.len())..(line + AROUND).min(power.len())]
        .to_vec();
    around.sort_by(f64::total_cmp);
    around.get(around.len() / 2).map_or(f64::INFINITY, |&median| median.max(f64::MIN_POSITIVE))
}

/// The power of the measured output at each line.
fn measured(situation: &Situation, experiment: usize, output: usize) -> Vec<f64> {
    power(&behind_warmup(
        situation,
        experiment,
        &situation.record.experiments()[experiment].output,
        output,
    ))
}

/// A column of a signal of an experiment without its warm-up, in which the unknown initial state may leave a large residual.
fn behind_warmup(
    situation: &Situation,
    experiment: usize,
    signal: &Matrix,
    column: usize,
) -> Vec<f64> {
    let first = situation.record.experiments()[experiment].warmup;
    signal.column(column).iter().skip(first).copied().collect()
}

fn variance(values: &[f64]) -> f64 {
    nalgebra::DVectorView::from_slice(values, values.len()).variance()
}

impl Block for PeriodicDisturbance {
    fn values(&self) -> Vec<f64> {
        vec![self.frequency, self.cosine, self.sine]
    }

    fn set(&mut self, values: &[f64]) {
        (self.frequency, self.cosine, self.sine) = (values[0], values[1], values[2]);
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let reach = 0.3 / self.duration;
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        vec![(self.frequency - reach, self.frequency + reach), free, free]
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-5 / self.duration, 1e-3 * self.span, 1e-3 * self.span]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        vec![
            Quantity::new("frequency", "Hz", self.frequency),
            Quantity::strength("amplitude", units.output, self.cosine.hypot(self.sine)),
            Quantity::new("phase", "rad", (-self.sine).atan2(self.cosine)),
        ]
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("frequency", self.frequency), ("duration", self.duration), ("span", self.span)])
    }
}

impl Added for PeriodicDisturbance {
    fn output(&self) -> usize {
        self.output
    }

    fn moves_stage(&self) -> bool {
        self.moves_stage
    }

    fn set_moves_stage(&mut self, moves_stage: bool) {
        self.moves_stage = moves_stage;
    }

    /// Samples since the phase was computed from the time, its cosine and sine, and those of the phase step
    /// of one sample.
    fn rest(&self, moment: Moment) -> Vec<f64> {
        let (sine, cosine) = (std::f64::consts::TAU * self.frequency / moment.rate).sin_cos();
        vec![0.0, 1.0, 0.0, cosine, sine]
    }

    /// Rotating the phase costs less than a sine; it is computed from the time again before rounding errors
    /// add up.
    fn add(&self, state: &mut [f64], moment: Moment) -> f64 {
        const TURNS: f64 = 64.0;
        if state[0] == 0.0 {
            let phase = std::f64::consts::TAU * self.frequency * moment.time;
            (state[2], state[1]) = phase.sin_cos();
        }
        state[0] = if state[0] + 1.0 < TURNS { state[0] + 1.0 } else { 0.0 };
        let [cosine, sine] = [state[1], state[2]];
        state[1] = cosine * state[3] - sine * state[4];
        state[2] = sine * state[3] + cosine * state[4];
        self.cosine * cosine + self.sine * sine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::OutputKind;
    use crate::linear::Sections;
    use crate::{Channel, Experiment, Matrix, Record};
    use std::f64::consts::TAU;

    /// Frequencies and amplitudes of sines.
    type Sines<'a> = &'a [(f64, f64)];

    /// The frequencies that are proposed where the displacement is a sine of 3 Hz and weaker ones of 7 Hz and 31 Hz, of changing size,
    /// and the residual is white noise with other sines.
    fn proposed(lines: Sines) -> Vec<f64> {
        proposed_behind(0, lines)
    }

    /// The same behind a warm-up of so many samples, in which an unknown initial state leaves a residual as large as the displacement.
    fn proposed_behind(warmup: usize, lines: Sines) -> Vec<f64> {
        proposed_of(&[(3.0, 1.0), (7.0, 0.4), (31.0, 0.1)], warmup, lines, 1.0)
    }

    /// The same for a displacement of other sines, which is the drive, too. Of the residual, the measured output has a part; the rest is
    /// an error of the simulated one.
    fn proposed_of(displaced: Sines, warmup: usize, lines: Sines, measured: f64) -> Vec<f64> {
        let (rate, n) = (200.0, 6000);
        let time = |k: usize| k as f64 / rate;
        let mut random = 11.0;
        let mut noise = || {
            random = (random * 16807.0) % 2_147_483_647.0;
            random / 2_147_483_647.0 - 0.5
        };
        let size = |k: usize| 1.0 + 0.3 * (TAU * 0.08 * time(k)).sin();
        let sines = |k: usize| -> f64 {
            let sine = |(frequency, size): &(f64, f64)| size * (TAU * frequency * time(k)).sin();
            displaced.iter().map(sine).sum()
        };
        let u = Matrix::from_fn(n, 1, |k, _| size(k) * sines(k));
        let sum = |k: usize| -> f64 {
            let line = |(frequency, amplitude): &(f64, f64)| {
                amplitude * (TAU * frequency * time(k) + 7.0 * frequency * frequency).sin()
            };
            lines.iter().map(line).sum()
        };
        let start = |k: usize| if k < warmup { (0.9 * k as f64).sin() } else { 0.0 };
        let residuals = [Matrix::from_fn(n, 1, |k, _| sum(k) + 0.02 * noise() + start(k))];
        let channel = |name| vec![Channel::new(name, "")];
        let output = &u + measured * &residuals[0];
        let run = vec![Experiment { warmup, ..Experiment::new(u.clone(), output) }];
        let record = Record::new(run, rate, channel("u"), channel("y"), vec![]).unwrap();
        let signals = [u];
        let found = PeriodicDisturbance::proposals(&Situation {
            record: &record,
            drives: &signals,
            intermediates: &signals,
            displacements: &signals,
            residuals: &residuals,
            dynamics: &Sections::default(),
            loops: Vec::new(),
            kind: OutputKind::Displacement,
            widest: vec![0.0],
            places: vec![(-1.0, 1.0)],
        });
        found.iter().map(|one| one.block.frequency).collect()
    }

    #[test]
    fn an_error_where_the_displacement_is_strong_is_no_disturbance() {
        let is = |found: &[f64], wanted: f64| (found[0] - wanted).abs() < 0.01;
        // the same error beside the lines of the displacement, and at one of them
        assert!(is(&proposed(&[(11.3, 0.1)]), 11.3));
        assert!(!is(&proposed(&[(3.0, 0.1)]), 3.0));
        // far more than the error that the rest has
        assert!(is(&proposed(&[(7.0, 0.5)]), 7.0));
    }

    #[test]
    fn one_of_many_harmonics_is_no_disturbance() {
        let harmonics: Vec<(f64, f64)> =
            (17..26).map(|n| (3.0 * f64::from(n), 0.05 / (1.0 + f64::from(n % 4)))).collect();
        let beside = |frequency: f64| (frequency / 3.0 - (frequency / 3.0).round()).abs() * 3.0;
        let found = proposed_of(&[(3.0, 1.0)], 0, &harmonics, 1.0);
        assert!(found.iter().all(|&frequency| beside(frequency) > 0.15), "{found:?}");
        // harmonics above half of the sampling rate, 200 Hz, and one of the same places alone
        let folded: Vec<(f64, f64)> =
            (34..46).map(|n| ((3.01 * f64::from(n) - 200.0).abs(), 0.05)).collect();
        let among = |frequency: f64| folded.iter().any(|(own, _)| (own - frequency).abs() < 0.15);
        let found = proposed_of(&[(3.01, 1.0)], 0, &folded, 1.0);
        assert!(found.iter().all(|&frequency| !among(frequency)), "{found:?}");
        let found = proposed_of(&[(3.01, 1.0)], 0, &folded[3..4], 1.0);
        assert!((found[0] - folded[3].0).abs() < 0.01, "{found:?}");
        // lines at harmonics that are too near together to be compared
        let near: Vec<(f64, f64)> = (39..42).map(|n| (0.5 * f64::from(n), 0.05)).collect();
        let found = proposed_of(&[(0.5, 1.0)], 0, &near, 1.0);
        assert!(near.iter().any(|(own, _)| (found[0] - own).abs() < 0.05), "{found:?}");
        // the same line without its neighbours
        let found = proposed_of(&[(3.0, 1.0)], 0, &[(60.0, 0.05)], 1.0);
        assert!((found[0] - 60.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_line_that_was_not_measured_is_no_disturbance() {
        let found = |measured: f64| {
            proposed_of(&[(3.0, 1.0), (7.0, 0.4)], 0, &[(41.3, 0.1)], measured)
                .iter()
                .any(|frequency| (frequency - 41.3).abs() < 0.05)
        };
        assert!(found(1.0));
        assert!(!found(0.1));
    }

    #[test]
    fn what_the_initial_state_leaves_is_no_error_of_the_model() {
        for warmup in [0, 1500] {
            let found = proposed_behind(warmup, &[(31.0, 0.05)]);
            assert!((found[0] - 31.0).abs() < 0.01, "{found:?}");
        }
    }

    #[test]
    fn a_strong_line_is_proposed_beside_one_that_stands_out_more() {
        // an error of the model around the strong line
        let mut lines: Vec<(f64, f64)> =
            (0..120).map(|k| (18.0 + f64::from(k) / 30.0, 0.02)).collect();
        lines.extend([(20.015, 0.4), (60.0, 0.1)]);
        let found = proposed(&lines);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 60.0).abs() < 0.01 && (found[1] - 20.015).abs() < 0.01, "{found:?}");
        assert_eq!(proposed(&[(20.015, 0.4)]).len(), 1);
    }

    #[test]
    fn turning_the_phase_is_as_exact_as_its_sine() {
        let line = PeriodicDisturbance {
            output: 0,
            moves_stage: false,
            frequency: 49.987,
            cosine: 0.3,
            sine: -0.7,
            duration: 60.0,
            span: 1.0,
        };
        let rate = 2000.0;
        let moment = |k: u32| Moment { time: f64::from(k) / rate, rate, covariates: &[] };
        let mut state = line.rest(moment(0));
        for k in 0..120_000 {
            let phase = std::f64::consts::TAU * line.frequency * moment(k).time;
            let exact = 0.3 * phase.cos() - 0.7 * phase.sin();
            // the phase itself is rounded
            let rounding = 1e-13 + 3e-16 * phase;
            assert!((line.add(&mut state, moment(k)) - exact).abs() < rounding, "sample {k}");
        }
    }
}
