//! Services of the host, provided by the application: a clock, the memory limit, the permission to start a thread, a display of
//! progress, and a request to end.
//!
//! Without a host, a fit has no time limit, timings are zero, memory is unlimited, threads may start, no progress is shown, and no
//! analysis ends early.

use std::io;
use std::sync::OnceLock;
use std::time::Duration;

/// Functions of the host.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Time since any fixed instant; never decreasing.
    pub clock: fn() -> Duration,
    /// True if so many more bytes may be allocated.
    pub has_memory: fn(u64) -> bool,
    /// Permission to start a thread; an error counts as a refusal by the operating system.
    pub may_start_thread: fn() -> io::Result<()>,
    /// Display of progress: number of finished jobs and number of all jobs of an analysis. Called from any thread, after each job; not
    /// necessarily in increasing order.
    pub progress: fn(usize, usize),
    /// True once the user has asked the process to end: the remaining jobs of an analysis are not started. Never false again.
    pub is_interrupted: fn() -> bool,
}

static HOST: OnceLock<Host> = OnceLock::new();

/// Sets the functions of the host for the rest of the process; later calls have no effect.
pub fn set_host(host: Host) {
    let _ = HOST.set(host);
}

/// True if so many more bytes may be allocated; always true without a host.
pub(crate) fn has_memory(bytes: u64) -> bool {
    HOST.get().is_none_or(|host| (host.has_memory)(bytes))
}

/// Permission of the host to start a thread.
///
/// # Errors
/// The refusal of the host.
pub(crate) fn may_start_thread() -> io::Result<()> {
    HOST.get().map_or(Ok(()), |host| (host.may_start_thread)())
}

/// Shows the number of finished jobs of all.
pub(crate) fn progress(done: usize, all: usize) {
    if let Some(host) = HOST.get() {
        (host.progress)(done, all);
    }
}

/// True if the host asks to end; always false without a host.
pub(crate) fn is_interrupted() -> bool {
    HOST.get().is_some_and(|host| (host.is_interrupted)())
}

/// Sets the process clock as host, for tests of timings.
#[cfg(test)]
pub(crate) fn provide_clock() {
    static START: std::sync::LazyLock<std::time::Instant> =
        std::sync::LazyLock::new(std::time::Instant::now);
    set_host(Host {
        clock: || START.elapsed(),
        has_memory: |_| true,
        may_start_thread: || Ok(()),
        progress: |_, _| {},
        is_interrupted: || false,
    });
}

/// An instant of the host's clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant(Duration);

impl Instant {
    /// Current time; constant without a host.
    pub fn now() -> Self {
        Self(HOST.get().map_or(Duration::ZERO, |host| (host.clock)()))
    }

    /// Time since this instant.
    pub fn elapsed(self) -> Duration {
        Self::now().0.saturating_sub(self.0)
    }
}
