//! Rows by the names of their records.

use super::journal::{journals, record_of, unreadable};
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
    /// Of each record, the number of its file and the position of its line.
    places: HashMap<String, (usize, u64)>,
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
                let name = record_of(line)?.into_owned();
                index.places.entry(name).or_insert((number, position));
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
        let Some((path, position)) = place.and_then(|(n, at)| Some((self.files.get(*n)?, at)))
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
