//! The folder of a fleet: its model, and the rows so far.

use super::fit::{FleetModel, Row, content_of};
use super::records::{Record, RecordList};
use crate::digest::digest;
use crate::error::InputError;
use crate::results::{RowFile, write_together};
use crate::text_io::{LONGEST_TABLE, quote, read_bytes, read_text};
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

/// What the folder belongs to.
const IDENTITY: &str = "fleet.json";
/// The rows.
const ROWS: &str = "rows.jsonl";
/// All files of a fleet: a folder with others is refused.
const FILES: [&str; 4] = [IDENTITY, ROWS, "rows.csv", "fleet.html"];
/// Version of the format.
const FORMAT: u32 = 1;
/// Longest identity, bytes.
const LONGEST: u64 = 1 << 24;

/// The model of a fleet. Only rows of the same model and version belong together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetIdentity {
    format: u32,
    /// Version of kmcfit.
    pub version: String,
    /// Model file, as given.
    pub model: PathBuf,
    /// Overrides (`--set`).
    pub overrides: Vec<String>,
    /// SHA-256 digests of the model with its overrides, and of the files that it reads beside the records.
    pub sha256: Vec<(PathBuf, String)>,
}

impl FleetIdentity {
    fn of(model: &FleetModel) -> Result<Self, InputError> {
        let file = &model.file;
        let own = (file.path.clone(), digest(file.effective_text().as_bytes()));
        let record = file.spec.experiments.first().and_then(|e| e.data.as_ref());
        let record = record.map(|name| file.resolve(&name.0));
        let others = file
            .data_files()
            .into_iter()
            .filter(|path| Some(path) != record.as_ref());
        let others = others.map(|path| {
            let bytes = read_bytes(&path, "a data file", LONGEST_TABLE)?;
            Ok((path, digest(&bytes)))
        });
        let sha256 = std::iter::once(Ok(own))
            .chain(others)
            .collect::<Result<_, InputError>>()?;
        Ok(Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            model: file.path.clone(),
            overrides: file.override_texts(),
            sha256,
        })
    }
}

/// The folder of a fleet, locked against other processes until drop.
#[derive(Debug)]
pub struct FleetFolder {
    /// Its path.
    pub path: PathBuf,
    /// Its model.
    pub identity: FleetIdentity,
    file: RowFile,
    rows: HashMap<String, Row>,
}

