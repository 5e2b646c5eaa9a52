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
use std::sync::{LazyLock, Mutex, PoisonError};
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
    let other = Mutex::new(Some(other));
    let take = || other.lock().unwrap_or_else(PoisonError::into_inner).take();
    std::thread::scope(|scope| {
        let second = spawn_scoped(scope, || {
            share();
            take().map(|other| other())
        });
        let own = sharing(own);
        let found = match second.map(ScopedJoinHandle::join) {
            Ok(Ok(found)) => found,
            Ok(Err(panic)) => std::panic::resume_unwind(panic),
            Err(_) => take().map(|other| other()),
        };
        (own, found.expect("taken once"))
    })
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
