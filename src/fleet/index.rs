//! Rows by the names of their records.

use super::journal::{LineName, journals, unreadable};
use crate::error::InputError;
use crate::results::complete_lines;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Places of the rows in the journals of a folder.
#[derive(Debug, Default)]
pub struct RowIndex {
    files: Vec<PathBuf>,
    /// Of each record, the number of its file, the position of its line, and true for an error.
    places: HashMap<String, (usize, u64, bool)>,
}

impl RowIndex {
    /// Reads the journals of a folder.
    ///
    /// # Errors
    /// If one of them cannot be read.
    pub fn read(folder: &Path) -> Result<Self, InputError> {
        let mut index = Self {
            files: journals(folder)?,
            places: HashMap::new(),
        };
        for (number, path) in index.files.iter().enumerate() {
            let read = complete_lines(path, |position, line| {
                let name = LineName::of(line)?;
                let place = (number, position, name.is_error());
                let known = index
                    .places
                    .entry(name.record.into_owned())
                    .or_insert(place);
                // The first one with estimates, or else the last error.
                if known.2 {
                    *known = place;
                }
                Ok(())
            });
            read.map_err(|error| unreadable(path, error))?;
        }
        Ok(index)
    }

    /// True if the record has a row.
    pub fn has(&self, record: &str) -> bool {
        self.places.contains_key(record)
    }

    /// True if the record has a row with estimates.
    pub fn has_estimates(&self, record: &str) -> bool {
        self.places
            .get(record)
            .is_some_and(|(.., is_error)| !is_error)
    }

    /// All rows in the order in which they stand in the journals.
    ///
    /// # Errors
    /// If a journal cannot be read.
    pub fn lines(&self) -> Result<Vec<String>, InputError> {
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_unstable_by_key(|(_, place)| **place);
        let lines = places.into_iter().map(|(record, _)| self.line(record));
        lines.filter_map(Result::transpose).collect()
    }

    /// The row of a record as a line of JSON; `None` without a row.
    ///
    /// # Errors
    /// If the journal cannot be read.
    pub fn line(&self, record: &str) -> Result<Option<String>, InputError> {
        let place = self.places.get(record);
        let Some((path, position)) = place.and_then(|(n, at, _)| Some((self.files.get(*n)?, at)))
        else {
            return Ok(None);
        };
        let read = || {
            let mut reader = BufReader::new(File::open(path)?);
            reader.seek(SeekFrom::Start(*position))?;
            let mut line = String::new();
            reader.read_line(&mut line)?;
            Ok(line)
        };
        read().map(Some).map_err(|error| unreadable(path, error))
    }
}
