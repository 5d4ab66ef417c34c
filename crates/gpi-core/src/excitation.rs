//! Excitation signals for experiments: multisine, pseudo-random binary signal, decaying triangle, held steps.
//!
//! Every generator returns one value per sample within `range`, in the unit of the drive, and limits the slope to `slew`
//! units per second if it is given.

use crate::Error;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A frequency may miss a grid point by this fraction of a grid step and still count as on it: far above the rounding of
/// the quotient of two frequencies, and far below a step.
const ON_GRID: f64 = 1e-9;

/// Parameters that all excitation signals share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Number of samples.
    pub samples: usize,
    /// Sampling rate in Hz.
    pub rate: f64,
    /// Smallest and largest value, in the unit of the drive.
    pub range: (f64, f64),
    /// Largest slope in units per second; unlimited if `None`.
    pub slew: Option<f64>,
}

/// The excited frequency lines of a [`multisine`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lines {
    /// Every line in the band.
    #[default]
    All,
    /// Odd multiples of the fundamental frequency: even nonlinearities then appear on the even lines.
    Odd,
    /// Odd lines without one line in each group of four, chosen at random: odd nonlinearities then appear on the lines
    /// that are left out.
    OddWithDetection,
}

impl Drive {
    fn validate(&self) -> Result<(), Error> {
        Error::require(self.samples >= 2, "samples", self.samples, "at least 2 are needed")?;
        Error::require_positive("rate", self.rate, "the rate in Hz must be positive")?;
        let (low, high) = self.range;
        let rises = low.is_finite() && high.is_finite() && low < high;
        let requirement = "its first value must be the smaller one";
        Error::require(rises, "range", format!("({low}, {high})"), requirement)?;
        let slew = self.slew.unwrap_or(1.0);
        Error::require_positive("slew", slew, "the slope limit must be positive")
    }

    /// Scales a signal to the range, then limits its slope.
    fn fit(&self, mut signal: Vec<f64>) -> Vec<f64> {
        let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
        let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (bottom, top) = self.range;
        for value in &mut signal {
            *value = bottom + (top - bottom) * (*value - low) / (high - low);
        }
        self.limited(signal)
    }

    /// The signal with its slope limited to `slew`.
    fn limited(&self, mut signal: Vec<f64>) -> Vec<f64> {
        if let (Some(slew), Some(&first)) = (self.slew, signal.first()) {
            let (step, mut previous) = (slew / self.rate, first);
            for value in &mut signal {
                *value = value.clamp(previous - step, previous + step);
                previous = *value;
            }
        }
        signal
    }
}

/// A random-phase multisine: one period of `samples`, with equal amplitudes on the lines of `band` (Hz).
///
/// `u(k) = sum_l cos(2 pi l k / samples + phi_l)` with phases uniform in [0, 2 pi), scaled to the range. Its period is
/// its length. A slew limit clips slopes and thereby adds harmonics.
///
/// ```
/// use gpi_core::excitation::{Drive, Lines, multisine};
/// let drive = Drive { samples: 1000, rate: 1000.0, range: (0.0, 10.0), slew: None };
/// let u = multisine(&drive, (1.0, 100.0), Lines::Odd, 7)?;
/// assert!(u.iter().all(|value| (0.0..=10.0).contains(value)));
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A parameter is out of its range, or the band holds no line.
pub fn multisine(
    drive: &Drive,
    band: (f64, f64),
    lines: Lines,
    seed: u64,
) -> Result<Vec<f64>, Error> {
    drive.validate()?;
    let (low, high) = band;
    let nyquist = drive.rate / 2.0;
    let is_band = low >= 0.0 && low <= high && high < nyquist;
    let requirement = format!("must rise and lie between 0 and {nyquist} Hz");
    Error::require(is_band, "band", format!("({low}, {high})"), requirement)?;
    let spacing = drive.rate / drive.samples as f64;
    let first = ((low / spacing - ON_GRID).ceil() as usize).max(1);
    let last = (high / spacing + ON_GRID).floor() as usize;
    let mut noise = Noise::new(seed);
    let mut spectrum = vec![Complex64::new(0.0, 0.0); drive.samples];
    let (mut excited, mut odd, mut skipped) = (0, 0, 0);
    for line in first..=last {
        let is_odd = line % 2 == 1;
        if lines != Lines::All && !is_odd {
            continue;
        }
        if odd % 4 == 0 {
            skipped = (4.0 * noise.uniform()) as usize;
        }
        odd += 1;
        if lines == Lines::OddWithDetection && (odd - 1) % 4 == skipped {
            continue;
        }
        spectrum[line] = Complex64::from_polar(1.0, TAU * noise.uniform());
        excited += 1;
    }
    let requirement = format!("must contain a spectral line; the lines are {spacing} Hz apart");
    Error::require(excited > 0, "band", format!("({low}, {high})"), requirement)?;
    rustfft::FftPlanner::new().plan_fft_inverse(drive.samples).process(&mut spectrum);
    Ok(drive.fit(spectrum.iter().map(|value| value.re).collect()))
}

