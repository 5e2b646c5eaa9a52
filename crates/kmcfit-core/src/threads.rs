//! Threads: the only place that starts them, and when one may be taken.
//!
//! A thread can be refused by the operating system (limits on processes or memory). The callers then do its work
//! themselves, with the same result.

#![allow(clippy::disallowed_methods)]

use crate::host;
use std::cell::Cell;
use std::io;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

thread_local! {
    static SHARES: Cell<bool> = const { Cell::new(false) };
}

/// Whether there is a processor for a second thread: there are two, and this thread is not itself one of several
/// that share them.
pub fn spare() -> bool {
    static THREADS: LazyLock<usize> =
        LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));
    !SHARES.get() && *THREADS > 1
}

/// Says that this thread shares the processors with others from now on.
pub fn share() {
    SHARES.set(true);
}

/// Starts a thread that may borrow what outlives `scope`.
///
/// # Errors
/// If the system has no thread to give.
pub fn spawn_scoped<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> io::Result<ScopedJoinHandle<'scope, T>> {
    host::may_start_thread()?;
    Builder::new().spawn_scoped(scope, work)
}

/// Does `work` while another thread is busy for the same end.
pub fn sharing<T>(work: impl FnOnce() -> T) -> T {
    let before = SHARES.replace(true);
    let result = work();
    SHARES.set(before);
    result
}

/// The results of `own` and `other`, which is computed on a second thread at the same time where a processor is to spare
/// and the system has a thread to give.
///
/// # Panics
/// If one of them does.
pub fn both<A, B: Send>(own: impl FnOnce() -> A, other: impl FnOnce() -> B + Send) -> (A, B) {
    if !spare() {
        return (own(), other());
    }
    // Taken by the second thread, or by this one where there is no other.
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
