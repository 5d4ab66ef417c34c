//! How long work tells what it does, and is stopped.
//!
//! A function reports the stage it is in and the fraction of this stage that is done. The number of stages is not known
//! beforehand: it depends on the data how many structures and effects are tried. [`Overall`] makes one fraction of them
//! that never falls. A stage that tries something counts as 1, another one, such as a score test, as a part of it. With w
//! of this work done and an expected amount n of it, the fraction is
//!
//! ```text
//! f(w / n),    f(x) = x for x <= b,    f(x) = 1 - (1 - b)^2 / (x + 1 - 2 b) beyond
//! ```
//!
//! f and its slope are continuous. The fraction is thus in proportion to the work as long as there is no more of it than
//! expected, and approaches 1 but never reaches it if there is.

use crate::Error;
use crate::settings::{FROM_ONE, PART, settings};

/// What long work does at present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<'a> {
    /// The present stage, such as `structures` or `score test`.
    pub stage: &'a str,
    /// What the stage tries at present, such as an order or the name of an effect; empty where it tries nothing.
    pub trial: &'a str,
    /// The fraction of all work that is done, 0 to 1. It never falls.
    pub done: f64,
    /// The smallest rms error of a whole model on the training data so far, in the output's unit; `None` before the
    /// first one is fitted. Several outputs are weighted by their residuals.
    pub error: Option<f64>,
}

/// Called with what is done at present. A return value of `false` asks to stop; the work then ends with
/// [`Error::Interrupted`].
pub type Progress<'a> = &'a mut dyn FnMut(&Report) -> bool;

settings! {
    /// How much work is expected, which only the progress depends on. The values are rounded, from the demo record and
    /// records of a few thousand samples with and without effects.
    struct ProgressSettings {
        /// The work of a stage that tries nothing, in proportion to one that does.
        light: f64 = 0.2, PART;
        /// The work of comparing structures for an identification.
        structures: f64 = 11.0, FROM_ONE;
        /// The share of this comparison in the time of an identification.
        identified: f64 = 0.95, PART;
        /// The work of comparing structures for an explanation, which compares fewer.
        declaring: f64 = 7.0, FROM_ONE;
        /// The share of this comparison in the time of an explanation.
        declared: f64 = 0.4, PART;
        /// The work of the search for effects.
        search: f64 = 10.0, FROM_ONE;
        /// The share of the time of an explanation after which the search ends.
        searched: f64 = 0.9, PART;
        /// The stages of a refinement, and of what comes last: refinements and the uncertainty.
        last: f64 = 3.0, FROM_ONE;
    }
}

impl ProgressSettings {
    /// The usual settings, which mean something.
    pub(crate) fn usual() -> Result<Self, Error> {
        let settings = Self::default();
        settings.validate()?;
        Ok(settings)
    }
}

/// The fraction up to which progress is in proportion to the work. The rest is for work beyond what is expected.
const PROPORTIONAL: f64 = 0.8;

/// Reports a fraction of a stage.
///
/// # Errors
/// [`Error::Interrupted`] when the caller asked to stop.
pub(crate) fn report(progress: Progress, stage: &str, done: f64) -> Result<(), Error> {
    tell(progress, &Report { stage, trial: "", done, error: None })
}

/// Reports the rms error of a whole model that a stage has fitted.
///
/// # Errors
/// [`Error::Interrupted`] when the caller asked to stop.
pub(crate) fn reached(progress: Progress, stage: &str, error: f64) -> Result<(), Error> {
    tell(progress, &Report { stage, trial: "", done: 1.0, error: Some(error) })
}

fn tell(progress: Progress, report: &Report) -> Result<(), Error> {
    if progress(report) { Ok(()) } else { Err(Error::Interrupted) }
}

/// Does the work of one trial of a stage. Whatever stages the trial itself consists of, they are reported as this one
/// stage, whose number of trials is `all`, with `before` of them done.
pub(crate) fn as_trial<T>(
    progress: Progress,
    (stage, trial): (&str, &str),
    (before, all): (usize, usize),
    work: impl FnOnce(Progress) -> Result<T, Error>,
) -> Result<T, Error> {
    /// Stages of one trial: a fit, sometimes another one, the uncertainty of the result.
    const STAGES: f64 = 3.0;
    let mut own = Counter::new(STAGES, 1.0);
    work(&mut |report: &Report| {
        let done = (before as f64 + own.take(report)) / all.max(1) as f64;
        progress(&Report { stage, trial, done: done.min(1.0), error: report.error })
    })
}

/// Adds the work of stages up, and says which fraction of the expected work is done.
#[derive(Debug)]
pub(crate) struct Counter {
    expected: f64,
    /// The work of a stage that tries nothing.
    light: f64,
    finished: f64,
    stage: String,
    /// The work of the present stage, and the fraction of it that is done.
    work: f64,
    within: f64,
}

impl Counter {
    /// For an expected amount of work.
    pub(crate) fn new(expected: f64, light: f64) -> Self {
        Self { expected, light, finished: 0.0, stage: String::new(), work: 0.0, within: 0.0 }
    }

