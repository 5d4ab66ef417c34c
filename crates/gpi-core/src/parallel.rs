//! Threads that survive a fork.
//!
//! `fork` copies the memory of a process, but of its threads only the one that calls it. A child therefore has the data of
//! its parent's thread pool and none of its threads, and work that it gave to that pool would never end. All parallel
//! work goes through [`install`], which gives it to a pool of the process that asks.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The process that has used the global pool; 0 before the first use.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// The pool of a process that was forked from the owner. Only such processes lock it, and only to look the pool up.
static FORKED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Does work whose parallel iterators run on threads of this process.
///
/// Where no thread can be started, the work runs on the global pool, as if the process had not been forked.
pub(crate) fn install<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let process = std::process::id();
    let owner = OWNER.compare_exchange(0, process, Ordering::AcqRel, Ordering::Acquire);
    match owner.err().filter(|&owner| owner != process).and_then(|_| forked(process)) {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// The pool of a forked process, which is made at its first use and kept until the process ends.
fn forked(process: u32) -> Option<Arc<ThreadPool>> {
    let mut known = FORKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = known.as_ref().filter(|(own, _)| *own == process) {
        return Some(pool.clone());
    }
    let pool = Arc::new(ThreadPoolBuilder::new().build().ok()?);
    // the pool of a parent has no threads that could be joined
    std::mem::forget(known.replace((process, pool.clone())));
    Some(pool)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn work_runs_in_the_pool_of_a_process() {
        let sum = || (0..1000_u64).into_par_iter().sum::<u64>();
        assert_eq!(install(sum), 499_500);
        // as in a process of this number that was forked from the owner
        let pool = forked(u32::MAX).unwrap();
        assert_eq!(pool.install(sum), 499_500);
        assert!(Arc::ptr_eq(&pool, &forked(u32::MAX).unwrap()));
        assert!(!Arc::ptr_eq(&pool, &forked(u32::MAX - 1).unwrap()));
        // inside a pool, the work goes on there
        assert_eq!(pool.install(|| install(sum)), 499_500);
    }
}
