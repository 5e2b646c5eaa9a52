//! Start of threads, and the use of a second processor.
//!
//! The operating system may refuse a thread (limits on processes or memory). The caller then does the work itself, with the same
//! result.

#![allow(clippy::disallowed_methods)]

mod parallel;

pub use parallel::{interruptible, map, map_with_progress};

use crate::host;
use std::cell::Cell;
use std::io;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

thread_local! {
    static SHARES: Cell<bool> = const { Cell::new(false) };
}

/// True if a second thread has a processor: there are at least two, and this thread does not share them with others.
pub fn spare() -> bool {
    available() > 1
}

/// Number of threads that have a processor each: 1 for a thread that shares them with others.
pub fn available() -> usize {
    static THREADS: LazyLock<usize> =
        LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));
    if SHARES.get() { 1 } else { *THREADS }
}

/// [`available`] for work that takes some nanoseconds for each of `samples` samples: 1 where it takes less time than the start of a thread.
pub fn available_for(samples: usize) -> usize {
    const FEW: usize = 10_000;
    if samples <= FEW { 1 } else { available() }
}

/// Number of analyses of a record that are computed at once: [`available`], or 1 above two million samples, because each takes several
/// arrays of all samples and nodes.
pub fn analyses_at_once(samples: usize) -> usize {
    const MOST: usize = 2_000_000;
    if samples <= MOST { available() } else { 1 }
}

/// Marks this thread as one that shares the processors.
pub fn share() {
    SHARES.set(true);
}

/// Starts a scoped thread.
///
/// # Errors
/// If the operating system or the host refuses.
pub fn spawn_scoped<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> io::Result<ScopedJoinHandle<'scope, T>> {
    host::may_start_thread()?;
    Builder::new().spawn_scoped(scope, work)
}

/// Does `work` with this thread marked as sharing the processors.
pub fn sharing<T>(work: impl FnOnce() -> T) -> T {
    let before = SHARES.replace(true);
    let result = work();
    SHARES.set(before);
    result
}

/// Results of `own` and `other`; `other` is computed on a second thread where a processor is free and the thread starts.
///
/// # Panics
/// If one of them panics.
pub fn both<A, B: Send>(own: impl FnOnce() -> A, other: impl FnOnce() -> B + Send) -> (A, B) {
    if !spare() {
        return (own(), other());
    }
    // Taken by the second thread, or by this one without a second thread.
    let (other, of_other) = (Mutex::new(Some(other)), Mutex::new(None));
    let do_other = || {
        let taken = lock(&other).take();
        if let Some(other) = taken {
            let found = other();
            *lock(&of_other) = Some(found);
        }
    };
    let (mut own, mut of_own) = (Some(own), None);
    beside(1, &do_other, &mut || of_own = own.take().map(|own| own()));
    do_other();
    let of_other = lock(&of_other).take();
    (of_own.expect("done once"), of_other.expect("done once"))
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does `own` on this thread and `other` on each of up to `count` further threads, as many as start, which share the processors. One
/// function for all types, because a start of threads is several kilobytes of program.
///
/// # Panics
/// If one of them panics.
fn beside(count: usize, other: &(dyn Fn() + Sync), own: &mut dyn FnMut()) {
    std::thread::scope(|scope| {
        let other = || {
            share();
            other();
        };
        let others = (0..count).map_while(|_| spawn_scoped(scope, other).ok());
        let others: Vec<ScopedJoinHandle<()>> = others.collect();
        match others.is_empty() {
            true => own(),
            false => sharing(own),
        }
        for thread in others {
            if let Err(panic) = thread.join() {
                std::panic::resume_unwind(panic);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_are_computed_with_two_threads_and_with_one() {
        for (own, other) in [both(|| 1, || 2), sharing(|| both(|| 1, || 2))] {
            assert_eq!([own, other], [1, 2]);
        }
        assert!(std::panic::catch_unwind(|| both(|| 1, || panic!("the second"))).is_err());
    }

    #[test]
    fn a_thread_that_shares_has_none_to_spare() {
        let spare = std::thread::spawn(|| {
            share();
            spare()
        });
        assert!(!spare.join().expect("no panic"));
    }
}
