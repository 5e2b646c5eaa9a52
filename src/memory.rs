//! One bound on the memory of a command: a failed allocation would abort the program.

use crate::error::InputError;
use kmcfit_core::number_format::significant;
use std::path::Path;

/// Most memory that a file may expand to, bytes. A table of the longest text, 4 GB, takes about as much.
pub const MOST_BYTES: u64 = 16_000_000_000;
/// Most nodes times parameters of a fit, of which up to 64 count: the Jacobian of few parameters is dense, with 8 bytes for each; that of
/// many is sparse and takes about as much as 64 columns.
pub const MOST_NODES_TIMES_PARAMETERS: usize = 1_000_000_000;

/// Refuses a file that may expand to more than [`MOST_BYTES`].
///
/// # Errors
/// With what it may need.
pub fn check_file(path: &Path, needed: u64) -> Result<(), InputError> {
    match needed <= MOST_BYTES {
        true => Ok(()),
        false => Err(InputError::file(path, "the file does not fit into memory")
            .found(format!("a file that may need {}", in_words(needed)))
            .expected(format!("at most {}", in_words(MOST_BYTES)))),
    }
}

/// A size as text: three digits and a unit.
fn in_words(bytes: u64) -> String {
    format!("{} GB", significant(bytes as f64 / 1e9, 3))
}
