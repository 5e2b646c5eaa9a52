//! Upper estimate of the memory of a table, checked against the bound on memory before allocation.

use crate::error::InputError;
use crate::memory;
use crate::text_io::line_ends;
use std::path::Path;

/// Numbers stored for each row beside its fields: its line, the times and samples of the record made from the table, and those of the
/// tests for faulty samples and of the spectrum. Measured: 222 bytes per row, text included, for `check` of a record of two million rows
/// with two columns; one third is added for losses of the allocator.
const NUMBERS_PER_ROW: usize = 35;

/// Bounds on the number of rows of a text.
#[derive(Debug, Clone, Copy)]
pub struct TableMemory<'a> {
    path: &'a Path,
    lines: usize,
    bytes: usize,
}

impl<'a> TableMemory<'a> {
    /// Bounds for a text; messages name `path`.
    pub fn of(path: &'a Path, text: &str) -> Self {
        Self {
            path,
            lines: 1 + line_ends(text.as_bytes()),
            bytes: text.len(),
        }
    }

    /// Most rows with `width` fields: each takes at least its delimiters and its line end.
    fn rows(&self, width: usize) -> usize {
        self.lines.min(self.bytes / width.max(1) + 1)
    }

    /// Refuses a table with `width` columns that exceeds the available memory.
    ///
    /// # Errors
    /// With the needed and the available memory.
    pub fn check(&self, width: usize) -> Result<(), InputError> {
        let numbers = self.rows(width).saturating_mul(width + NUMBERS_PER_ROW);
        let bytes = numbers.saturating_mul(size_of::<f64>());
        memory::check_file(self.path, bytes as u64)
    }

    /// An empty list with capacity for one value of each row with `width` fields.
    ///
    /// # Errors
    /// When the allocation fails.
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
