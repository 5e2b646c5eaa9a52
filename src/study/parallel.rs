//! Independent jobs on several threads.

use crate::threads::share;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::Builder;

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
    let workers = threads.clamp(1, count.max(1));
    let mut results = std::thread::scope(|scope| {
        let work = || {
            if workers > 1 {
                share();
            }
            turn()
        };
        // A thread that the system has no room for is left out: the others do its work.
        let begun = |_| Builder::new().spawn_scoped(scope, work).ok();
        let handles: Vec<_> = (0..workers).map_while(begun).collect();
        let mut done = match handles.is_empty() {
            true => turn(),
            false => Vec::new(),
        };
        for handle in handles {
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
