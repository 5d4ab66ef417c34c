//! Hysteresis before a gain with a delay, where the order of persistent excitation allows no more.

use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::RefineOptions;
use crate::fit::joint::fit_options;
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::identification::Round;
use crate::identify::settings::QuasiStaticPolicy;
use crate::linear::{self, Sections};
use crate::progress::{Progress, report};
use crate::{Error, Matrix};

/// The least squares gain, (outputs, inputs).
pub(super) fn gain(prepared: &Prepared) -> Result<Matrix, Error> {
    Ok(linear::estimate(&prepared.record.pieces(0)?, 1, 0.0)?.markov.remove(0))
}

/// The linear part is a gain of plus or minus one with the delay that fits best, and with one sample
/// less and more.
pub(crate) fn seeds(
    prepared: &Prepared,
    delay: Option<usize>,
    policy: &QuasiStaticPolicy,
    progress: Progress,
) -> Result<(Vec<Point>, Vec<Round>), Error> {
    let QuasiStaticPolicy { longest, longest_given, steps, gain: least_gain } = *policy;
    if let Some(delay) = delay.filter(|&delay| delay > longest_given) {
        let requirement = format!("at most {longest_given} samples; shift the output instead");
        return Err(Error::parameter("delay", delay, requirement));
    }
    let gain = gain(prepared)?;
    let delays = delay.map_or(0..=longest, |delay| delay..=delay);
    let mut options = fit_options(prepared, &RefineOptions::default(), steps);
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Nothing;
    options.gain = least_gain;
    let mut rounds = Vec::new();
    let mut fits: Vec<Point> = Vec::new();
    for delay in delays {
        report(progress, "delay", delay as f64 / (longest + 1) as f64)?;
        let mut point = prepared.point(Sections::delayed_gain(&gain, delay));
        rescale(&mut point);
        let fitted = fit(point, &prepared.record, &options, "hysteresis", progress)?;
        let rms = (fitted.linearization.cost / prepared.values()).sqrt();
        rounds.push(Round { rms, order: delay, taps: delay + 1 });
        fits.push(fitted.point);
    }
    let rms = |place: &usize| rounds[*place].rms;
    let best = (0..fits.len()).min_by(|i, j| rms(i).total_cmp(&rms(j))).unwrap_or(0);
    let close = fits.drain(best.saturating_sub(1)..(best + 2).min(fits.len())).collect();
    Ok((close, rounds))
}
