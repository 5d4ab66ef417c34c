//! Hysteresis behind a gain with a delay, where the input excites no more.

use crate::Error;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::fit::refine::{RefineOptions, settings};
use crate::identify::identification::Round;
use crate::linear::{self, Sections};
use crate::progress::{Progress, report};

/// The linear part is a gain of plus or minus one with the delay that fits best, and with one sample
/// less and more.
pub(crate) fn seeds(
    prepared: &Prepared,
    delay: Option<usize>,
    progress: Progress,
) -> Result<(Vec<Point>, Vec<Round>), Error> {
    const LONGEST_DELAY: usize = 7;
    /// As many states: a longer delay is better cut out of the record.
    const LONGEST_GIVEN: usize = 500;
    if let Some(delay) = delay.filter(|&delay| delay > LONGEST_GIVEN) {
        let requirement = format!("at most {LONGEST_GIVEN} samples; shift the output instead");
        return Err(Error::parameter("delay", delay, requirement));
    }
    let gain = linear::estimate(&prepared.record.pieces(0)?, 1, 0.0)?.markov.remove(0);
    let delays = delay.map_or(0..=LONGEST_DELAY, |delay| delay..=delay);
    let mut options = settings(prepared, &RefineOptions::default(), 15);
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Nothing;
    options.gain = 1e-4;
    let mut rounds = Vec::new();
    let mut fits: Vec<Point> = Vec::new();
    for delay in delays {
        report(progress, "delay", delay as f64 / (LONGEST_DELAY + 1) as f64)?;
        let mut point = prepared.point(Sections::delayed_gain(&gain, delay));
        rescale(&mut point);
        let fitted = fit(point, &prepared.record, &options, "hysteresis", progress)?;
        let rms = (fitted.linearization.cost / prepared.values()).sqrt();
        rounds.push(Round { rms, order: delay, taps: delay + 1 });
        fits.push(fitted.point);
    }
    let rms = |place: &usize| rounds[*place].rms;
    let best = (0..fits.len()).min_by(|i, j| rms(i).total_cmp(&rms(j))).unwrap_or(0);
    let beside = fits.drain(best.saturating_sub(1)..(best + 2).min(fits.len())).collect();
    Ok((beside, rounds))
}
