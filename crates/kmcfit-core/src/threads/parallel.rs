//! Independent jobs on several threads.

use super::{beside, lock, sharing};
use crate::host;
use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Largest number of threads, which bounds the memory of their stacks.
const MOST_THREADS: usize = 256;

thread_local! {
    /// The flag of the innermost [`interruptible`] work of this thread.
    static INTERRUPT: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Does `work`; once `flag` is set, each [`map_with_progress`] that it calls on this thread starts no further job.
pub fn interruptible<T>(flag: &Arc<AtomicBool>, work: impl FnOnce() -> T) -> T {
    let outer = INTERRUPT.replace(Some(Arc::clone(flag)));
    let result = work();
    INTERRUPT.set(outer);
    result
}

/// [`map`], with the number of finished jobs to the progress of the host. Once the host asks to end, or the flag of
/// [`interruptible`] work is set, no further job is started: the results are those of the first jobs, all of them where there was
/// no such request.
///
/// # Panics
/// If a job does.
pub fn map_with_progress<T: Send>(
    count: usize,
    threads: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let finished = AtomicUsize::new(0);
    let job = |index| {
        // The number of threads may be that for which there is memory.
        let result = match threads {
            0 | 1 => work(index),
            _ => sharing(|| work(index)),
        };
        host::progress(finished.fetch_add(1, Ordering::Relaxed) + 1, count);
        result
    };
    let flag = INTERRUPT.with_borrow(Clone::clone);
    map_until(count, threads, job, || is_asked(flag.as_ref()))
}

/// True once the host asks to end, or the flag of the [`interruptible`] work of this thread is set.
pub fn is_stopped() -> bool {
    INTERRUPT.with_borrow(|flag| is_asked(flag.as_ref()))
}

fn is_asked(flag: Option<&Arc<AtomicBool>>) -> bool {
    host::is_interrupted() || flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// Computes `work(0), work(1), ...` on up to `threads` threads and returns the results in order. Each job depends on its
/// index alone, so results do not depend on the number of threads.
///
/// # Panics
/// If a job does.
pub fn map<T: Send>(count: usize, threads: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    map_until(count, threads, work, || false)
}

/// [`map`] up to the first job that finds `is_ended`: each job with a result is preceded by jobs with results.
fn map_until<T: Send>(
    count: usize,
    threads: usize,
    work: impl Fn(usize) -> T + Sync,
    is_ended: impl Fn() -> bool + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<Option<T>>> = Mutex::default();
    let turn = || {
        while !is_ended() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            let result = work(index);
            let mut results = lock(&results);
            if results.len() <= index {
                results.resize_with(index + 1, || None);
            }
            results[index] = Some(result);
        }
    };
    let workers = threads.clamp(1, count.clamp(1, MOST_THREADS));
    // Remaining threads do the jobs of a thread that the operating system refuses.
    beside(workers - 1, &turn, &mut || turn());
    let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The request comes within the fifth job: of 1000 jobs those that had begun on the three threads have results, without a gap.
    #[test]
    fn no_job_starts_after_the_request_to_end() {
        let is_ended = AtomicBool::new(false);
        let job = |index: usize| {
            is_ended.fetch_or(index >= 4, Ordering::SeqCst);
            index
        };
        let found = map_until(1000, 3, job, || is_ended.load(Ordering::SeqCst));
        assert!((5..=7).contains(&found.len()), "{}", found.len());
        assert!(found.iter().copied().eq(0..found.len()));
        assert!(map_until(1000, 3, job, || true).is_empty());
        assert_eq!(map(7, 3, |index| index), [0, 1, 2, 3, 4, 5, 6]);
    }

    /// The flag ends the jobs of the interruptible work alone, and not those that follow it.
    #[test]
    fn a_flag_ends_interruptible_work() {
        let flag = Arc::new(AtomicBool::new(false));
        let job = |index: usize| {
            flag.fetch_or(index >= 4, Ordering::SeqCst);
            index
        };
        let found = interruptible(&flag, || map_with_progress(1000, 3, job));
        assert!((5..=7).contains(&found.len()), "{}", found.len());
        assert_eq!(map_with_progress(1000, 3, job).len(), 1000);
    }
}
