//! The whole chain: excitation, start, rounds, model.

use super::start::Start;
use super::{Grid, Progress, report};
use crate::linear::{Fir, excitation_limit};
use crate::{Error, Model, Record};

/// What [`identify`] chooses (`None`) and what is given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdentifyOptions {
    /// Taps of the FIR estimate.
    pub taps: Option<usize>,
    /// Order of the linear dynamics.
    pub order: Option<usize>,
    /// Half-widths of the plays, in the unit of the input.
    pub half_widths: Option<Grid>,
    /// Thresholds of the deadzones, in the unit of the input.
    pub thresholds: Option<Grid>,
    /// Restricts the linear part to a gain with a delay of this many samples.
    pub delay: Option<usize>,
}

/// One pass of hysteresis and dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Root mean square of what is left on the training data, in the output's unit.
    pub rms: f64,
    /// Order of G.
    pub order: usize,
    /// Taps of the FIR estimate behind it.
    pub taps: usize,
}

/// A model and what it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The model, in its best round.
    pub model: Model,
    /// The paper's first stage, u to y; `None` where the input excites no more than gain and delay.
    pub fir: Option<Fir>,
    /// Singular values of ERA's Hankel matrix in the best round.
    pub singular_values: Vec<f64>,
    /// Unstable poles that ERA reflected in the best round.
    pub reflected: usize,
    /// Taps that the input supports, `usize::MAX` when there is no limit in sight.
    pub supported_taps: usize,
    /// Delay in samples where the linear part is a gain with a delay.
    pub delay: Option<usize>,
    /// What was left after each round.
    pub rounds: Vec<Round>,
    /// Samples at the start of each experiment that were not scored: the plays' unknown past.
    pub warmups: Vec<usize>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}

/// Identifies a model from a record.
///
/// A record whose input excites few directions (a sine, say) supports no dynamics beyond a gain and a
/// delay; the delay is then the one that fits best. Otherwise G has the order that the information
/// criterion prefers, and the rounds go on until nothing is gained.
///
/// # Errors
/// A constant input or output, more taps than the input excites or the samples allow, parameters out
/// of range, [`Error::Interrupted`] when `progress` returned false.
pub fn identify(
    record: &Record,
    options: &IdentifyOptions,
    progress: Progress,
) -> Result<Identification, Error> {
    record.require_moving()?;
    let inputs = record.inputs().len();
    let supported = excitation_limit(record)?;
    if options.taps == Some(0) {
        return Err(Error::parameter("taps", 0, "at least one tap is needed"));
    }
    if let Some(taps) = options.taps
        && taps > supported
    {
        let (unknowns, rank) = (taps * inputs, supported * inputs);
        return Err(Error::Excitation { taps, unknowns, rank, supported });
    }
    report(progress, "excitation", 1.0)?;
    let longest =
        record.experiments().iter().map(|e| e.input.nrows() - e.warmup).max().unwrap_or(0);
    let affordable = (longest / (4 * inputs)).max(1);
    let start = Start::new(record, options)?;
    let sizes = start.point.channels.iter().map(|c| c.half_widths.len() + c.thresholds.len());
    let needed = sizes.sum::<usize>() + record.outputs().len();
    if record.scored() < needed {
        let purpose = "plays, deadzones and offsets".to_owned();
        return Err(Error::TooFewSamples { samples: record.scored(), needed, purpose });
    }
    // With a gain and a delay nothing is left for more taps to tell.
    let taps = options.taps.unwrap_or(supported.min(affordable));
    let quasi_static = options.delay.is_some() || taps <= 4;
    if quasi_static {
        if let Some(order) = options.order {
            let requirement = format!(
                "the input supports {} taps, which is a gain and a delay; leave the order out",
                supported.min(affordable)
            );
            return Err(Error::parameter("order", order, requirement));
        }
        start.quasi_static(options.delay, supported, progress)
    } else {
        let largest = (1200 / inputs).min(1024).min(supported).min(affordable);
        let taps = options.taps.unwrap_or(largest.min(400));
        let largest = if options.taps.is_some() { taps } else { largest };
        start.dynamic(taps, largest, options.order, supported, progress)
    }
}