impl FleetFolder {
    /// Creates the folder of a fleet, or opens it to go on after its rows.
    ///
    /// # Errors
    /// If the folder belongs to another model or holds other files, or another process works in it.
    pub fn open(path: &Path, model: &FleetModel) -> Result<Self, InputError> {
        let identity = FleetIdentity::of(model)?;
        if path.exists() {
            check(path, &identity)?;
        }
        let mut rows = HashMap::new();
        let file = path.join(ROWS);
        let text = serde_json::to_string_pretty(&identity).unwrap_or_default() + "\n";
        let written = match path.join(IDENTITY).exists() {
            true => Ok(()),
            false => write_together(&[(&path.join(IDENTITY), &text)]),
        };
        let opened = written.and_then(|()| {
            RowFile::open(&file, |line| {
                let row: Row = serde_json::from_str(line)?;
                rows.insert(row.record.clone(), row);
                Ok(())
            })
        });
        let file = opened.map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock => {
                InputError::file(&file, "another process works on this fleet")
                    .expected("one process for each fleet")
                    .hint("wait for it, or give another folder with --out")
            }
            io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
                InputError::file(&file, "this is not a row of a fleet of this version")
                    .found(&error)
                    .expected("a folder of its own for the fleet")
            }
            _ => unusable(&file, &error),
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            identity,
            file,
            rows,
        })
    }

    /// The row of a record; the last one where it was fitted again.
    pub fn row(&self, record: &str) -> Option<&Row> {
        self.rows.get(record)
    }

    /// Checks that a record is the one of its row, if it has one with estimates.
    ///
    /// # Errors
    /// Names the record.
    pub fn check_record(&self, record: &Record) -> Result<(), InputError> {
        // A record that could not be read has no digest, and may be there now.
        let row = self.row(&record.name).filter(|row| row.error.is_none());
        let is_same =
            row.is_none_or(|row| content_of(record).is_ok_and(|(_, now)| now == row.sha256));
        match is_same {
            true => Ok(()),
            false => Err(InputError::file(
                &record.path,
                "this record has changed since its row was written",
            )
            .expected("the records of the rows that are there")
            .hint(format!(
                "fit the records again in another folder than {}",
                self.path.display()
            ))),
        }
    }

    /// Checks that all rows are those of records of the list.
    ///
    /// # Errors
    /// Names the first other one.
    pub fn check_names(&self, list: &RecordList) -> Result<(), InputError> {
        let names: HashSet<&str> = list
            .records
            .iter()
            .map(|record| record.name.as_str())
            .collect();
        let others = self
            .rows
            .keys()
            .filter(|name| !names.contains(name.as_str()));
        match others.min() {
            None => Ok(()),
            Some(other) => Err(InputError::file(
                &self.path,
                "the folder holds rows of other records",
            )
            .found(quote(other))
            .expected("the records with which the fleet was begun, or a folder of its own")),
        }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Errors of the file system; the rows before are kept.
    pub fn append(&mut self, row: Row) -> Result<(), InputError> {
        let line = serde_json::to_string(&row).map_err(io::Error::other);
        let appended = line.and_then(|line| self.file.append(format!("{line}\n").as_bytes()));
        appended.map_err(|error| unusable(&self.path.join(ROWS), &error))?;
        self.rows.insert(row.record.clone(), row);
        Ok(())
    }

    /// Writes table and page.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write(&self, table: &str, page: &str) -> Result<(), InputError> {
        let [.., table_name, page_name] = FILES.map(|name| self.path.join(name));
        let files = [(table_name.as_path(), table), (page_name.as_path(), page)];
        let written = self.file.sync().and_then(|()| write_together(&files));
        written.map_err(|error| unusable(&self.path, &error))
    }
}

/// Refuses a folder of another fleet or with other files.
fn check(path: &Path, identity: &FleetIdentity) -> Result<(), InputError> {
    let entries = std::fs::read_dir(path).map_err(|error| unusable(path, &error))?;
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !FILES.contains(&name.as_str()) && !name.starts_with(".kmcfit-") {
            return Err(
                InputError::file(path.join(name), "this file is not one of a fleet")
                    .expected("a folder of its own for the fleet")
                    .hint("move it away, or give another folder with --out"),
            );
        }
    }
    let file = path.join(IDENTITY);
    if !file.exists() {
        return match path.join(ROWS).exists() {
            true => Err(
                InputError::file(path, "the folder holds rows of an unknown fleet")
                    .found(format!("{ROWS} without {IDENTITY}"))
                    .expected("a folder of its own for the fleet"),
            ),
            false => Ok(()),
        };
    }
    let text = read_text(&file, "the identity of a fleet", LONGEST)?;
    let known: FleetIdentity = serde_json::from_str(&text).map_err(|error| {
        InputError::file(&file, "this is not the identity of a fleet of this version")
            .found(error)
            .expected("a folder of its own for the fleet")
    })?;
    let other = |found: String| {
        InputError::file(path, "the folder belongs to another fleet")
            .found(found)
            .expected("the model with which the fleet was begun, or a folder of its own")
    };
    if known.version != identity.version {
        return Err(other(format!("rows of kmcfit {}", known.version)));
    }
    if known.overrides != identity.overrides {
        return Err(other(format!(
            "values {}",
            quote(&known.overrides.join(", "))
        )));
    }
    match known
        .sha256
        .iter()
        .zip(&identity.sha256)
        .find(|(a, b)| a.1 != b.1)
    {
        Some((_, (file, _))) => Err(other(format!("{}, which has changed", file.display()))),
        None if known.sha256.len() != identity.sha256.len() => {
            Err(other(known.model.display().to_string()))
        }
        None => Ok(()),
    }
}

fn unusable(path: &Path, error: &io::Error) -> InputError {
    InputError::file(path, "the fleet cannot be read or written to")
        .found(error)
        .expected("room for the rows, in a folder that can be written to")
        .hint("the same command goes on after the rows that are written")
}
