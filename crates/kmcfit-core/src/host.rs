//! Services of the host, provided by the application: a clock, a display of progress, and a request to end.
//!
//! Without a host, a fit has no time limit, timings are zero, no progress is shown, and no analysis ends early.

use std::sync::OnceLock;
use std::time::Duration;

/// Functions of the host.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Time since any fixed instant; never decreasing.
    pub clock: fn() -> Duration,
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
        progress: |_, _| {},
        is_interrupted: || false,
    });
}

/// An instant of the host's clock.
#[derive(Debug, Clone, Copy)]
pub struct Instant(Duration);

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
