//! Available memory of the process, and checks against it before large allocations.
//!
//! A failed allocation aborts a Rust program. Computations with large memory therefore check the available memory
//! first, and fail with a message that states the needed and the available memory.

mod restart;
mod sources;

pub use restart::restart_with_plain_allocators;
pub use sources::{Available, Limit};

use crate::error::InputError;
use crate::number_format::significant;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Available memory on systems without a stated limit, bytes.
const ASSUMED: u64 = 4_000_000_000;

/// Memory of a command on a small model, bytes: parsed models, figures, pages, and stacks of threads. Measured: up to
/// 40 MB.
pub(crate) const BASE: u64 = 64_000_000;

/// Address space of a thread, bytes: 2 MB of stack and a segment of 32 MB of the allocator, reserved with its
/// alignment.
const THREAD_ADDRESSES: u64 = 72_000_000;

/// Memory of an idle thread, bytes: its stack and the first pages of its segment.
const THREAD_PAGES: u64 = 2_000_000;

/// Requests below this are not checked, bytes: [`BASE`] covers them.
const SMALL: u64 = 16_000_000;

/// Available memory when it was last determined.
static LAST: Mutex<Option<(Instant, Available)>> = Mutex::new(None);

/// Age up to which that holds for requests below one [`SHARE`]th of it; the system's files take 0.1 ms to read.
const RECENT: Duration = Duration::from_millis(20);
const SHARE: u64 = 16;

/// Available memory of the process: the least that any of its limits leaves.
pub fn available() -> Available {
    Available::under(Path::new("/")).unwrap_or(Available {
        bytes: ASSUMED,
        limit: Limit::Assumed,
    })
}

/// Compares `needed` bytes with the memory that is available.
///
/// # Errors
/// The memory that is available, where it is less.
pub fn check(needed: u64) -> Result<(), Available> {
    if needed < SMALL {
        return Ok(());
    }
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let is_recent = |(at, available): (Instant, Available)| {
        at.elapsed() < RECENT && needed < available.bytes / SHARE
    };
    if last.is_some_and(is_recent) {
        return Ok(());
    }
    let available = available();
    *last = Some((Instant::now(), available));
    drop(last);
    match needed <= available.bytes {
        true => Ok(()),
        false => Err(available),
    }
}

/// As [`check`], with an error about a file.
///
/// # Errors
/// When less is available.
pub fn check_file(path: &Path, needed: u64) -> Result<(), InputError> {
    check(needed).map_err(|available| {
        InputError::file(path, "the file does not fit into memory")
            .found(format!("a file that may need {}", in_words(needed as f64)))
            .expected(format!("at most {available}"))
    })
}

/// Refuses to start with less memory than a command on a small model needs.
///
/// # Errors
/// When less than that is available.
pub(crate) fn check_base() -> Result<(), InputError> {
    check(BASE).map_err(|available| {
        InputError::argument("memory", "too little memory to start")
            .found(available)
            .expected(format!("at least {}", in_words(BASE as f64)))
    })
}

/// Number of threads, at most `wanted`, that fit into memory if each needs `each` bytes beside its own overhead.
pub(crate) fn threads_within(wanted: usize, each: u64) -> usize {
    let available = available();
    let own = match available.limit {
        Limit::AddressSpace | Limit::Data => THREAD_ADDRESSES,
        _ => THREAD_PAGES,
    };
    let room = available.bytes.saturating_sub(BASE) / own.saturating_add(each);
    usize::try_from(room)
        .unwrap_or(usize::MAX)
        .clamp(1, wanted.max(1))
}

/// A size as text: three digits and a unit.
pub fn in_words(bytes: f64) -> String {
    let units = ["bytes", "kB", "MB", "GB", "TB", "PB"];
    let mut value = bytes;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    let decimals = match value {
        small if unit > 0 && small < 9.995 => 2,
        middle if unit > 0 && middle < 99.95 => 1,
        _ => 0,
    };
    match value >= 1e6 {
        true => format!("{} {}", significant(value, 3), units[unit]),
        false => format!("{value:.decimals$} {}", units[unit]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_three_digits() {
        let words = [
            0.0, 999.0, 1000.0, 9994.0, 9996.0, 99_960.0, 123_456.0, 9e14, 9e20,
        ]
        .map(in_words);
        let expected = [
            "0 bytes",
            "999 bytes",
            "1.00 kB",
            "9.99 kB",
            "10.0 kB",
            "100 kB",
            "123 kB",
            "900 TB",
            "900000 PB",
        ];
        assert_eq!(words, expected);
    }

    #[test]
    fn sizes_beyond_any_memory_are_refused() {
        assert_eq!(check(SMALL - 1), Ok(()));
        let available = check(u64::MAX).expect_err("too much");
        assert!(available.bytes < u64::MAX);
        let error = check_file(Path::new("a.csv"), u64::MAX).expect_err("too much");
        let text = error.to_string();
        assert!(
            text.starts_with("a.csv: the file does not fit into memory"),
            "{text}"
        );
        assert_eq!(threads_within(4, u64::MAX), 1);
        assert_eq!(threads_within(0, 0), 1);
    }
}
