//! Independent jobs on several threads.

use crate::threads::{share, sharing, spawn_scoped};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most threads: each has a stack of its own, and no machine at hand has more processors.
const MOST_THREADS: usize = 256;

/// `work(0), work(1), ...` in this order, computed on up to `threads` threads. Every job depends on its
/// index alone, so the results are the same bits for any number of threads.
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
        // Where the system refuses a thread, the others do its jobs.
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
