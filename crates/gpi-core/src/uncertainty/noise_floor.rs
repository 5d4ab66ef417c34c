//! The smallest residual that a model can leave: the sensor's noise, estimated without a model where possible.
//!
//! The noise n of an output is estimated from a residual `e(k) = m(k) + n(k)`, m the model error, by the first of three
//! methods that the record allows:
//!
//! ```text
//! input of period P:    var n = var(e(k + P) - e(k)) / 2        m repeats and cancels, n does not
//! input at rest:        var n = sum r(k)^2 / (rows - 2)         r: e of each rest's second half without its line
//! any input:            var n = mean of |E(w_i)|^2 / sum h^2    over the lines w_i >= 3 pi / 4 of windowed periodograms
//! ```
//!
//! h is Hann's window, E the transform of `h e`. The first two hold for any noise whose memory is shorter than P or a
//! rest; the third assumes white noise and a model error that is small near half the sampling rate (P. Welch, 1967).
//! A rest in which the output still moves has a larger variance than the quietest one: with f degrees of freedom the
//! ratio of two variances of Gaussian noise is `1 +- sqrt(2 / f1 + 2 / f2)`, and rests beyond four such standard errors are
//! left out. So are rests in which the measured output is constant: a sensor that is coarser than its noise, or at the end of its
//! range, does not show the noise.

use super::settings::NoiseFloorSettings;
use crate::{Experiment, Matrix, Record};
use nalgebra::DVector;
use num_complex::Complex64;
use rustfft::FftPlanner;

/// What a noise floor was estimated from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseMethod {
    /// From differences between repetitions of a periodic input.
    RepeatedPeriods {
        /// The shortest period found, in samples.
        period: usize,
    },
    /// From the output while the input is constant, without its slope.
    Rests {
        /// Samples that were used.
        samples: usize,
    },
    /// From the residual's power above three quarters of half the sampling rate, as if the noise were
    /// white. Model errors there count as noise.
    HighFrequencyResidual,
}

/// The noise of each output.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseFloor {
    /// Standard deviation of each output's noise, in its unit.
    pub rms: Vec<f64>,
    /// What it was estimated from.
    pub method: NoiseMethod,
}

impl NoiseMethod {
    /// A short name: `repeated-periods`, `rests` or `high-frequency-residual`.
    pub fn name(self) -> &'static str {
        match self {
            Self::RepeatedPeriods { .. } => "repeated-periods",
            Self::Rests { .. } => "rests",
            Self::HighFrequencyResidual => "high-frequency-residual",
        }
    }
}

impl NoiseFloor {
    /// Estimates the noise of a record, given a model's `residuals` (samples x outputs, one an
    /// experiment).
    ///
    /// Differences of the residual between repeated periods come first: `var(e(k + P) - e(k)) / 2`. Without
    /// repetitions the rests are taken: the second half of every stretch of at least 100 samples in
    /// which no input changes, its straight line removed, those left out in which the output still rings or is constant.
    /// Without rests it is the residual's power density near half the sampling rate.
    ///
    /// The residual, and not the output: the part of a disturbance that the model explains is not noise.
    pub fn estimate(record: &Record, residuals: &[Matrix]) -> Self {
        Self::from_periods(record, residuals)
            .or_else(|| Self::from_rests(record, residuals))
            .unwrap_or_else(|| Self::from_residuals(record, residuals))
    }

    fn from_periods(record: &Record, residuals: &[Matrix]) -> Option<Self> {
        let mut squares = DVector::zeros(record.outputs().len());
        let (mut count, mut shortest) = (0.0, usize::MAX);
        for (residual, experiment) in residuals.iter().zip(record.experiments()) {
            let Some(period) = period(&experiment.input) else { continue };
            shortest = shortest.min(period);
            let samples = residual.nrows();
            // The first of three periods or more still carries the transient of the start.
            let first = if samples >= 3 * period { period } else { 0 };
            let rows = (samples - period).saturating_sub(first);
            let difference = residual.rows(first + period, rows) - residual.rows(first, rows);
            for (sum, column) in squares.iter_mut().zip(difference.column_iter()) {
                *sum += 0.5 * column.add_scalar(-column.mean()).norm_squared();
            }
            count += rows as f64;
        }
        let rms = squares.iter().map(|sum: &f64| (sum / count).sqrt()).collect();
        (count >= NoiseFloorSettings::default().differences)
            .then_some(Self { rms, method: NoiseMethod::RepeatedPeriods { period: shortest } })
    }