/// A pseudo-random binary signal that may switch every `1 / clock` seconds (clock in Hz).
///
/// The bits are those of a maximum-length shift register of 31 bits.
///
/// ```
/// use gpi_core::excitation::{Drive, prbs};
/// let drive = Drive { samples: 1000, rate: 1000.0, range: (0.0, 10.0), slew: None };
/// assert!(prbs(&drive, 100.0, 7)?.iter().all(|&value| value == 0.0 || value == 10.0));
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A parameter is out of its range, or there are too few samples for the signal to switch.
pub fn prbs(drive: &Drive, clock: f64, seed: u64) -> Result<Vec<f64>, Error> {
    drive.validate()?;
    let requirement = format!("must lie between 0 and the rate, {} Hz", drive.rate);
    Error::require(clock > 0.0 && clock <= drive.rate, "clock", clock, requirement)?;
    let mut register = (Noise::new(seed).next() as u32 & 0x7fff_ffff).max(1);
    let mut bits = Vec::new();
    let signal: Vec<f64> = (0..drive.samples)
        .map(|k| {
            let index = (k as f64 * clock / drive.rate + ON_GRID) as usize;
            while bits.len() <= index {
                // x^31 + x^28 + 1 is primitive: the sequence repeats after 2^31 - 1 bits.
                let bit = ((register >> 30) ^ (register >> 27)) & 1;
                register = ((register << 1) | bit) & 0x7fff_ffff;
                bits.push(f64::from(bit));
            }
            bits[index]
        })
        .collect();
    let switches = signal.iter().any(|&value| value != signal[0]);
    let requirement = format!("too slow to switch within {} samples", drive.samples);
    Error::require(switches, "clock", clock, requirement)?;
    Ok(drive.fit(signal))
}

/// A triangle of `frequency` Hz that starts at the middle of the range and whose amplitude falls linearly to zero after
/// the first peak: it gives nested hysteresis loops, the largest first.
///
/// ```
/// use gpi_core::excitation::{Drive, decaying_triangle};
/// let drive = Drive { samples: 1000, rate: 1000.0, range: (0.0, 10.0), slew: None };
/// assert_eq!(decaying_triangle(&drive, 5.0)?[0], 5.0);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A parameter is out of its range, or the signal has less than one period.
pub fn decaying_triangle(drive: &Drive, frequency: f64) -> Result<Vec<f64>, Error> {
    drive.validate()?;
    let periods = drive.samples as f64 * frequency / drive.rate;
    let (nyquist, samples) = (drive.rate / 2.0, drive.samples);
    let requirement =
        format!("must lie below {nyquist} Hz and give at least one period in {samples} samples");
    let is_whole = frequency > 0.0 && frequency < nyquist && periods >= 1.0;
    Error::require(is_whole, "frequency", frequency, requirement)?;
    let (low, high) = drive.range;
    let (middle, amplitude) = (f64::midpoint(low, high), (high - low) / 2.0);
    let signal = (0..drive.samples)
        .map(|k| {
            let phase = k as f64 * frequency / drive.rate;
            let triangle = 1.0 - 4.0 * ((phase + 0.25).fract() - 0.5).abs();
            // full amplitude until the first peak, zero at the end
            let envelope = ((periods - phase) / (periods - 0.25)).min(1.0);
            middle + amplitude * triangle * envelope
        })
        .collect();
    Ok(drive.limited(signal))
}

/// Four constant levels, each for a quarter of the time: the low end of the range, the high end, the middle, and the low
/// end again.
///
/// Constant input separates slow effects: creep follows each step, a drift does not, and a gain drift is visible only
/// away from zero.
///
/// ```
/// use gpi_core::excitation::{Drive, held_steps};
/// let drive = Drive { samples: 4, rate: 1.0, range: (0.0, 10.0), slew: None };
/// assert_eq!(held_steps(&drive)?, [0.0, 10.0, 5.0, 0.0]);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// A parameter is out of its range, or there are fewer than four samples.
pub fn held_steps(drive: &Drive) -> Result<Vec<f64>, Error> {
    drive.validate()?;
    let requirement = "at least 4 are needed, one for each level";
    Error::require(drive.samples >= 4, "samples", drive.samples, requirement)?;
    let (low, high) = drive.range;
    let levels = [low, high, f64::midpoint(low, high), low];
    Ok(drive.limited((0..drive.samples).map(|k| levels[4 * k / drive.samples]).collect()))
}

