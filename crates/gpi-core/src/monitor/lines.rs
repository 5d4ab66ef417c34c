//! Sines in the residual that were not there when the model was made.
//!
//! The residual's power spectrum is averaged over windows of frames of all lengths. Let P be the power at one frequency,
//! averaged over m frames, and F the mean of its neighbours. Without a line, `2 m P / F` has the chi-square distribution of
//! 2 m degrees of freedom. A line exceeds its quantile in two successive windows.

use super::settings::MonitorSettings;
use crate::Error;
use crate::operators::{Merge, Windows};
use crate::spectrum::{peak, power};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Levels of windows of frames.
const LEVELS: usize = 40;

/// Neighbours on each side whose mean is the level without a line, and those next to it that the window of Hann spreads
/// a line to.
const NEIGHBOURS: usize = 12;
const SPREAD: usize = 2;

/// Powers of frames.
#[derive(Clone, Debug)]
struct Spectrum {
    frames: usize,
    /// Of the residual.
    left: Vec<f64>,
    /// Of the model's output.
    predicted: Vec<f64>,
    /// Mean square of the error that is known to be possible, summed over frames.
    known: f64,
}

impl Merge for Spectrum {
    fn merged(&self, later: &Self) -> Self {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self {
            frames: self.frames + later.frames,
            left: sum(&self.left, &later.left),
            predicted: sum(&self.predicted, &later.predicted),
            known: self.known + later.known,
        }
    }
}

/// A line and since when it is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// In parts of the sampling rate.
    pub frequency: f64,
    pub amplitude: f64,
    /// The frame at which the earlier of the two windows that show it begins.
    pub onset: usize,
    /// The frame at which the later one ends.
    pub until: usize,
    /// Its power over that of its neighbours.
    prominence: f64,
}

/// The search for lines in the residual of one output.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    frame: usize,
    left: Vec<f64>,
    predicted: Vec<f64>,
    known: f64,
    windows: Windows<Spectrum, LEVELS>,
    frames: usize,
    /// The probability with which one frequency of one window may exceed its limit by chance.
    chance: f64,
    /// The smallest amplitude that counts.
    least: f64,
    /// The part of the model's own motion that a change of the gain may explain.
    part: f64,
    pub strongest: Option<Line>,
    pub first: Option<usize>,
}

impl Lines {
    /// Frames of so many samples, for noise of a standard deviation; `rate` is the rate of false alarms per frame.
    pub(super) fn new(frame: usize, noise: f64, rate: f64, settings: &MonitorSettings) -> Self {
        // all levels make two tests a frame on average
        let chance = (rate / (2.0 * (frame / 2) as f64)).sqrt();
        Self {
            frame,
            left: Vec::with_capacity(frame),
            predicted: Vec::with_capacity(frame),
            known: 0.0,
            windows: Windows::default(),
            frames: 0,
            chance,
            least: settings.least_line * noise * std::f64::consts::SQRT_2,
            part: settings.least_line,
            strongest: None,
            first: None,
        }
    }

    /// Counts one sample. A frame with a sample that is not finite is left out.
    pub(super) fn add(&mut self, residual: f64, predicted: f64, known: f64) -> Result<(), Error> {
        self.left.push(residual);
        self.predicted.push(predicted);
        self.known += known;
        if self.left.len() < self.frame {
            return Ok(());
        }
        let known = std::mem::take(&mut self.known) / self.frame as f64;
        let is_whole = self.left.iter().all(|value| value.is_finite());
        let own = Spectrum {
            frames: 1,
            left: power(&self.left),
            predicted: power(&self.predicted),
            known,
        };
        self.left.clear();
        self.predicted.clear();
        if is_whole { self.end_frame(own) } else { Ok(()) }
    }

