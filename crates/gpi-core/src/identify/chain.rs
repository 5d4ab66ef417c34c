//! The whole chain: excitation, start, rounds, model.

use super::identification::{Identification, IdentifyOptions};
use super::start::Start;
use super::{Progress, report};
use crate::linear::excitation_limit;
use crate::{Error, Record};

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
