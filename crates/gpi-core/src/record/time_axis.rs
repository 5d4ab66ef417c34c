//! The sampling rate from a column of time stamps.

use crate::Error;

/// A gap is a step longer than this multiple of the median step: half a step above the uniform one, and half a step
/// below the shortest step across a missing sample.
const GAP: f64 = 1.5;

/// If at most one step in 20 (and one more) deviates, the long steps are reported as gaps, where the record can be
/// cut; otherwise the sampling is reported as not uniform.
const DEVIATING: usize = 20;

/// The uniform sampling that a column of time stamps describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeAxis {
    /// Sampling rate in Hz.
    pub rate: f64,
    /// Largest deviation of a step from the median step, as a fraction of the median step.
    pub jitter: f64,
}

impl TimeAxis {
    /// The largest deviation of a step that counts as uniform, as a fraction of the median step.
    ///
    /// Stamps are often rounded to a few digits. A tenth of a step is far above the rounding and far below a missing
    /// sample.
    pub const TOLERANCE: f64 = 0.1;

    /// The rate and the jitter of time stamps in seconds.
    ///
    /// ```
    /// use gpi_core::TimeAxis;
    /// assert_eq!(TimeAxis::read(&[0.0, 0.5, 1.0])?.rate, 2.0);
    /// assert!(TimeAxis::read(&[0.0, 0.5, 1.0, 1.5, 3.5]).unwrap_err().to_string().contains("gap"));
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// There are fewer than two stamps, a stamp is not finite, stamps do not increase, the record has gaps (a few steps
    /// longer than 1.5 median steps), or the sampling is not uniform.
    pub fn read(stamps: &[f64]) -> Result<Self, Error> {
        Error::require_samples(stamps.len(), 2, "a rate needs two time stamps")?;
        if let Some((row, count)) = found(stamps, |stamp| !stamp.is_finite()) {
            return Err(Error::NotFinite { column: "time".to_owned(), row, count });
        }
        let steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some((row, count)) = found(&steps, |step| step <= 0.0) {
            let (before, after) = (stamps[row], stamps[row + 1]);
            return Err(Error::TimeNotIncreasing { row, before, after, count });
        }
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let (shortest, longest) = (sorted[0], sorted[sorted.len() - 1]);
        let deviates = |step: f64| (step / median - 1.0).abs() > Self::TOLERANCE;
        let Some((row, deviating)) = found(&steps, deviates) else {
            let duration = stamps[stamps.len() - 1] - stamps[0];
            let jitter = (longest / median - 1.0).max(1.0 - shortest / median);
            return Ok(Self { rate: steps.len() as f64 / duration, jitter });
        };
        // a record with gaps can be cut there, one with jitter must be resampled
        if deviating <= 1 + steps.len() / DEVIATING
            && let Some((row, count)) = found(&steps, |step| step > GAP * median)
        {
            let (time, gap) = (stamps[row], steps[row]);
            return Err(Error::TimeGap { row, time, gap, step: median, count });
        }
        Err(Error::TimeNotUniform { row, shortest, longest, median })
    }
}

/// The first row that satisfies a condition, and the number of such rows.
fn found(values: &[f64], condition: impl Fn(f64) -> bool) -> Option<(usize, usize)> {
    let row = values.iter().position(|&value| condition(value))?;
    Some((row, values[row..].iter().filter(|&&value| condition(value)).count()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_that_runs_backwards_is_located() {
        let error = TimeAxis::read(&[0.0, 1.0, 2.0, 1.5, 2.5]).unwrap_err();
        let expected = Error::TimeNotIncreasing { row: 2, before: 2.0, after: 1.5, count: 1 };
        assert_eq!(error, expected);
    }

    #[test]
    fn jitter_is_not_a_gap() {
        let stamps: Vec<f64> =
            (0..100).map(|k| f64::from(k) + if k % 3 == 0 { 0.4 } else { 0.0 }).collect();
        assert!(matches!(TimeAxis::read(&stamps), Err(Error::TimeNotUniform { row: 0, .. })));
    }

    #[test]
    fn rounded_stamps_are_uniform() {
        let stamps: Vec<f64> = (0..1000).map(|k| (f64::from(k) / 0.3).round() / 1e3).collect();
        let axis = TimeAxis::read(&stamps);
        assert!(matches!(axis, Err(Error::TimeNotUniform { .. })), "a third of a step is not");
        let stamps: Vec<f64> =
            (0..1000).map(|k| (f64::from(k) / 0.3 * 100.0).round() / 1e5).collect();
        assert!((TimeAxis::read(&stamps).unwrap().rate - 300.0).abs() < 1e-3);
    }
}