    fn end_frame(&mut self, own: Spectrum) -> Result<(), Error> {
        self.frames += 1;
        let mut pairs = Vec::new();
        self.windows.push(own, |_, earlier, later| pairs.push((earlier.clone(), later.clone())));
        for (earlier, later) in pairs {
            if let Some(line) = self.line_of(&earlier, &later)? {
                self.first = Some(self.first.map_or(line.onset, |first| first.min(line.onset)));
                if self.strongest.is_none_or(|most| line.prominence > most.prominence) {
                    self.strongest = Some(line);
                }
            }
        }
        Ok(())
    }

    /// The most prominent line of two windows, if it exceeds all limits in both.
    fn line_of(&self, earlier: &Spectrum, later: &Spectrum) -> Result<Option<Line>, Error> {
        let freedom = 2.0 * earlier.frames as f64;
        let quantile = ChiSquared::new(freedom)
            .map_err(|error| Error::parameter("frames", freedom, error.to_string()))?
            .inverse_cdf(1.0 - self.chance);
        let limit = quantile / freedom;
        let count = earlier.left.len();
        let prominence = |line: usize| {
            [earlier, later].map(|window| window.left[line] / level(&window.left, line))
        };
        let places = (SPREAD + 1)..count.saturating_sub(SPREAD + 1);
        let best = places
            .map(|line| {
                let [one, two] = prominence(line);
                (line, one.min(two))
            })
            .fold((0, 0.0), |best: (usize, f64), next| if next.1 > best.1 { next } else { best });
        if best.1 <= limit {
            return Ok(None);
        }
        let both = earlier.merged(later);
        // a sine of amplitude A has the power (A n / 4)^2 at its frequency under the window of Hann
        let of_sine = |power: f64| 4.0 * (power / both.frames as f64).sqrt() / self.frame as f64;
        let [amplitude, own] = [&both.left, &both.predicted].map(|power| of_sine(power[best.0]));
        let possible = (2.0 * both.known / both.frames as f64).sqrt();
        let counts = amplitude > self.least.max(possible) && amplitude > self.part * own;
        Ok(counts.then(|| Line {
            frequency: peak(&both.left, best.0) / self.frame as f64,
            amplitude,
            onset: self.frames - both.frames,
            until: self.frames,
            prominence: best.1 * both.frames as f64,
        }))
    }
}

/// The mean power of the neighbours of a frequency.
fn level(power: &[f64], line: usize) -> f64 {
    let low = line.saturating_sub(SPREAD + NEIGHBOURS)..line.saturating_sub(SPREAD);
    let high = line + SPREAD + 1..(line + SPREAD + 1 + NEIGHBOURS).min(power.len());
    let count = (low.len() + high.len()).max(1) as f64;
    let sum: f64 = power[low].iter().chain(&power[high]).sum();
    (sum / count).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(amplitude: f64, motion: f64) -> Lines {
        let mut lines = Lines::new(400, 0.1, 1e-8, &MonitorSettings::default());
        let mut random = 12345_u64;
        for k in 0..40_000 {
            let mut sum = -6.0;
            for _ in 0..12 {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                sum += (random >> 11) as f64 / (1_u64 << 53) as f64;
            }
            let sine = (0.5 * f64::from(k)).sin();
            let there = if k >= 20_000 { amplitude } else { 0.0 };
            lines.add(0.1 * sum + there * sine, motion * sine, 0.0).unwrap();
        }
        lines
    }

    #[test]
    fn a_new_line_is_found() {
        let line = lines(0.08, 0.0).strongest.unwrap();
        assert!((line.frequency - 0.5 / std::f64::consts::TAU).abs() < 2e-4, "{line:?}");
        assert!((line.amplitude - 0.08).abs() < 0.02 && line.onset >= 48, "{line:?}");
    }

    #[test]
    fn noise_weak_lines_and_the_motion_itself_are_none() {
        assert_eq!(lines(0.0, 0.0).strongest, None);
        assert_eq!(lines(0.02, 0.0).strongest, None);
        assert_eq!(lines(0.08, 1.0).strongest, None);
    }
}
