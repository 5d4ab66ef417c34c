//! What a bank of stops says of friction, in words.
//!
//! A bank of stops `v = sum_i g_i (z - F_i)` is the model of Maxwell slip: elements that are elastic up to the force `g_i r_i`, and slip
//! then. When the displacement has moved by 2 r_i since its direction was reversed, element i slips. The friction force is that of
//! all elements, behind a gap if there is one.

use super::verdict::typed;
use crate::chain::point::Point;
use crate::effects::{Moment, OutputKind, OutputStage};
use crate::{Channel, Record};

/// The friction force and where it is reached; `None` where the hysteresis does not consist of stops alone, or the output is not their force.
pub(super) fn in_words(point: &Point, record: &Record) -> Option<String> {
    let ([channel], [input], [output]) = (&point.channels[..], record.inputs(), record.outputs())
    else {
        return None;
    };
    if point.output_kind() != OutputKind::Force
        || !point.output_stages().all(OutputStage::is_pinched)
    {
        return None;
    }
    let slipping = || {
        let elements = channel.half_widths.iter().zip(&channel.weights);
        elements.filter(|(r, weight)| **r > 0.0 && **weight < 0.0)
    };
    let widest = slipping().map(|(r, _)| *r).fold(0.0, f64::max);
    let elastic = point.dynamics.dc_gain()[(0, 0)] * slipping().map(|(r, p)| -p * r).sum::<f64>();
    let moment = Moment { time: 0.0, rate: point.rate, covariates: &[] };
    let force = point
        .output_stages()
        .fold(elastic, |force, own| own.sense(&mut own.rest(force, None), force, moment).0);
    let unit = |channel: &Channel| match &channel.unit[..] {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    (widest > 0.0).then(|| {
        format!(
            "The hysteresis consists of stops: the output leads the input, as the force of friction leads the displacement. If the \
             output is a force, the friction force is {}{}. It is reached when the displacement has moved by {}{} after a reversal.",
            typed(force.abs()),
            unit(output),
            typed(2.0 * widest / channel.slopes[0].abs()),
            unit(input),
        )
    })
}
