//! Functions of input, intermediate signal, output and time that a residual must not follow.
//!
//! With the simulated output x and the levels of u and v scaled to [-1, 1], s the step of u from sample to sample over
//! its rms, t in [-1, 1] the time, and A the local amplitude of a signal:
//!
//! | family | functions |
//! |---|---|
//! | `past-input`, `past-intermediate` | level, and steps some samples ago, of u or of v |
//! | `level` | x, x^2, .., x^5 |
//! | `speed` | abs(s), s abs(s), s^2, x abs(s); s clipped |
//! | `direction` | sign(s) x^n, n = 0 .. 3 |
//! | `amplitude` | A x of the output, and A s for each input |
//! | `trend` | t, t^2, t^3, sin 6t, cos 6t |
//!
//! The local amplitude is `A = low(( level - low(level))^2)` with the first-order low-pass
//! `low(k) = a low(k-1) + (1 - a) x(k)`, `a = exp(-1 / (seconds rate))`: the power of the part that is faster than the
//! window.

use super::compared::Compared;
use super::outcome::points_to;
use super::policy::ResidualPolicy;
use crate::Matrix;

/// A function of experiment and sample.
pub(super) type Regressor<'a> = Box<dyn Fn(usize, usize) -> f64 + 'a>;

/// Regressors that point to the same effects.
pub(super) struct Family<'a> {
    pub name: &'static str,
    pub points_to: String,
    pub regressors: Vec<Regressor<'a>>,
}

/// One number a sample, `[experiment][sample]`.
pub(super) type Signal = Vec<Vec<f64>>;

/// A signal and its step from sample to sample, both of order one.
pub(super) struct ScaledSignal {
    /// Between minus one and one.
    pub level: Signal,
    /// Over its root mean square.
    pub speed: Signal,
    /// How large the fast changes of the level are.
    pub amplitude: Signal,
}

/// What a residual of one output is compared with.
pub(super) struct ScaledSignals {
    pub inputs: Vec<ScaledSignal>,
    /// The model's v, whose past is what G sees.
    pub intermediates: Vec<ScaledSignal>,
    output: ScaledSignal,
    samples: Vec<usize>,
}

impl ScaledSignals {
    pub(super) fn new(given: &Compared, output: usize) -> Self {
        let window = given.policy.amplitude_seconds * given.record.rate();
        let inputs: Vec<&Matrix> = given.record.experiments().iter().map(|e| &e.input).collect();
        let v: Vec<&Matrix> = given.intermediate.iter().collect();
        let simulated: Vec<&Matrix> = given.simulated.iter().collect();
        let channels = 0..given.record.inputs().len();
        Self {
            inputs: channels
                .clone()
                .map(|input| ScaledSignal::of(&inputs, input, window))
                .collect(),
            intermediates: channels.map(|input| ScaledSignal::of(&v, input, window)).collect(),
            output: ScaledSignal::of(&simulated, output, window),
            samples: inputs.iter().map(|m| m.nrows()).collect(),
        }
    }

    /// The inputs and the simulated output.
    pub(super) fn all(&self) -> Vec<&ScaledSignal> {
        self.inputs.iter().chain([&self.output]).collect()
    }

    /// All families, those of the inputs with the regressors of every input.
    pub(super) fn families<'a>(&'a self, policy: &'a ResidualPolicy) -> Vec<Family<'a>> {
        let x = &self.output.level;
        let mut families = vec![
            Family::new("past-input", ""),
            Family::new("past-intermediate", ""),
            Family::new("level", "envelope"),
            Family::new("speed", ""),
            Family::new("direction", ""),
            Family::new("amplitude", ""),
            Family::new("trend", ""),
        ];
        let [past_input, past_intermediate, level, speed, direction, amplitude, trend] =
            &mut families[..]
        else {
            return families;
        };
        level.powers(x, 1..=5);
        amplitude.regressors.push(Box::new(|e, k| self.output.amplitude[e][k] * x[e][k]));
        for input in &self.inputs {
            past_input.past(input, &policy.past);
            let s = |e: usize, k: usize| input.speed[e][k].clamp(-policy.fastest, policy.fastest);
            speed.regressors.push(Box::new(move |e, k| s(e, k).abs()));
            speed.regressors.push(Box::new(move |e, k| s(e, k) * s(e, k).abs()));
            speed.regressors.push(Box::new(move |e, k| s(e, k) * s(e, k)));
            speed.regressors.push(Box::new(move |e, k| x[e][k] * s(e, k).abs()));
            for power in 0..4 {
                let sign = move |e: usize, k: usize| sign(input.speed[e][k]);
                direction.regressors.push(Box::new(move |e, k| sign(e, k) * x[e][k].powi(power)));
            }
            let size = &self.output.amplitude;
            amplitude.regressors.push(Box::new(move |e, k| size[e][k] * input.speed[e][k]));
        }
        self.intermediates.iter().for_each(|v| past_intermediate.past(v, &policy.past));
        let time = |e: usize, k: usize| 2.0 * k as f64 / self.samples[e] as f64 - 1.0;
        trend.regressors.push(Box::new(time));
        trend.regressors.push(Box::new(move |e, k| time(e, k).powi(2)));
        trend.regressors.push(Box::new(move |e, k| time(e, k).powi(3)));
        trend.regressors.push(Box::new(move |e, k| (6.0 * time(e, k)).sin()));
        trend.regressors.push(Box::new(move |e, k| (6.0 * time(e, k)).cos()));
        families
    }
}

