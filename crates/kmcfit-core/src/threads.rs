//! Threads: the only place that starts them, when one may be taken, and one that waits awake.
//!
//! A thread can be refused by the operating system (limits on processes or memory). The callers then do its work
//! themselves, with the same result.

#![allow(clippy::disallowed_methods)]

use crate::host;
use std::cell::Cell;
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle, Scope, ScopedJoinHandle, Thread};
use std::time::{Duration, Instant};

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

/// Starts a thread.
fn spawn<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<JoinHandle<T>> {
    host::may_start_thread()?;
    Builder::new().spawn(work)
}

/// Does `work` while another thread is busy for the same end.
pub fn sharing<T>(work: impl FnOnce() -> T) -> T {
    let before = SHARES.replace(true);
    let result = work();
    SHARES.set(before);
    result
}

/// How long a companion stays awake without work: longer than an iteration of a quick search. Beside a longer
/// one, the tens of microseconds that it takes to wake are little.
const AWAKE: Duration = Duration::from_micros(400);

/// States of the work between both threads.
const NONE: u32 = 0;
const POSTED: u32 = 1;
const TAKEN: u32 = 2;
const DONE: u32 = 3;
const END: u32 = 4;

/// What both threads see.
struct Shared<J> {
    state: AtomicU32,
    job: Mutex<J>,
}

impl<J> Shared<J> {
    fn new(job: J) -> Arc<Self> {
        Arc::new(Self {
            state: AtomicU32::new(NONE),
            job: Mutex::new(job),
        })
    }

    fn job(&self) -> MutexGuard<'_, J> {
        self.job.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the work if nobody has; whether it did.
    fn take(&self) -> bool {
        let taken = self
            .state
            .compare_exchange(POSTED, TAKEN, Ordering::AcqRel, Ordering::Acquire);
        taken.is_ok()
    }
}

/// A thread that does half of a job of tens of microseconds, again and again: too short to be woken for, so it
/// waits awake. What it has not begun when it is needed, the other thread does itself; the result does
/// not depend on who does it. While it waits awake it keeps a processor busy, which [`spare`] is asked for first.
pub struct Companion<'s, J: Send> {
    shared: Arc<Shared<J>>,
    act: fn(&mut J),
    thread: Thread,
    handle: Option<Handle<'s>>,
}

enum Handle<'s> {
    Free(JoinHandle<()>),
    Scoped(ScopedJoinHandle<'s, ()>),
}

impl Handle<'_> {
    fn is_finished(&self) -> bool {
        match self {
            Handle::Free(handle) => handle.is_finished(),
            Handle::Scoped(handle) => handle.is_finished(),
        }
    }

    /// Waits for its end; a panic of it has been one of this thread, too.
    fn join(self) {
        let _ = match self {
            Handle::Free(handle) => handle.join(),
            Handle::Scoped(handle) => handle.join(),
        };
    }
}

impl<J: Send + 'static> Companion<'static, J> {
    /// A companion that does `act`; `None` if the system has no thread to give.
    pub fn new(job: J, act: fn(&mut J)) -> Option<Self> {
        let shared = Shared::new(job);
        let its = Arc::clone(&shared);
        let handle = spawn(move || accompany(&its, act)).ok()?;
        let thread = handle.thread().clone();
        Some(Self::with_handle(shared, act, thread, Handle::Free(handle)))
    }
}

impl<'s, J: Send + 's> Companion<'s, J> {
    /// [`Companion::new`], for a job that borrows what outlives `scope`.
    pub fn within(scope: &'s Scope<'s, '_>, job: J, act: fn(&mut J)) -> Option<Self> {
        let shared = Shared::new(job);
        let its = Arc::clone(&shared);
        let handle = spawn_scoped(scope, move || accompany(&its, act)).ok()?;
        let thread = handle.thread().clone();
        Some(Self::with_handle(
            shared,
            act,
            thread,
            Handle::Scoped(handle),
        ))
    }
}

