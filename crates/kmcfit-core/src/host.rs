//! Services of the host, provided by the application: a clock, the memory limit and the permission to start a thread.
//!
//! Without them a fit has no time limit and its timings are zero, memory counts as available, and threads may start.

use std::io;
use std::sync::OnceLock;
use std::time::Duration;

/// Functions of the host.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Time since any fixed instant; never decreasing.
    pub clock: fn() -> Duration,
    /// Whether so many more bytes can be allocated.
    pub has_memory: fn(u64) -> bool,
    /// Called before a thread is started; an error counts as the operating system's refusal.
    pub may_start_thread: fn() -> io::Result<()>,
}

static HOST: OnceLock<Host> = OnceLock::new();

/// Provides the functions of the host, for the rest of the process; later calls change nothing.
pub fn set_host(host: Host) {
    let _ = HOST.set(host);
}

/// Whether so many more bytes can be allocated; true where the host sets no limit.
pub(crate) fn has_memory(bytes: u64) -> bool {
    HOST.get().is_none_or(|host| (host.has_memory)(bytes))
}

/// Asks the host before a thread is started.
///
/// # Errors
/// The host's refusal.
pub(crate) fn may_start_thread() -> io::Result<()> {
    HOST.get().map_or(Ok(()), |host| (host.may_start_thread)())
}

/// Provides the clock of the process to the tests of timings.
#[cfg(test)]
pub(crate) fn provide_clock() {
    static START: std::sync::LazyLock<std::time::Instant> =
        std::sync::LazyLock::new(std::time::Instant::now);
    set_host(Host {
        clock: || START.elapsed(),
        has_memory: |_| true,
        may_start_thread: || Ok(()),
    });
}

/// An instant of the host's clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant(Duration);

impl Instant {
    /// The present; always the same where the host provides no clock.
    pub fn now() -> Self {
        Self(HOST.get().map_or(Duration::ZERO, |host| (host.clock)()))
    }

    /// Time since this instant.
    pub fn elapsed(self) -> Duration {
        Self::now().0.saturating_sub(self.0)
    }
}
