//! One experiment: an uninterrupted sequence of samples, and which of them are scored.

use crate::{Error, Matrix};
use std::ops::Range;

/// One uninterrupted sequence of samples.
///
/// A sample is *scored* if its simulation error counts: it lies behind the warm-up and outside the held-out ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// u, (samples, inputs).
    pub input: Matrix,
    /// y, (samples, outputs).
    pub output: Matrix,
    /// Other measured columns, (samples, covariates).
    pub covariates: Matrix,
    /// Number of samples at the start that drive the model but are not scored.
    pub warmup: usize,
    /// Samples that drive the model but are not scored, because they are kept for a test: ascending and disjoint ranges
    /// behind the warm-up.
    pub held_out: Vec<Range<usize>>,
}

impl Experiment {
    /// An experiment without covariates in which every sample is scored: `input` is (samples, inputs), `output`
    /// (samples, outputs).
    ///
    /// ```
    /// use gpi_core::{Experiment, Matrix};
    /// let experiment = Experiment::new(Matrix::zeros(10, 1), Matrix::zeros(10, 1));
    /// let held_out = vec![6..8];
    /// let experiment = Experiment { warmup: 2, held_out, ..experiment };
    /// assert_eq!(experiment.scored_runs().collect::<Vec<_>>(), [2..6, 8..10]);
    /// ```
    pub fn new(input: Matrix, output: Matrix) -> Self {
        let covariates = Matrix::zeros(input.nrows(), 0);
        Self { input, output, covariates, warmup: 0, held_out: Vec::new() }
    }

    /// Number of scored samples.
    pub fn scored(&self) -> usize {
        self.scored_runs().map(|run| run.len()).sum()
    }

    /// The ranges of consecutive scored samples, ascending.
    pub fn scored_runs(&self) -> impl Iterator<Item = Range<usize>> {
        let starts = std::iter::once(self.warmup).chain(self.held_out.iter().map(|held| held.end));
        let rows = self.input.nrows();
        let ends = self.held_out.iter().map(|held| held.start).chain(std::iter::once(rows));
        starts.zip(ends).filter(|(start, end)| start < end).map(|(start, end)| start..end)
    }

    /// The rows of a signal (samples, channels) that are scored, range by range.
    pub(crate) fn scored_rows<'a>(
        &self,
        signal: &'a Matrix,
    ) -> impl Iterator<Item = nalgebra::DMatrixView<'a, f64>> {
        self.scored_runs().map(|run| signal.rows(run.start, run.len()))
    }

    /// The rows of a range as an experiment of their own, with `warmup` and nothing held out.
    pub(crate) fn rows(&self, range: Range<usize>, warmup: usize) -> Self {
        let rows = |matrix: &Matrix| matrix.rows(range.start, range.len()).into_owned();
        let covariates = rows(&self.covariates);
        Self { covariates, warmup, ..Self::new(rows(&self.input), rows(&self.output)) }
    }

    /// The rows of a range as an experiment of their own, in which the same samples are scored.
    pub(crate) fn stretch(&self, range: Range<usize>) -> Self {
        let within = |k: usize| k.clamp(range.start, range.end) - range.start;
        let mut stretch = self.rows(range.clone(), within(self.warmup));
        stretch.held_out =
            self.held_out.iter().map(|held| within(held.start)..within(held.end)).collect();
        stretch.held_out.retain(|held| !held.is_empty());
        stretch
    }

    /// The same experiment in which only one of `parts` parts of the scored samples is scored; the parts differ in size
    /// by at most one sample.
    pub(crate) fn part(&self, number: usize, parts: usize) -> Self {
        let places: Vec<usize> = self.scored_runs().flatten().collect();
        let bound = |number: usize| number * places.len() / parts;
        let own = &places[bound(number)..bound(number + 1)];
        let (Some(first), Some(last)) = (own.first(), own.last()) else { return self.clone() };
        let mut part = self.clone();
        let inside = |held: &Range<usize>| *first < held.start && held.end <= *last;
        part.held_out.retain(inside);
        part.held_out.insert(0, self.warmup..*first);
        part.held_out.push(last + 1..self.input.nrows());
        part.held_out.retain(|held| !held.is_empty());
        part
    }

    /// Holds these samples out as well.
    pub(crate) fn hold_out(&mut self, ranges: impl IntoIterator<Item = Range<usize>>) {
        self.held_out.extend(ranges.into_iter().map(|held| held.start.max(self.warmup)..held.end));
        self.held_out.retain(|held| held.start < held.end);
        self.held_out.sort_by_key(|held| held.start);
        let mut joined: Vec<Range<usize>> = Vec::new();
        for held in self.held_out.drain(..) {
            match joined.last_mut() {
                Some(last) if held.start <= last.end => last.end = last.end.max(held.end),
                _ => joined.push(held),
            }
        }
        self.held_out = joined;
    }

    /// Rejects a warm-up without a scored sample behind it, and held-out ranges that are not ascending behind it.
    pub(super) fn validate_scored(&self) -> Result<(), Error> {
        let (rows, warmup) = (self.input.nrows(), self.warmup);
        if warmup >= rows || self.scored() == 0 {
            let purpose = format!("a warm-up of {warmup} samples and one more");
            return Err(Error::TooFewSamples { samples: rows, needed: warmup + 1, purpose });
        }
        let mut end = warmup;
        for held in &self.held_out {
            let is_behind = end <= held.start && held.start < held.end && held.end <= rows;
            let requirement = format!("ascending ranges between {warmup} and {rows}");
            Error::require(is_behind, "held_out", format!("{held:?}"), requirement)?;
            end = held.end;
        }
        Ok(())
    }
}