impl<'a> Family<'a> {
    fn new(name: &'static str, otherwise: &str) -> Self {
        Self { name, points_to: points_to(name, otherwise), regressors: Vec::new() }
    }

    /// The level, and steps of the past by these lags.
    fn past(&mut self, signal: &'a ScaledSignal, lags: &[usize]) {
        self.regressors.push(Box::new(|e, k| signal.level[e][k]));
        for &lag in lags {
            self.regressors.push(Box::new(move |e, k| signal.step(e, k, lag)));
        }
    }

    fn powers(&mut self, signal: &'a Signal, powers: impl Iterator<Item = i32>) {
        for power in powers {
            self.regressors.push(Box::new(move |e, k| signal[e][k].powi(power)));
        }
    }
}

impl ScaledSignal {
    fn of(signals: &[&Matrix], column: usize, window: f64) -> Self {
        let values =
            || signals.iter().flat_map(|m| m.column(column).iter().copied().collect::<Vec<_>>());
        let low = values().fold(f64::INFINITY, f64::min);
        let high = values().fold(f64::NEG_INFINITY, f64::max);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(f64::MIN_POSITIVE));
        let scaled = |m: &&Matrix| m.column(column).iter().map(|x| (x - middle) / half).collect();
        let level: Signal = signals.iter().map(scaled).collect();
        let mut speed: Signal = level.iter().map(|x| steps(x)).collect();
        let squares: f64 = speed.iter().flatten().map(|s| s * s).sum();
        let count = speed.iter().map(Vec::len).sum::<usize>() as f64;
        let scale = (squares / count).sqrt().max(f64::MIN_POSITIVE);
        speed.iter_mut().flatten().for_each(|s| *s /= scale);
        let amplitude = level.iter().map(|x| local_amplitude(x, window)).collect();
        Self { level, speed, amplitude }
    }

    /// The level, then the steps so many samples ago.
    pub(super) fn past<'a>(
        &'a self,
        experiment: usize,
        k: usize,
        lags: &'a [usize],
    ) -> impl Iterator<Item = f64> + 'a {
        let steps = lags.iter().map(move |&lag| self.step(experiment, k, lag));
        std::iter::once(self.level[experiment][k]).chain(steps)
    }

    /// The step so many samples ago; zero before the first sample.
    fn step(&self, experiment: usize, k: usize, lag: usize) -> f64 {
        k.checked_sub(lag).map_or(0.0, |past| self.speed[experiment][past])
    }
}

fn steps(x: &[f64]) -> Vec<f64> {
    let first = x.first().map(|_| 0.0);
    first.into_iter().chain(x.windows(2).map(|pair| pair[1] - pair[0])).collect()
}

/// -1, 0 or 1.
pub(super) fn sign(s: f64) -> f64 {
    if s == 0.0 { 0.0 } else { s.signum() }
}

/// The local amplitude of a signal: the square of its fast part, smoothed over so many samples.
fn local_amplitude(signal: &[f64], samples: f64) -> Vec<f64> {
    let keep = (-1.0 / samples.max(1.0)).exp();
    let (mut slow, mut square) = (signal.first().copied().unwrap_or(0.0), 0.0);
    signal
        .iter()
        .map(|&value| {
            slow = keep * slow + (1.0 - keep) * value;
            square = keep * square + (1.0 - keep) * (value - slow).powi(2);
            square
        })
        .collect()
}
