//! Signals: Ctrl-C, SIGTERM and SIGHUP end a run in order, a second one at once.

use super::{INTERRUPTED, TERMINATED};
use signal_hook::consts::SIGINT;
#[cfg(unix)]
use signal_hook::consts::{SIGHUP, SIGTERM};
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
#[cfg(unix)]
use std::time::{Duration, Instant};

/// The last signal received, or 0.
static RECEIVED: AtomicUsize = AtomicUsize::new(0);
/// The flag of the command that runs.
static CURRENT: Mutex<Option<Arc<AtomicBool>>> = Mutex::new(None);
/// Signals within this time are one: `timeout` of GNU and some job schedulers send each to the process and to its group.
#[cfg(unix)]
const ONE: Duration = Duration::from_millis(500);

/// A flag that a signal sets. A second signal ends the process with its exit code, without waiting for the iteration.
pub fn flag() -> Arc<AtomicBool> {
    static LISTENING: OnceLock<io::Result<()>> = OnceLock::new();
    let flag = Arc::new(AtomicBool::new(false));
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&flag));
    RECEIVED.store(0, Ordering::Relaxed);
    if let Err(error) = LISTENING.get_or_init(listen) {
        super::say(
            "warning",
            format!("Ctrl-C will end the run without results: {error}"),
        );
    }
    flag
}

/// Starts the thread that waits for signals.
#[cfg(unix)]
#[expect(
    clippy::disallowed_methods,
    reason = "a refusal is reported; the clock is that of the process"
)]
fn listen() -> io::Result<()> {
    // SIGINT is always taken: shells without job control start background jobs that ignore it.
    let signals = [SIGINT, SIGTERM, SIGHUP].into_iter();
    let signals = signals.filter(|signal| *signal == SIGINT || !is_ignored(*signal));
    let mut signals = signal_hook::iterator::Signals::new(signals)?;
    let wait = move || {
        let mut first: Option<Instant> = None;
        for signal in signals.forever() {
            let is_second = RECEIVED.swap(signal.unsigned_abs() as usize, Ordering::Relaxed) != 0;
            if is_second && first.is_some_and(|first| first.elapsed() > ONE) {
                signal_hook::low_level::exit(exit_code().into());
            }
            if !is_second {
                first = Some(Instant::now());
            }
            if let Some(flag) = &*CURRENT.lock().unwrap_or_else(PoisonError::into_inner) {
                flag.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::Builder::new().spawn(wait).map(drop)
}

#[cfg(not(unix))]
fn listen() -> io::Result<()> {
    let flag = CURRENT
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone();
    signal_hook::flag::register(SIGINT, flag.unwrap_or_default()).map(drop)
}

/// True if the process was started with the signal ignored (`nohup`, `trap '' TERM`), by `/proc/self/status` on Linux; false on
/// other systems.
#[cfg(unix)]
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
        signal if signal == SIGINT.unsigned_abs() as usize || signal == 0 => INTERRUPTED,
        _ => TERMINATED,
    }
}

/// Makes a file that grows beyond a limit (`ulimit -f`) an error of the write, which is reported, and not a signal
/// that kills the process.
pub fn ignore_file_size_signal() {
    #[cfg(unix)]
    // Without a handler the signal kills the process, as by default.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}
