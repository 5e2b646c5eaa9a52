//! Injected faults for tests: makes one chosen operation of the operating system fail.
//!
//! Every write, rename, sync, removal and thread start of the program passes [`check`]. In builds with
//! debug assertions the environment variable `KMCFIT_FAULT` selects the operations that fail, counted from 1
//! over the whole run: `7` fails the seventh, `7+` the seventh and all later ones, and `7!` aborts the process in place
//! of the seventh, as a kill does. The operation that failed first is written to the file that `KMCFIT_FAULT_LOG` names, so that a test detects the last operation.
//! In other builds [`check`] does nothing.

use std::io;

/// An operation that can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operation {
    /// Creates a file or folder.
    Create,
    /// Writes to a file, or to standard output or standard error.
    Write,
    /// Makes a file or a folder durable.
    Sync,
    /// Renames or links a file or folder.
    Rename,
    /// Removes or truncates a file, or removes a folder.
    Remove,
    /// Starts a thread.
    Spawn,
}

/// Fails at the operations that a test selects.
///
/// # Errors
/// The injected error.
#[cfg(not(debug_assertions))]
#[allow(clippy::unnecessary_wraps)]
pub(crate) fn check(_: Operation) -> io::Result<()> {
    Ok(())
}

/// Fails at the operations that a test selects.
///
/// # Errors
/// The injected error.
#[cfg(debug_assertions)]
pub(crate) fn check(operation: Operation) -> io::Result<()> {
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    static COUNT: AtomicU64 = AtomicU64::new(0);
    /// The number of the first operation that fails, and `+` or `!` if that follows it.
    static FIRST: LazyLock<Option<(u64, String)>> = LazyLock::new(|| {
        let text = std::env::var("KMCFIT_FAULT").ok()?;
        let number = text.trim_end_matches(['+', '!']);
        Some((number.parse().ok()?, text[number.len()..].to_owned()))
    });
    let Some((first, mode)) = &*FIRST else {
        return Ok(());
    };
    let (number, first) = (1 + COUNT.fetch_add(1, Ordering::Relaxed), *first);
    if number < first || number > first && mode != "+" {
        return Ok(());
    }
    if number == first
        && let Ok(log) = std::env::var("KMCFIT_FAULT_LOG")
    {
        // The log belongs to the test, not to the program under test.
        #[allow(clippy::disallowed_methods)]
        let _ = std::fs::write(log, format!("{number} {operation:?}\n"));
    }
    if mode == "!" {
        std::process::abort();
    }
    Err(io::Error::other(format!("injected fault in {operation:?}")))
}
