//! What the numerics take from their host, provided by the application: the memory limit and the permission to start a
//! thread. A library user need not provide any of it.

use std::io;
use std::sync::OnceLock;

/// Functions of the host.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Whether so many more bytes can be allocated.
    pub has_memory: fn(u64) -> bool,
    /// Called before a thread is started; an error counts as the operating system's refusal.
    pub may_start_thread: fn() -> io::Result<()>,
}

static HOST: OnceLock<Host> = OnceLock::new();

/// Provides the functions of the host, for the rest of the process; later calls change nothing.
pub fn provide(host: Host) {
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
