//! A resonance whose frequency depends on the output's amplitude: nothing in front of G can cause that.
//!
//! The frequency of a section with a complex pair of poles `rho exp(+-i phi)` is `f = phi rate / (2 pi)`. It follows
//! from the fits of two experiments, of least and largest amplitude, and its standard deviation s from the covariance
//! of the parameters by the delta method. The frequencies differ by
//!
//! ```text
//! |f_1 - f_2| / sqrt(s_1^2 + s_2^2)
//! ```
//!
//! standard errors, because the experiments have independent noise. The section of the largest ratio is reported if the
//! ratio exceeds the policy's. Sections keep their order between the fits, because both start from the same model.
//!
//! f is the damped natural frequency of the poles, not the frequency of the peak of the response.

use super::policy::ResonancePolicy;
use crate::Progress;
use crate::chain::point::Point;
use crate::fit::joint::Refined;
use crate::fit::minimize::{FitOptions, fit};
use crate::fit::preparation::Prepared;
use crate::fit::representatives::Representatives;
use crate::linear::Section;
use crate::{Error, Experiment, Record};
use nalgebra::DVector;
use std::f64::consts::TAU;

/// A resonance of the dynamics at one amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Root mean square of the outputs.
    pub swing: f64,
    /// In Hz, from the angle of the pole.
    pub frequency: f64,
    /// Standard deviation of the frequency.
    pub deviation: f64,
}

/// The resonance that differs most significantly between the experiments of smallest and largest amplitude, at the one
/// and at the other; `None` where the amplitudes are alike, or no resonance differs significantly.
///
/// The model without loops is fitted to each of the two experiments by itself. A hysteresis or any other
/// effect on the input changes v, and with it the response; the poles of G stay where they are.
pub(super) fn moved_resonance(
    base: &Point,
    prepared: &Prepared,
    options: &FitOptions,
    policy: &ResonancePolicy,
    progress: Progress,
) -> Result<Option<[Resonance; 2]>, Error> {
    let record = &prepared.record;
    let swings: Vec<f64> = record.experiments().iter().map(swing).collect();
    let mut order: Vec<usize> = (0..swings.len()).collect();
    order.sort_by(|&a, &b| swings[a].total_cmp(&swings[b]));
    let (Some(&least), Some(&most)) = (order.first(), order.last()) else { return Ok(None) };
    if swings[most] < policy.apart * swings[least] {
        return Ok(None);
    }
    let small = resonances(base, record, least, swings[least], options, policy, progress)?;
    let large = resonances(base, record, most, swings[most], options, policy, progress)?;
    let sureness = |pair: &[Resonance; 2]| {
        let [a, b] = pair;
        (a.frequency - b.frequency).abs() / a.deviation.hypot(b.deviation)
    };
    let pairs = small.into_iter().zip(large).filter_map(|(a, b)| Some([a?, b?]));
    let surest = pairs.max_by(|a, b| sureness(a).total_cmp(&sureness(b)));
    Ok(surest.filter(|pair| sureness(pair) > policy.sure))
}

/// Amplitude (rms) of an experiment's outputs.
fn swing(experiment: &Experiment) -> f64 {
    let values = experiment.scored() * experiment.output.ncols();
    let rows = experiment.scored_rows(&experiment.output);
    (rows.map(|rows| rows.norm_squared()).sum::<f64>() / values as f64).sqrt()
}

/// Where each section of G resonates in one experiment; `None` for those that do not.
fn resonances(
    base: &Point,
    record: &Record,
    experiment: usize,
    swing: f64,
    options: &FitOptions,
    policy: &ResonancePolicy,
    progress: Progress,
) -> Result<Vec<Option<Resonance>>, Error> {
    let whole = record.experiments()[experiment].clone();
    let one = Representatives { experiments: vec![(experiment, whole)], ratio: 1.0, memory: 0 };
    let (point, record) = one.alone(base, record)?;
    let options = FitOptions { steps: policy.steps, gain: policy.gain, ..options.clone() };
    let fitted = fit(point, &record, &options, "dynamics at each amplitude", progress)?;
    let (point, table) = (fitted.point.clone(), fitted.table.clone());
    let refined = Refined { fitted, options, outliers: 0, robust: false };
    let uncertainty = refined.uncertainty(&record, progress)?;
    let rate = record.rate();
    let frequencies = |point: &Point| -> Vec<f64> {
        let sections = point.dynamics.sections.iter();
        sections.map(|section| section.poles()[0].arg().abs() * rate / TAU).collect()
    };
    let (values, known) = (table.values(&point), point.spacings(&table));
    let moved = |step: &DVector<f64>| Ok(frequencies(&point.moved(step, &table)));
    let deviations = uncertainty.spread(&values, &known, moved)?;
    let found = frequencies(&point).into_iter().zip(deviations).zip(&point.dynamics.sections);
    let resonance = |((frequency, deviation), section): ((f64, f64), &Section)| {
        let resonates = section.order() == 2 && section.poles()[0].im != 0.0;
        resonates.then_some(Resonance { swing, frequency, deviation })
    };
    Ok(found.map(resonance).collect())
}
