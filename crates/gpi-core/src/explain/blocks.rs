//! Blocks of time that are kept for the test.
//!
//! An experiment of K samples, W of them warm-up, is divided behind its first part `lead` into B equal stretches, and a
//! part `fraction` of each stretch is a block:
//!
//! ```text
//! first = W + lead (K - W),      length = (K - first) / B,
//! block i = [first + length (i + c (1 - fraction)), the same + fraction length)
//! ```
//!
//! c in [0, 1] is the place within the stretch: 0.5 is the middle. The first c of the policy's list is taken whose
//! block contains no extreme of an input (its largest, smallest and fastest sample), or else the first of the list.
//! With the settings of the policy, the blocks cover `fraction (1 - lead)` of the scored time.
//!
//! The differences of the squares of B blocks have a standard error, which [`super::judgement`] uses.

use super::policy::HoldoutPolicy;
use crate::{Error, Experiment, Record};
use std::ops::Range;

/// The record with a part of its time held out, in blocks spread over each experiment.
///
/// Blocks and not single samples are held out, because noise correlates neighbouring samples.
pub(super) fn hold_out(record: &Record, policy: &HoldoutPolicy) -> Result<Record, Error> {
    let HoldoutPolicy { blocks, fraction, lead, places } = *policy;
    let split = |experiment: &Experiment| -> Vec<Range<usize>> {
        let rows = experiment.input.nrows();
        let first = experiment.warmup + (lead * (rows - experiment.warmup) as f64) as usize;
        let stretch = (rows - first) as f64 / blocks as f64;
        let extremes = extremes(experiment);
        let block = |i: usize| {
            // in the middle of its stretch, so that slow effects are known on both sides
            let at = |place: f64| {
                let start = first as f64 + stretch * (i as f64 + place * (1.0 - fraction));
                start as usize..(start + fraction * stretch) as usize
            };
            let places = places.map(at);
            let reaches = |block: &Range<usize>| extremes.iter().any(|k| block.contains(k));
            places.iter().find(|block| !reaches(block)).unwrap_or(&places[0]).clone()
        };
        (0..blocks).map(block).filter(|block| !block.is_empty()).collect()
    };
    let training = record.experiments().iter().map(|experiment| {
        let mut training = experiment.clone();
        training.held_out = split(experiment);
        training
    });
    record.with_experiments(training.collect())
}

/// Where every input is largest, smallest and fastest: a model is not tested outside the range it was fitted on.
fn extremes(experiment: &Experiment) -> Vec<usize> {
    let mut places = Vec::new();
    for column in experiment.input.column_iter() {
        places.extend([column.imax(), column.imin()]);
        let steps = column.iter().zip(column.iter().skip(1)).map(|(a, b)| (b - a).abs());
        let fastest = steps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        places.extend(fastest.map(|(k, _)| k + 1));
    }
    places
}
