//! Jobs on all cores at once.
//!
//! Jobs run in the pool of threads, and each reports its progress through a channel. Only the calling thread calls
//! `progress`, which need not be thread-safe. It hears what each job does, and the mean of the jobs' fractions. Its answer
//! false is stored in a flag that every job reads at its next report, so that all jobs end at their next step. The
//! results have the order of the jobs, so that the outcome does not depend on which one finishes first.

use crate::parallel::install;
use crate::{Error, Progress, Report};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

/// Does every job, as many at once as there are cores, and tells `progress` of each; results in the order of
/// the jobs. All stop where it says so.
pub(super) fn concurrently<J: Send, T: Send>(
    jobs: Vec<J>,
    progress: Progress,
    work: impl Fn(J, Progress) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let goes_on = AtomicBool::new(true);
    let (tell, told) = channel::<(usize, Told)>();
    let mut fractions = vec![0.0; jobs.len()];
    std::thread::scope(|scope| {
        let all = scope.spawn(|| {
            let tell = tell;
            let one = |(place, job)| {
                let mut own = |report: &Report| {
                    // the receiver waits until the last job is done
                    let _ = tell.send((place, Told::of(report)));
                    goes_on.load(Ordering::Relaxed)
                };
                work(job, &mut own)
            };
            install(|| jobs.into_par_iter().enumerate().map(one).collect())
        });
        for (place, Told { stage, trial, done, error }) in told {
            fractions[place] = done.max(fractions[place]);
            let done = fractions.iter().sum::<f64>() / fractions.len() as f64;
            // a stop is final: jobs may report again before they end
            if goes_on.load(Ordering::Relaxed)
                && !progress(&Report { stage: &stage, trial: &trial, done, error })
            {
                goes_on.store(false, Ordering::Relaxed);
            }
        }
        let results = all.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        // jobs that had no further step are not known to have been stopped
        if goes_on.load(Ordering::Relaxed) { results } else { Err(Error::Interrupted) }
    })
}

/// A report that can be sent to another thread.
struct Told {
    stage: String,
    trial: String,
    done: f64,
    error: Option<f64>,
}

impl Told {
    fn of(report: &Report) -> Self {
        let Report { stage, trial, done, error } = *report;
        Self { stage: stage.to_owned(), trial: trial.to_owned(), done, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order_and_all_stop_when_asked() {
        let mut stages = Vec::new();
        let mut last = 0.0;
        let mut progress = |report: &Report| {
            stages.push(report.stage.to_owned());
            assert!(report.done >= last);
            last = report.done;
            true
        };
        let squares = concurrently((0..20).collect(), &mut progress, |job: usize, progress| {
            crate::progress::report(progress, &job.to_string(), 1.0)?;
            Ok(job * job)
        });
        assert!((last - 1.0).abs() < 1e-12);
        assert_eq!(squares.unwrap(), (0..20).map(|job| job * job).collect::<Vec<_>>());
        stages.sort_by_key(|stage| stage.parse::<usize>().unwrap());
        assert_eq!(stages, (0..20).map(|job| job.to_string()).collect::<Vec<_>>());

        let endless = concurrently(vec![1, 2], &mut |_| false, |_, progress| {
            loop {
                crate::progress::report(progress, "endless", 0.0)?;
            }
            #[allow(unreachable_code)]
            Ok(())
        });
        assert!(matches!(endless, Err(Error::Interrupted)));
    }

    #[test]
    fn a_stop_that_is_said_once_is_not_forgotten() {
        let mut asked = 0;
        let mut once = |_: &Report| {
            asked += 1;
            asked > 1
        };
        // jobs that end with their report
        let ended = concurrently((0..20).collect(), &mut once, |job: usize, progress| {
            let _ = crate::progress::report(progress, "last", 1.0);
            Ok(job)
        });
        assert!(matches!(ended, Err(Error::Interrupted)));
        assert_eq!(asked, 1);
    }
}
