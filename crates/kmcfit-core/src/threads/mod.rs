//! Start of threads, and the use of a second processor.
//!
//! The operating system may refuse a thread (limits on processes or memory). The caller then does the work itself, with the same
//! result.

#![allow(clippy::disallowed_methods)]

mod parallel;

pub use parallel::{interruptible, map};
pub(crate) use parallel::{is_stopped, map_with_progress};

use std::cell::Cell;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

thread_local! {
    /// Number of threads for the work of this thread where it is given; else it follows from the processors.
    static GIVEN: Cell<Option<usize>> = const { Cell::new(None) };
    /// True if this thread is counted in [`BUSY`].
    static IS_COUNTED: Cell<bool> = const { Cell::new(false) };
}

/// Number of processors that this process may use.
static PROCESSORS: LazyLock<usize> =
    LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));

/// Number of threads in parallel work, without those that wait for others. Threads that only write or watch are not counted.
static BUSY: AtomicUsize = AtomicUsize::new(0);

/// True if a processor is free and this thread may use it.
pub(crate) fn has_idle_processor() -> bool {
    available() > 1
}

/// Number of threads that have a processor each, this one included: as many as processors are free, but at most two for work within other
/// parallel work, whose memory adds up; 1 for a thread that shares the processors.
pub fn available() -> usize {
    let busy = BUSY.load(Ordering::Relaxed);
    GIVEN
        .get()
        .unwrap_or_else(|| threads_on(*PROCESSORS, busy, IS_COUNTED.get()))
}

/// [`available`] of a thread beside `busy` threads, itself one of them if it is counted.
fn threads_on(processors: usize, busy: usize, is_counted: bool) -> usize {
    let others = busy.saturating_sub(usize::from(is_counted));
    let threads = processors.saturating_sub(others).max(1);
    if is_counted { threads.min(2) } else { threads }
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

/// Starts a scoped thread.
///
/// # Errors
/// If the operating system refuses.
pub(crate) fn spawn_scoped<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> io::Result<ScopedJoinHandle<'scope, T>> {
    Builder::new().spawn_scoped(scope, work)
}

/// Does `work` with this thread marked as sharing the processors.
pub fn sharing<T>(work: impl FnOnce() -> T) -> T {
    given(1, work)
}

/// Does `work` with this number of threads for each parallel work of this thread, whatever processors are free.
pub(crate) fn given<T>(threads: usize, work: impl FnOnce() -> T) -> T {
    /// Restores the number, after a panic too, which a fleet or Python may catch.
    struct Restored(Option<usize>);

    impl Drop for Restored {
        fn drop(&mut self) {
            GIVEN.set(self.0);
        }
    }

    let _restored = Restored(GIVEN.replace(Some(threads)));
    work()
}

/// Results of `own` and `other`; `other` is computed on a second thread where a processor is free and the thread starts.
///
/// # Panics
/// If one of them panics.
pub fn both<A, B: Send>(own: impl FnOnce() -> A, other: impl FnOnce() -> B + Send) -> (A, B) {
    if !has_idle_processor() {
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

/// A thread that is counted in [`BUSY`].
struct Counted;

impl Counted {
    fn new() -> Self {
        BUSY.fetch_add(1, Ordering::Relaxed);
        Self
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        BUSY.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Parallel work of this thread, which is counted until its end; not a second time within other parallel work.
struct ParallelWork(Option<Counted>);

impl ParallelWork {
    fn begin() -> Self {
        Self((!IS_COUNTED.replace(true)).then(Counted::new))
    }
}

impl Drop for ParallelWork {
    fn drop(&mut self) {
        IS_COUNTED.set(self.0.is_none());
    }
}

/// A wait of this thread for others, during which it is not counted.
struct Waiting;

impl Waiting {
    fn begin() -> Self {
        BUSY.fetch_sub(1, Ordering::Relaxed);
        Self
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        BUSY.fetch_add(1, Ordering::Relaxed);
    }
}

/// Does `own` on this thread and `other` on each of up to `count` further threads, as many as start. One function for all types, because a
/// start of threads is several kilobytes of program.
///
/// # Panics
/// If one of them panics.
fn beside(count: usize, other: &(dyn Fn() + Sync), own: &mut dyn FnMut()) {
    if count == 0 {
        return own();
    }
    let _work = ParallelWork::begin();
    std::thread::scope(|scope| {
        let others = (0..count).map_while(|_| {
            // Before it starts, so that work of this thread does not take its processor.
            let counted = Counted::new();
            let work = move || {
                let _counted = counted;
                IS_COUNTED.set(true);
                other();
            };
            spawn_scoped(scope, work).ok()
        });
        let others: Vec<ScopedJoinHandle<()>> = others.collect();
        own();
        let _waiting = Waiting::begin();
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

    /// A thread outside parallel work has the free processors; one within it at most one more, and none where all are busy.
    #[test]
    fn threads_have_the_processors_that_are_free() {
        let outside = [0, 1, 3, 4, 9].map(|busy| threads_on(4, busy, false));
        assert_eq!(outside, [4, 3, 1, 1, 1]);
        let within = [1, 2, 3, 4, 9].map(|busy| threads_on(4, busy, true));
        assert_eq!(within, [2, 2, 2, 1, 1]);
        assert_eq!([false, true].map(|within| threads_on(1, 1, within)), [1, 1]);
        assert_eq!(given(7, available), 7);
    }

    #[test]
    fn threads_are_counted_within_parallel_work_only() {
        let counted = || IS_COUNTED.get();
        for threads in [2, 3] {
            let within = || map(2, threads, |_| counted());
            assert_eq!(within(), [true, true]);
            assert!(!counted());
            assert_eq!(map(1, threads, |_| counted()), [false]);
        }
        let nested = || given(2, || both(counted, counted));
        assert_eq!(
            given(2, || both(nested, nested)),
            ((true, true), (true, true))
        );
        let panics = || given(2, || both(|| panic!("the first"), || ()));
        assert!(std::panic::catch_unwind(panics).is_err() && !counted());
        assert_eq!(GIVEN.get(), None);
    }

    #[test]
    fn a_thread_that_shares_has_no_idle_processor() {
        let has_idle = std::thread::spawn(|| sharing(has_idle_processor));
        assert!(!has_idle.join().expect("no panic"));
    }
}
