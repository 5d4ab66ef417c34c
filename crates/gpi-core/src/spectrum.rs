//! Lines of a signal's discrete spectrum. Line i is the frequency `i rate / samples`.

use crate::Record;
use num_complex::Complex64;
use rustfft::FftPlanner;
use std::ops::Range;

/// Lines at which a line belongs to the same peak: a line whose amplitude changes slowly spreads over several lines.
const NEAR: usize = 5;

/// Up to this line a peak cannot be distinguished from a trend, whose power is in the lowest lines.
const SLOWEST: usize = 10;

/// A signal is one sine if this fraction of its power is near one line; a triangle has 0.986 in its fundamental.
const ALL: f64 = 0.995;

/// The discrete Fourier transform of a signal without its mean, under the Hann window.
pub(crate) fn tapered(values: &[f64]) -> Vec<Complex64> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let window = |k: usize| (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).sin().powi(2);
    let tapered = |(k, value): (usize, &f64)| Complex64::new((value - mean) * window(k), 0.0);
    let mut spectrum: Vec<Complex64> = values.iter().enumerate().map(tapered).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut spectrum);
    spectrum
}

/// Power of the lines below half the sampling rate.
pub(crate) fn power(values: &[f64]) -> Vec<f64> {
    tapered(values)[..values.len() / 2].iter().map(Complex64::norm_sqr).collect()
}

/// The frequency, in lines, of the peak at `line`, from two neighbours in the main lobe of the Hann window: for a peak d
/// lines above a line, the amplitude of the next line over that of the line is `(1 + d) / (2 - d)`.
pub(crate) fn peak(power: &[f64], line: usize) -> f64 {
    let size = |place: usize| power.get(place).map_or(0.0, |value| value.sqrt());
    let (below, here, above) = (line.checked_sub(1).map_or(0.0, size), size(line), size(line + 1));
    let shift = if above > below {
        (2.0 * above - here) / (above + here).max(f64::MIN_POSITIVE)
    } else {
        -(2.0 * below - here) / (below + here).max(f64::MIN_POSITIVE)
    };
    line as f64 + shift.clamp(-1.0, 1.0)
}

/// The lines that belong to the peak at `place`.
pub(crate) fn near(place: f64, count: usize) -> Range<usize> {
    let line = place.round() as usize;
    line.saturating_sub(NEAR).min(count)..(line + NEAR + 1).min(count)
}

/// The strongest line of a spectrum.
pub(crate) struct Strongest {
    /// Its frequency, in lines.
    pub place: f64,
    /// The fraction of the power near it.
    pub part: f64,
}

impl Strongest {
    /// `None` if the strongest line cannot be distinguished from a trend.
    pub(crate) fn of(power: &[f64]) -> Option<Self> {
        let line = (0..power.len()).max_by(|&i, &j| power[i].total_cmp(&power[j]))?;
        let around: f64 = power[near(line as f64, power.len())].iter().sum();
        let part = around / power.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        (line > SLOWEST).then(|| Self { place: peak(power, line), part })
    }
}

/// Whether every input of the record is a single sine.
pub(crate) fn is_one_sine(record: &Record) -> bool {
    let is_sine = |drive: &[f64]| Strongest::of(&power(drive)).is_some_and(|line| line.part > ALL);
    let mut columns = record.experiments().iter().flat_map(|e| e.input.column_iter());
    columns.all(|column| is_sine(column.as_slice()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Experiment, Matrix};

    fn driven_by(input: impl Fn(f64) -> f64) -> Record {
        let u = Matrix::from_fn(4000, 1, |k, _| input(k as f64 / 200.0));
        let channel = |name: &str| vec![Channel::new(name, "V")];
        let runs = vec![Experiment::new(u.clone(), u)];
        Record::new(runs, 200.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    #[test]
    fn a_sine_is_one_cycle_and_a_triangle_is_more() {
        let turns = |time: f64| 1.03 * time + 0.2;
        let sine = |time: f64| 1.8 + 1.8 * (std::f64::consts::TAU * turns(time)).sin();
        assert!(is_one_sine(&driven_by(sine)));
        assert!(!is_one_sine(&driven_by(|time| (turns(time).fract() - 0.5).abs())));
        let growing = |time: f64| time * sine(time);
        assert!(!is_one_sine(&driven_by(growing)));
        assert!(!is_one_sine(&driven_by(|_| 1.0)));
    }

    #[test]
    fn a_line_between_two_is_found_where_it_is() {
        let at = |place: f64| {
            let angle = |k: usize| std::f64::consts::TAU * place * k as f64 / 1000.0;
            let power = power(&(0..1000).map(|k| angle(k).cos()).collect::<Vec<_>>());
            let strongest = Strongest::of(&power).unwrap();
            assert!(strongest.part > 0.999);
            strongest.place
        };
        for place in [40.0, 40.3, 40.5, 40.8] {
            assert!((at(place) - place).abs() < 2e-3, "{} for {place}", at(place));
        }
    }
}