    /// The fraction that is done after a report. A stage has ended when another one is reported, or its own fraction falls.
    pub(crate) fn take(&mut self, report: &Report) -> f64 {
        if self.stage != report.stage || report.done < self.within {
            self.finished += self.work;
            report.stage.clone_into(&mut self.stage);
            self.work = if report.trial.is_empty() { self.light } else { 1.0 };
        }
        self.within = report.done;
        let x = (self.finished + self.work * self.within) / self.expected;
        let left = 1.0 - PROPORTIONAL;
        if x <= PROPORTIONAL { x } else { 1.0 - left * left / (x + left - PROPORTIONAL) }
    }
}

/// One fraction for all work, which never falls, and the smallest error so far.
pub(crate) struct Overall<'a> {
    tell: Progress<'a>,
    counter: Counter,
    light: f64,
    /// The share of all work that the present part has, from and to.
    share: (f64, f64),
    done: f64,
    error: Option<f64>,
}

impl<'a> Overall<'a> {
    /// Work whose first part ends at the fraction `to` of it and has an expected amount; `light` is the work of a stage that
    /// tries nothing.
    pub(crate) fn new(tell: Progress<'a>, light: f64, to: f64, expected: f64) -> Self {
        let (counter, share) = (Counter::new(expected, light), (0.0, to));
        Self { tell, counter, light, share, done: 0.0, error: None }
    }

    /// The next part, up to the fraction `to`.
    pub(crate) fn part(&mut self, to: f64, expected: f64) {
        self.done = self.done.max(self.share.1);
        (self.counter, self.share) = (Counter::new(expected, self.light), (self.share.1, to));
    }

    /// Tells the fraction of all work; says whether it goes on.
    pub(crate) fn take(&mut self, report: &Report) -> bool {
        let (from, to) = self.share;
        let done = from + (to - from) * self.counter.take(report);
        self.done = self.done.max(done.min(to));
        self.error = match (self.error, report.error) {
            (Some(known), Some(other)) => Some(known.min(other)),
            (known, other) => known.or(other),
        };
        (self.tell)(&Report { done: self.done, error: self.error, ..*report })
    }

    /// Tells that all work is done.
    pub(crate) fn finish(mut self) {
        self.done = 1.0;
        // what is complete is not stopped any more
        let _ = (self.tell)(&Report { stage: "done", trial: "", done: 1.0, error: self.error });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told of stages, each with its fractions and at last an error.
    fn told(stages: &[(&str, Option<f64>)]) -> Vec<(String, f64, Option<f64>)> {
        let mut seen = Vec::new();
        let mut tell = |report: &Report| {
            seen.push((report.stage.to_owned(), report.done, report.error));
            true
        };
        let mut overall = Overall::new(&mut tell, 0.2, 0.5, 10.0);
        for (place, (stage, error)) in stages.iter().enumerate() {
            if place == stages.len() / 2 {
                overall.part(1.0, 10.0);
            }
            let trial = if *stage == "score test" { "" } else { "backwards" };
            for done in [0.0, 0.5, 1.0] {
                assert!(overall.take(&Report { stage, trial, done, error: *error }));
            }
        }
        overall.finish();
        seen
    }

    #[test]
    fn the_fraction_never_falls_and_the_error_is_the_smallest() {
        let mut stages = vec![("fit", None), ("fit", Some(3.0)), ("score test", Some(5.0))];
        stages.extend(vec![("fit", Some(2.0)); 100]);
        let seen = told(&stages);
        assert!(seen.windows(2).all(|pair| pair[0].1 <= pair[1].1));
        assert!(seen[..seen.len() - 1].iter().all(|one| one.1 < 1.0));
        assert_eq!(seen[0].2, None);
        assert_eq!(seen[6].2, Some(3.0));
        assert_eq!(*seen.last().unwrap(), ("done".to_owned(), 1.0, Some(2.0)));
        // one stage of ten in one half of the work
        assert!((seen[2].1 - 0.05).abs() < 1e-12);
        // two trials and a stage that tries nothing
        assert!((seen[8].1 - 0.5 * 0.22).abs() < 1e-12);
        // the second part begins where the first one ends
        let half = 3 * (stages.len() / 2);
        assert!(seen[half - 1].1 < 0.5 && seen[half].1 >= 0.5);
    }

    #[test]
    fn trials_are_one_stage() {
        let mut seen = Vec::new();
        let mut tell = |report: &Report| {
            seen.push((report.stage.to_owned(), report.trial.to_owned(), report.done));
            seen.len() < 4
        };
        let result = as_trial(&mut tell, ("trials", "backwards"), (1, 2), |progress| {
            report(progress, "fit", 0.0)?;
            report(progress, "fit", 1.0)?;
            report(progress, "uncertainty", 0.0)?;
            report(progress, "never", 0.0)
        });
        assert!(matches!(result, Err(Error::Interrupted)));
        assert!(seen.iter().all(|(stage, trial, _)| stage == "trials" && trial == "backwards"));
        let done: Vec<f64> = seen.iter().map(|one| one.2).collect();
        assert!(done[0] == 0.5 && done.is_sorted() && done[3] < 1.0);
    }
}