impl<'s, J: Send> Companion<'s, J> {
    fn with_handle(
        shared: Arc<Shared<J>>,
        act: fn(&mut J),
        thread: Thread,
        handle: Handle<'s>,
    ) -> Self {
        Self {
            shared,
            act,
            thread,
            handle: Some(handle),
        }
    }

    /// Prepares the job, does `own` meanwhile, and looks at the job once it is done.
    pub fn with<T, R>(
        &mut self,
        prepare: impl FnOnce(&mut J),
        own: impl FnOnce() -> T,
        look: impl FnOnce(T, &mut J) -> R,
    ) -> R {
        self.post(prepare);
        let own = own();
        if !self.finish() {
            (self.act)(&mut self.shared.job());
        }
        look(own, &mut self.shared.job())
    }

    /// Prepares the job and lets the other thread do it. A job that was posted before is ended first.
    pub fn post(&mut self, prepare: impl FnOnce(&mut J)) {
        self.finish();
        prepare(&mut self.shared.job());
        self.shared.state.store(POSTED, Ordering::Release);
        self.thread.unpark();
    }

    /// Waits for the end of what was posted; whether it was done, and not taken back because nobody had begun it.
    pub fn finish(&mut self) -> bool {
        let was_posted = self.shared.state.load(Ordering::Acquire) != NONE;
        let is_done = was_posted && !self.shared.take();
        if is_done {
            self.wait();
        }
        self.shared.state.store(NONE, Ordering::Release);
        is_done
    }

    /// The job as it was left.
    pub fn look<R>(&self, look: impl FnOnce(&J) -> R) -> R {
        look(&self.shared.job())
    }

    fn wait(&self) {
        let is_gone = || self.handle.as_ref().is_none_or(Handle::is_finished);
        let mut spins = 0_u32;
        while self.shared.state.load(Ordering::Acquire) != DONE {
            std::hint::spin_loop();
            spins = spins.wrapping_add(1);
            // Whoever panicked over the job will panic here too.
            if spins.is_multiple_of(1 << 12) {
                if is_gone() {
                    return (self.act)(&mut self.shared.job());
                }
                std::thread::yield_now();
            }
        }
    }
}

impl<J: Send> Drop for Companion<'_, J> {
    fn drop(&mut self) {
        self.shared.state.store(END, Ordering::Release);
        self.thread.unpark();
        if let Some(handle) = self.handle.take() {
            handle.join();
        }
    }
}

fn accompany<J>(shared: &Shared<J>, act: fn(&mut J)) {
    let mut idle_since = Instant::now();
    for spins in 0_u64.. {
        match shared.state.load(Ordering::Acquire) {
            END => return,
            POSTED if shared.take() => {
                act(&mut shared.job());
                // Dropped in the meantime: the end stays the end.
                let (success, failure) = (Ordering::AcqRel, Ordering::Acquire);
                let _ = (shared.state).compare_exchange(TAKEN, DONE, success, failure);
                idle_since = Instant::now();
            }
            // The clock is slower than the look at the state.
            _ if !spins.is_multiple_of(64) || idle_since.elapsed() < AWAKE => {
                std::hint::spin_loop();
            }
            _ => {
                std::thread::park();
                idle_since = Instant::now();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever does it, each job is done once.
    #[test]
    fn every_job_is_done_once() {
        let mut companion = Companion::new((0_u64, 0_u64), |(input, output)| {
            *output += *input * *input;
        })
        .expect("a thread");
        for i in 0..2000_u64 {
            // It falls asleep now and then, and is sometimes too late.
            if i.is_multiple_of(500) {
                std::thread::sleep(4 * AWAKE);
            }
            let pause = Duration::from_micros(i % 7);
            let found = companion.with(
                |job| *job = (i, 1),
                || std::thread::sleep(pause * u32::from(i.is_multiple_of(3))),
                |(), (_, output)| *output,
            );
            assert_eq!(found, i * i + 1);
        }
        assert_eq!(companion.look(|job| job.0), 1999);
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
