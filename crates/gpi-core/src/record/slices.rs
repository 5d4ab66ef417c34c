//! Parts of a record, by samples or by time.
//!
//! A part of an experiment keeps what is left of its warm-up. Its initial state is unknown, because what went before is not
//! in it; [`Record::split`] keeps it as warm-up.

use super::{Experiment, Record};
use crate::Error;
use std::ops::Range;

impl Record {
    /// The samples of a range, counted through all experiments in their order. Experiments outside the range are left
    /// out.
    ///
    /// ```
    /// # use gpi_core::{Channel, Experiment, Matrix, Record};
    /// let run = || Experiment::new(Matrix::zeros(10, 1), Matrix::zeros(10, 1));
    /// let channel = || vec![Channel::new("u", "")];
    /// let record = Record::new(vec![run(), run()], 1.0, channel(), channel(), vec![])?;
    /// let part = record.slice(8..13)?;
    /// assert_eq!(part.experiments().iter().map(|e| e.input.nrows()).collect::<Vec<_>>(), [2, 3]);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The range holds no sample that is scored.
    pub fn slice(&self, samples: Range<usize>) -> Result<Self, Error> {
        let mut first = 0;
        let ranges = self.experiments().iter().map(|experiment| {
            let (begin, rows) = (first, experiment.input.nrows());
            first += rows;
            samples.start.saturating_sub(begin)..samples.end.saturating_sub(begin).min(rows)
        });
        let ranges = ranges.collect::<Vec<_>>();
        let given = format!("{}..{}", samples.start, samples.end);
        self.parts(ranges, "samples", &given)
    }

    /// The samples of every experiment from one time to another in s, counted from its first sample. The end is not
    /// included.
    ///
    /// # Errors
    /// A time is not finite, or there is no sample between them.
    pub fn between(&self, start: f64, end: f64) -> Result<Self, Error> {
        for (name, time) in [("start", start), ("end", end)] {
            Error::require(time.is_finite(), name, time, "must be a time in s")?;
        }
        // a time stamp is rounded: half a millionth of a step more is the same sample
        let sample = |time: f64| (time * self.rate() - 5e-7).ceil().max(0.0) as usize;
        let range = |e: &Experiment| sample(start)..sample(end).min(e.input.nrows());
        let ranges = self.experiments().iter().map(range).collect();
        self.parts(ranges, "start", &format!("{start} to {end} s"))
    }

    /// A range of each experiment; those without samples are left out.
    fn parts(
        &self,
        ranges: Vec<Range<usize>>,
        name: &'static str,
        given: &str,
    ) -> Result<Self, Error> {
        let parts = self.experiments().iter().zip(ranges);
        let parts = parts.filter(|(_, range)| !range.is_empty()).map(|(experiment, range)| {
            let warmup = experiment.warmup.saturating_sub(range.start).min(range.len());
            experiment.rows(range, warmup)
        });
        let parts: Vec<Experiment> = parts.collect();
        let is_scored = parts.iter().any(|part| part.scored() > 0);
        let longest = self.longest();
        let requirement = format!(
            "holds no scored sample; the record has {} samples in {} experiments, the longest of {} s",
            self.samples(),
            self.experiments().len(),
            longest as f64 / self.rate()
        );
        Error::require(is_scored, name, given, &requirement)?;
        self.with_experiments(parts.into_iter().filter(|part| part.scored() > 0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Matrix};

    /// Two experiments of 10 and 6 samples at 4 Hz with warm-ups of 3 and 0; the samples are numbered.
    fn record() -> Record {
        let run = |rows: usize, first: usize, warmup| {
            let u = Matrix::from_fn(rows, 1, |k, _| (first + k) as f64);
            Experiment { warmup, ..Experiment::new(u.clone(), u) }
        };
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run(10, 0, 3), run(6, 10, 0)], 4.0, channel("u"), channel("y"), vec![])
            .unwrap()
    }

    fn numbers(record: &Record) -> Vec<Vec<f64>> {
        record.experiments().iter().map(|e| e.input.as_slice().to_vec()).collect()
    }

    #[test]
    fn a_slice_counts_through_all_experiments() {
        let part = record().slice(1..12).unwrap();
        assert_eq!(numbers(&part), [(1..10).map(f64::from).collect(), vec![10.0, 11.0]]);
        assert_eq!(part.experiments()[0].warmup, 2);
        assert_eq!(
            numbers(&record().slice(11..99).unwrap()).concat(),
            [11.0, 12.0, 13.0, 14.0, 15.0]
        );
        for nothing in [0..3, 5..5, 16..20] {
            assert!(record().slice(nothing).is_err());
        }
    }

    #[test]
    fn times_count_from_the_start_of_each_experiment() {
        let part = record().between(1.0, 2.0).unwrap();
        assert_eq!(numbers(&part), [[4.0, 5.0, 6.0, 7.0].to_vec(), vec![14.0, 15.0]]);
        assert_eq!(numbers(&record().between(2.25, 9.0).unwrap()), [vec![9.0]]);
        assert!(record().between(3.0, 4.0).is_err() && record().between(f64::NAN, 1.0).is_err());
    }
}
