//! Memory for the values of a table, asked for before it is taken.

use crate::error::InputError;
use crate::memory;
use std::path::Path;

/// Numbers for each row beside its fields: its line, and the times and samples of the record that are
/// made of the table while it is there. Reading a record of a million rows with two columns was measured
/// to take 107 bytes for each row, its text included; a third more is for what the allocator cannot use.
const BESIDE: usize = 14;

/// How many rows the values of a text can have.
#[derive(Debug, Clone, Copy)]
pub struct TableMemory<'a> {
    path: &'a Path,
    lines: usize,
    bytes: usize,
}

impl<'a> TableMemory<'a> {
    /// The room that a text needs; `path` is what messages call it.
    pub fn of(path: &'a Path, text: &str) -> Self {
        let ends = text.bytes().filter(|byte| *byte == b'\n');
        Self {
            path,
            lines: 1 + ends.count(),
            bytes: text.len(),
        }
    }

    /// Most rows of so many fields: each takes at least its delimiters and its line end.
    fn rows(&self, width: usize) -> usize {
        self.lines.min(self.bytes / width.max(1) + 1)
    }

    /// Refuses a table of so many columns whose values do not fit into memory.
    ///
    /// # Errors
    /// With what it may need and what is available.
    pub fn check(&self, width: usize) -> Result<(), InputError> {
        let numbers = self.rows(width).saturating_mul(width + BESIDE);
        let bytes = numbers.saturating_mul(size_of::<f64>());
        memory::check_file(self.path, bytes as u64)
    }

    /// An empty list with room for a value of each row of so many fields.
    ///
    /// # Errors
    /// When the system has no such memory.
    pub fn list<T>(&self, width: usize) -> Result<Vec<T>, InputError> {
        let mut list = Vec::new();
        let rows = self.rows(width);
        match list.try_reserve_exact(rows) {
            Ok(()) => Ok(list),
            Err(_) => Err(
                InputError::file(self.path, "the file does not fit into memory")
                    .found(format!("up to {rows} rows of {width} fields"))
                    .expected("a shorter file, or more memory"),
            ),
        }
    }
}
