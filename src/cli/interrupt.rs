//! Signals: Ctrl-C and SIGTERM end a run in order, a second one at once.

use super::{INTERRUPTED, TERMINATED};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

/// The last signal received, or 0.
static RECEIVED: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// A flag that Ctrl-C or SIGTERM sets. A second signal ends the process with its exit code, without waiting for the
/// iteration; `kmcfit resume` then continues from the last checkpoint.
pub fn flag() -> Arc<AtomicBool> {
    let is_set = Arc::new(AtomicBool::new(false));
    if let Err(error) = register(&is_set) {
        super::say(
            "warning",
            format!("Ctrl-C will end the run without results: {error}"),
        );
    }
    is_set
}

fn register(is_set: &Arc<AtomicBool>) -> io::Result<()> {
    for (signal, code) in [(SIGINT, INTERRUPTED), (SIGTERM, TERMINATED)] {
        // SIGINT is always taken: shells without job control start background jobs that ignore it.
        if signal == SIGTERM && is_ignored(SIGTERM) {
            continue;
        }
        // The order matters: the first signal sets the flag only after the handler that ends the process has found it unset.
        flag::register_conditional_shutdown(signal, code.into(), Arc::clone(is_set))?;
        flag::register(signal, Arc::clone(is_set))?;
        flag::register_usize(
            signal,
            Arc::clone(&RECEIVED),
            signal.unsigned_abs() as usize,
        )?;
    }
    Ok(())
}

/// True if the process was started with the signal ignored (`trap '' TERM`), by `/proc/self/status` on Linux; false on
/// other systems.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.unwrap_or(0) >> (signal - 1) & 1 == 1
}

/// True once a signal has asked the process to end.
pub fn is_asked() -> bool {
    RECEIVED.load(Ordering::Relaxed) != 0
}

/// The exit code of a run that a signal ended.
pub fn exit_code() -> u8 {
    match RECEIVED.load(Ordering::Relaxed) {
        signal if signal == SIGTERM.unsigned_abs() as usize => TERMINATED,
        _ => INTERRUPTED,
    }
}

/// Notes the command that continues interrupted work.
pub fn say_resumable(folder: &Path, what: &str) {
    let folder = folder.display();
    super::say(
        "note",
        format!("continue this {what} with `kmcfit resume {folder}`"),
    );
}

/// Makes a file that grows beyond a limit (`ulimit -f`) an error of the write, which is reported, and not a signal
/// that kills the process.
pub fn ignore_file_size_signal() {
    #[cfg(unix)]
    // Without a handler the signal kills the process, as by default.
    let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}
