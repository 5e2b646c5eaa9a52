//! The journal of a shard: its rows, and beside it its curves.

use super::row::{Curve, Row};
use super::shard::Shard;
use crate::error::InputError;
use crate::results::{RowFile, complete_lines};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two calls that make the rows durable.
const SYNC: Duration = Duration::from_secs(5);

/// The file of the rows of a shard.
pub fn rows_path(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(format!("rows-{shard}.jsonl"))
}

/// The file of its curves.
pub fn curves_path(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(format!("curves-{shard}.jsonl"))
}

/// The files of rows in a folder, in the order of their names.
pub fn journals(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    files(folder, "rows-").map_err(|error| unreadable(folder, error))
}

/// The files of curves.
pub fn curve_files(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    files(folder, "curves-").map_err(|error| unreadable(folder, error))
}

fn files(folder: &Path, start: &str) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        if name.starts_with(start) && name.contains("-of-") && name.ends_with(".jsonl") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Hands the complete lines of a file of rows to `each`.
pub fn recorded(path: &Path, each: &mut dyn FnMut(&LineName)) -> Result<(), InputError> {
    let read = complete_lines(path, |_, line| {
        each(&LineName::of(line)?);
        Ok(())
    });
    read.map(drop).map_err(|error| unreadable(path, error))
}

/// A journal that cannot be used.
pub fn unreadable(path: &Path, error: io::Error) -> InputError {
    InputError::file(path, "the rows cannot be read or written to")
        .found(error)
        .expected("a journal of a fleet that can be written to")
}

/// The record of a line of a journal.
#[derive(Debug, Deserialize)]
pub struct LineName<'a> {
    /// Its name.
    #[serde(borrow)]
    pub record: Cow<'a, str>,
    #[serde(default)]
    error: Option<IgnoredAny>,
}

impl<'a> LineName<'a> {
    /// # Errors
    /// If the line is not one of a journal.
    pub fn of(line: &'a str) -> io::Result<Self> {
        Ok(serde_json::from_str(line)?)
    }

    /// True for a row without estimates.
    pub fn is_error(&self) -> bool {
        self.error.is_some()
    }
}

/// The journal of a shard. A record's curves are written before its row, so that a row has all of its curves; curves without a row are those
/// of a process that was killed between the two, and have no effect.
#[derive(Debug)]
pub struct Journal {
    rows: RowFile,
    curves: RowFile,
    synced: Instant,
}

impl Journal {
    /// Opens or creates the journal, and hands its rows to `each`.
    ///
    /// # Errors
    /// If another process works on the shard, or the files cannot be read or written to.
    pub fn open(
        folder: &Path,
        shard: Shard,
        mut each: impl FnMut(&LineName),
    ) -> Result<Self, InputError> {
        let open = |path: PathBuf, each: &mut dyn FnMut(&LineName)| {
            let opened = RowFile::open(&path, |line| {
                each(&LineName::of(line)?);
                Ok(())
            });
            opened.map_err(|error| match error.kind() {
                io::ErrorKind::WouldBlock => {
                    InputError::file(&path, "another process works on this shard")
                        .expected("one process for each shard")
                        .hint("wait for it, or give each process a shard of its own")
                }
                _ => unreadable(&path, error),
            })
        };
        Ok(Self {
            rows: open(rows_path(folder, shard), &mut each)?,
            curves: open(curves_path(folder, shard), &mut |_| {})?,
            synced: Instant::now(),
        })
    }

    /// Appends the results of a record.
    ///
    /// # Errors
    /// Errors of the file system; the journal then lacks this row.
    pub fn append(&mut self, row: &Row, curves: &[Curve]) -> io::Result<()> {
        let line = |text: serde_json::Result<String>| Ok::<_, io::Error>(text? + "\n");
        let mut text = String::new();
        for curve in curves {
            text += &line(serde_json::to_string(curve))?;
        }
        if !text.is_empty() {
            self.curves.append(text.as_bytes())?;
        }
        self.rows
            .append(line(serde_json::to_string(row))?.as_bytes())?;
        if self.synced.elapsed() >= SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// Makes the rows durable.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn sync(&mut self) -> io::Result<()> {
        self.synced = Instant::now();
        self.curves.sync()?;
        self.rows.sync()
    }
}