/// Reproducible random numbers (SplitMix64), the same on every platform.
struct Noise(u64);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive = Drive { samples: 2000, rate: 1000.0, range: (-1.0, 3.0), slew: None };

    fn amplitude(signal: &[f64], line: usize) -> f64 {
        let turn = |k: usize| {
            Complex64::from_polar(
                1.0,
                -TAU * (line * k % signal.len()) as f64 / signal.len() as f64,
            )
        };
        signal.iter().enumerate().map(|(k, value)| value * turn(k)).sum::<Complex64>().norm()
    }

    #[test]
    fn multisine_excites_its_lines_and_no_others() {
        let signal = multisine(&DRIVE, (5.0, 50.0), Lines::Odd, 3).unwrap();
        let reference = amplitude(&signal, 11);
        for line in 1..200 {
            let excited = (10..=100).contains(&line) && line % 2 == 1;
            let relative = amplitude(&signal, line) / reference;
            assert!((relative - f64::from(u8::from(excited))).abs() < 1e-9, "line {line}");
        }
        let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
        let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((low + 1.0).abs() < 1e-12 && (high - 3.0).abs() < 1e-12);
    }

    #[test]
    fn one_in_four_odd_lines_is_kept_free_for_detection() {
        let signal = multisine(&DRIVE, (0.5, 100.0), Lines::OddWithDetection, 1).unwrap();
        let largest = (1..200).map(|line| amplitude(&signal, line)).fold(0.0, f64::max);
        let excited =
            (1..200).step_by(2).filter(|&line| amplitude(&signal, line) > 0.5 * largest).count();
        assert_eq!(excited, 75);
    }

    #[test]
    fn prbs_has_two_levels_and_holds_them() {
        let signal = prbs(&DRIVE, 100.0, 5).unwrap();
        assert!(signal.iter().all(|&value| value == -1.0 || value == 3.0));
        assert!(signal.chunks(10).all(|chip| chip.iter().all(|value| value == &chip[0])));
        let high = signal.iter().filter(|&&value| value == 3.0).count();
        assert!((700..1300).contains(&high), "{high} of 2000 are high");
    }

    #[test]
    fn triangle_fills_the_range_and_decays() {
        let signal = decaying_triangle(&DRIVE, 5.0).unwrap();
        let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((high - 3.0).abs() < 1e-9 && (signal[0] - 1.0).abs() < 1e-12);
        assert!((signal[signal.len() - 1] - 1.0).abs() < 0.05);
    }

    #[test]
    fn steps_hold_each_level_as_long() {
        let signal = held_steps(&DRIVE).unwrap();
        let levels: Vec<f64> = signal.chunks(500).map(|chunk| chunk[0]).collect();
        assert_eq!(levels, [-1.0, 3.0, 1.0, -1.0]);
        assert!(signal.chunks(500).all(|chunk| chunk.iter().all(|value| *value == chunk[0])));
        assert!(held_steps(&Drive { samples: 3, ..DRIVE }).is_err());
    }

    #[test]
    fn the_slope_limit_holds() {
        let drive = Drive { slew: Some(50.0), ..DRIVE };
        for signal in [
            multisine(&drive, (1.0, 200.0), Lines::All, 1).unwrap(),
            prbs(&drive, 100.0, 1).unwrap(),
            decaying_triangle(&drive, 20.0).unwrap(),
            held_steps(&drive).unwrap(),
        ] {
            assert!(signal.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.05 + 1e-12));
        }
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let named = |error: Error| matches!(error, Error::Parameter { .. });
        assert!(named(multisine(&DRIVE, (10.0, 600.0), Lines::All, 0).unwrap_err()));
        assert!(named(multisine(&DRIVE, (0.6, 0.9), Lines::All, 0).unwrap_err()));
        assert!(named(prbs(&DRIVE, 2000.0, 0).unwrap_err()));
        assert!(named(prbs(&DRIVE, 0.1, 0).unwrap_err()));
        assert!(named(decaying_triangle(&DRIVE, 0.1).unwrap_err()));
        let drive = Drive { range: (1.0, 1.0), ..DRIVE };
        assert!(named(decaying_triangle(&drive, 10.0).unwrap_err()));
    }
}
