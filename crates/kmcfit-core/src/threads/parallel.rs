//! Independent jobs on several threads.

use super::{share, sharing, spawn_scoped};
use crate::host;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest number of threads, which bounds the memory of their stacks.
const MOST_THREADS: usize = 256;

/// [`map`], with the number of finished jobs to the progress of the host.
///
/// # Panics
/// If a job does.
pub fn map_with_progress<T: Send>(
    count: usize,
    threads: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let finished = AtomicUsize::new(0);
    map(count, threads, |index| {
        let result = work(index);
        host::progress(finished.fetch_add(1, Ordering::Relaxed) + 1, count);
        result
    })
}

/// Computes `work(0), work(1), ...` on up to `threads` threads and returns the results in order. Each job depends on its
/// index alone, so results do not depend on the number of threads.
///
/// # Panics
/// If a job does.
pub fn map<T: Send>(count: usize, threads: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let turn = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return done;
            }
            done.push((index, work(index)));
        }
    };
    let workers = threads.clamp(1, count.clamp(1, MOST_THREADS));
    let mut results = std::thread::scope(|scope| {
        let work = || {
            share();
            turn()
        };
        // Remaining threads do the jobs of a thread that the operating system refuses.
        let others = (1..workers).map_while(|_| spawn_scoped(scope, work).ok());
        let others: Vec<_> = others.collect();
        let mut done = match others.is_empty() {
            true => turn(),
            false => sharing(turn),
        };
        for handle in others {
            match handle.join() {
                Ok(more) => done.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
