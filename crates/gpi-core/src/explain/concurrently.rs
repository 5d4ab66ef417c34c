//! Jobs on all cores at once.
//!
//! Jobs run in the pool of threads, and each reports its stage and progress through a channel. Only the calling thread
//! calls `progress`, which need not be thread-safe. Its answer false is stored in a flag that every job reads at its
//! next report, so that all jobs end at their next step. The results have the order of the jobs, so that the outcome
//! does not depend on which one finishes first.

use crate::Error;
use crate::Progress;
use crate::parallel::install;
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
    let (tell, told) = channel::<(String, f64)>();
    std::thread::scope(|scope| {
        let all = scope.spawn(|| {
            let tell = tell;
            let one = |job| {
                let mut own = |stage: &str, done: f64| {
                    // the receiver waits until the last job is done
                    let _ = tell.send((stage.to_owned(), done));
                    goes_on.load(Ordering::Relaxed)
                };
                work(job, &mut own)
            };
            install(|| jobs.into_par_iter().map(one).collect())
        });
        for (stage, done) in told {
            if !progress(&stage, done) {
                goes_on.store(false, Ordering::Relaxed);
            }
        }
        all.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order_and_all_stop_when_asked() {
        let mut stages = Vec::new();
        let mut progress = |stage: &str, _: f64| {
            stages.push(stage.to_owned());
            true
        };
        let squares = concurrently((0..20).collect(), &mut progress, |job: usize, progress| {
            crate::progress::report(progress, &job.to_string(), 0.0)?;
            Ok(job * job)
        });
        assert_eq!(squares.unwrap(), (0..20).map(|job| job * job).collect::<Vec<_>>());
        stages.sort_by_key(|stage| stage.parse::<usize>().unwrap());
        assert_eq!(stages, (0..20).map(|job| job.to_string()).collect::<Vec<_>>());

        let endless = concurrently(vec![1, 2], &mut |_, _| false, |_, progress| {
            loop {
                crate::progress::report(progress, "endless", 0.0)?;
            }
            #[allow(unreachable_code)]
            Ok(())
        });
        assert!(matches!(endless, Err(Error::Interrupted)));
    }
}
