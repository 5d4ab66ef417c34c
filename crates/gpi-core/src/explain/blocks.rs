//! Blocks of time that are kept for the test.

use crate::{Error, Experiment, Record};
use std::ops::Range;

/// The record with every fifth part of its time held out, in blocks spread over each experiment.
///
/// Blocks, not single samples: neighbours share their noise's colour. The first tenth is kept for the
/// fit, which has to find the start.
pub(crate) fn hold_out(record: &Record) -> Result<Record, Error> {
    /// Blocks of an experiment, and the part of each stretch that is held out.
    const BLOCKS: usize = 10;
    const FRACTION: f64 = 0.2;
    let split = |experiment: &Experiment| -> Vec<Range<usize>> {
        let rows = experiment.input.nrows();
        let first = experiment.warmup + (rows - experiment.warmup) / 10;
        let stretch = (rows - first) as f64 / BLOCKS as f64;
        let extremes = extremes(experiment);
        let block = |i: usize| {
            // in the middle of its stretch, so that slow effects are known on both sides
            let at = |place: f64| {
                let start = first as f64 + stretch * (i as f64 + place * (1.0 - FRACTION));
                start as usize..(start + FRACTION * stretch) as usize
            };
            let places = [0.5, 0.2, 0.8, 0.35, 0.65].map(at);
            let reaches = |block: &Range<usize>| extremes.iter().any(|k| block.contains(k));
            places.iter().find(|block| !reaches(block)).unwrap_or(&places[0]).clone()
        };
        (0..BLOCKS).map(block).filter(|block| !block.is_empty()).collect()
    };
    let training = record.experiments().iter().map(|experiment| {
        let mut training = experiment.clone();
        training.held_out = split(experiment);
        training
    });
    record.with_experiments(training.collect())
}

/// Where every input is largest, smallest and fastest: a model is not asked for what it has not seen.
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

/// The record in which what is held out is scored, and nothing else.
pub(crate) fn complement(training: &Record) -> Result<Record, Error> {
    let test = training.experiments().iter().map(|experiment| {
        let mut test = experiment.clone();
        test.warmup = experiment.held_out.first().map_or(0, |held| held.start);
        let starts = experiment.held_out.iter().map(|held| held.end);
        let rows = experiment.input.nrows();
        let next = experiment.held_out.iter().skip(1).map(|held| held.start);
        let gaps = starts.zip(next.chain(std::iter::once(rows)));
        test.held_out = gaps.filter(|(a, b)| a < b).map(|(a, b)| a..b).collect();
        test
    });
    training.with_experiments(test.collect())
}
