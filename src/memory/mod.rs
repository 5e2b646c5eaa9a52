//! The memory that the process may still take, and refusals in time.
//!
//! An allocation that fails ends a Rust program at once. So what needs much memory asks here before it
//! takes any, and is refused with a message that states what is needed and what is available.

mod restart;
mod sources;

pub use restart::restart_with_plain_allocators;
pub use sources::{Available, Limit};

use crate::error::InputError;
use std::path::Path;

/// Assumed to be available where the system does not say, bytes.
const ASSUMED: u64 = 4_000_000_000;

/// Taken by a command beside what grows with its input, bytes: parsed models, figures, pages, and the
/// stacks of its threads. Commands on small models were measured to take up to 40 MB.
pub(crate) const BASE: u64 = 64_000_000;

/// Address space of a thread: 2 MB of stack and a segment of 32 MB of the allocator, which is reserved
/// with its alignment.
const THREAD_ADDRESSES: u64 = 72_000_000;

/// Memory of a thread that waits for work: its stack and the first pages of its segment.
const THREAD_PAGES: u64 = 2_000_000;

/// Less than this is not worth a look at the limits, bytes: [`BASE`] has room for it.
const SMALL: u64 = 4_000_000;

/// The memory that the process may still take: the least that any of its limits leaves.
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
    let available = available();
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

/// Refuses to begin where a command on a small model might not find the memory that it takes.
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

/// The threads that have the memory to work, at most `wanted`, and the bytes that each takes beside
/// `each` of its own.
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

/// Bytes in words: three digits and a unit.
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
    format!("{value:.decimals$} {}", units[unit])
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
    fn what_no_machine_has_is_refused() {
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