    fn from_rests(record: &Record, residuals: &[Matrix]) -> Option<Self> {
        let settings = NoiseFloorSettings::default();
        // Sums of squares around a line, and their degrees of freedom.
        let mut found: Vec<(DVector<f64>, f64)> = Vec::new();
        for (residual, experiment) in residuals.iter().zip(record.experiments()) {
            for (start, end) in
                rests(experiment).into_iter().filter(|(a, b)| b - a >= settings.rest)
            {
                let rows = (end - start) / 2;
                let measured = experiment.output.rows(end - rows, rows);
                if measured.column_iter().any(|column| column.iter().all(|&y| y == column[0])) {
                    continue;
                }
                let own = residual.rows(end - rows, rows);
                let squares = own.column_iter().map(|column| around_a_line(&column.into()));
                found.push((DVector::from_iterator(own.ncols(), squares), rows as f64 - 2.0));
            }
        }
        // The output may still ring or creep in some: they are louder than the quietest one.
        let loudness = |(squares, freedom): &(DVector<f64>, f64)| squares.sum() / freedom;
        let quietest = found.iter().min_by(|a, b| loudness(a).total_cmp(&loudness(b)))?.clone();
        let limit = |freedom: f64| {
            1.0 + settings.standard_errors * (2.0 / freedom + 2.0 / quietest.1).sqrt()
        };
        found.retain(|rest| loudness(rest) <= limit(rest.1) * loudness(&quietest));
        let freedom: f64 = found.iter().map(|rest| rest.1).sum();
        let squares =
            found.iter().fold(DVector::zeros(record.outputs().len()), |sum, rest| sum + &rest.0);
        let samples = freedom as usize + 2 * found.len();
        let rms: Vec<f64> = squares.iter().map(|sum| (sum / freedom).sqrt()).collect();
        (samples >= settings.samples)
            .then_some(Self { rms, method: NoiseMethod::Rests { samples } })
    }

    /// White noise that has the residual's power density above three quarters of half the rate, from
    /// periodograms of up to 4096 samples under Hann's window.
    pub fn from_residuals(record: &Record, residuals: &[Matrix]) -> Self {
        let longest = NoiseFloorSettings::default().periodogram;
        let mut planner = FftPlanner::new();
        let rms = (0..record.outputs().len()).map(|output| {
            let (mut power, mut lines) = (0.0, 0.0);
            for (residual, experiment) in residuals.iter().zip(record.experiments()) {
                for scored in experiment.scored_rows(residual) {
                    let length = scored.nrows().min(longest);
                    for first in (0..=scored.nrows() - length).step_by(length) {
                        let piece = scored.view((first, output), (length, 1)).into_owned();
                        let (own, count) = high_lines(&mut planner, piece.as_slice());
                        power += own;
                        lines += count;
                    }
                }
            }
            (power / lines).sqrt()
        });
        Self { rms: rms.collect(), method: NoiseMethod::HighFrequencyResidual }
    }
}

/// Sum of the variances of white noise that every line above three quarters of half the rate stands
/// for, and how many lines there are.
fn high_lines(planner: &mut FftPlanner<f64>, values: &[f64]) -> (f64, f64) {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    // Hann's window: what leaks from low frequencies does not reach the band
    let window = |k: usize| (std::f64::consts::PI * k as f64 / n as f64).sin().powi(2);
    let windowed = values.iter().enumerate().map(|(k, value)| (value - mean) * window(k));
    let mut spectrum: Vec<Complex64> = windowed.map(|value| Complex64::new(value, 0.0)).collect();
    planner.plan_fft_forward(n).process(&mut spectrum);
    let half = n / 2;
    let first = (NoiseFloorSettings::default().band * half as f64).ceil() as usize;
    let band = &spectrum[first..=half.min(n - 1)];
    let energy: f64 = (0..n).map(|k| window(k).powi(2)).sum();
    let density: f64 = band.iter().map(Complex64::norm_sqr).sum();
    (density / energy.max(f64::MIN_POSITIVE), band.len() as f64)
}

/// The period of an input (samples, inputs) that is repeated at least once in full.
fn period(input: &Matrix) -> Option<usize> {
    let samples = input.nrows();
    let tolerance = NoiseFloorSettings::default().repeated * (input.max() - input.min());
    // Where the input differs most from its start, a wrong period shows at once.
    let place = (0..samples / 2).max_by(|&i, &j| {
        let far = |k: usize| (input.row(k) - input.row(0)).amax();
        far(i).total_cmp(&far(j))
    })?;
    let repeats = |lag: usize, k: usize| (input.row(k + lag) - input.row(k)).amax() <= tolerance;
    let holds = |lag: usize| repeats(lag, place) && (0..samples - lag).all(|k| repeats(lag, k));
    (2..=samples / 2).find(|&lag| holds(lag))
}

/// Stretches, from and up to, in which no input changes.
fn rests(experiment: &Experiment) -> Vec<(usize, usize)> {
    let input = &experiment.input;
    let mut found = Vec::new();
    let mut start = experiment.warmup;
    for k in start + 1..=input.nrows() {
        if k == input.nrows() || input.row(k) != input.row(k - 1) {
            found.push((start, k));
            start = k;
        }
    }
    found
}

/// Sum of squares around the straight line that fits best.
fn around_a_line(values: &DVector<f64>) -> f64 {
    let middle = 0.5 * (values.len() as f64 - 1.0);
    let place = DVector::from_fn(values.len(), |k, _| k as f64 - middle);
    let centred = values.add_scalar(-values.mean());
    let slope = place.dot(&centred) / place.norm_squared();
    (centred - slope * place).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    /// White noise of variance one without a generator: a chaotic map, made uniform.
    fn noise(samples: usize, seed: f64) -> Vec<f64> {
        let mut x = seed;
        (0..samples)
            .map(|_| {
                x = (x * 16807.0) % 2_147_483_647.0;
                (x / 2_147_483_647.0 - 0.5) * 12.0_f64.sqrt()
            })
            .collect()
    }

    fn record(u: &[f64], y: &[f64]) -> Record {
        let column = |values: &[f64]| Matrix::from_column_slice(values.len(), 1, values);
        let run = Experiment {
            input: column(u),
            output: column(y),
            covariates: Matrix::zeros(u.len(), 0),
            warmup: 0,
            held_out: vec![],
        };
        Record::new(
            vec![run],
            1.0,
            vec![Channel::new("u", "")],
            vec![Channel::new("y", "")],
            vec![],
        )
        .unwrap()
    }

    #[test]
    fn every_method_finds_the_noise() {
        let e = noise(6000, 4711.0);
        let with = |u: &dyn Fn(usize) -> f64, gain: f64| {
            let u: Vec<f64> = (0..6000).map(u).collect();
            let y: Vec<f64> = u.iter().zip(&e).map(|(u, e)| gain * u + 0.1 * e).collect();
            let residual = vec![Matrix::from_column_slice(6000, 1, &e) * 0.1];
            NoiseFloor::estimate(&record(&u, &y), &residual)
        };
        let periodic = with(&|k| ((k % 500) as f64 * 0.1).sin() + (k % 500) as f64, 3.0);
        assert_eq!(periodic.method, NoiseMethod::RepeatedPeriods { period: 500 });
        let stairs = with(&|k| ((k / 400) * (k / 400)) as f64, 3.0);
        assert!(matches!(stairs.method, NoiseMethod::Rests { samples } if samples >= 2800));
        let other = with(&|k| (k as f64 * 0.01 * (1.0 + k as f64 * 1e-5)).sin(), 3.0);
        assert_eq!(other.method, NoiseMethod::HighFrequencyResidual);
        for floor in [periodic, stairs, other] {
            assert!((floor.rms[0] / 0.1 - 1.0).abs() < 0.06, "{floor:?}");
        }
    }

    #[test]
    fn a_rest_at_the_end_of_the_sensors_range_shows_no_noise() {
        let e = noise(6000, 4711.0);
        let u: Vec<f64> = (0..6000).map(|k| f64::from(k / 600)).collect();
        let of = |most: f64| {
            let y: Vec<f64> = u.iter().zip(&e).map(|(u, e)| (u + 0.1 * e).min(most)).collect();
            let residual = y.iter().zip(&u).map(|(y, u)| y - u.min(most));
            let residual = vec![Matrix::from_iterator(6000, 1, residual)];
            NoiseFloor::estimate(&record(&u, &y), &residual)
        };
        // all rests but the last two are within the range
        let floor = of(7.5);
        assert_eq!(floor.method, NoiseMethod::Rests { samples: 2400 });
        assert!((floor.rms[0] / 0.1 - 1.0).abs() < 0.06, "{floor:?}");
        assert_eq!(of(-1.0).method, NoiseMethod::HighFrequencyResidual);
    }
}
