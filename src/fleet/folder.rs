//! The folder of a fleet: its model, and the rows so far.

use super::fit::{Row, content_of};
use super::records::FleetRecord;
use crate::config::ModelFile;
use crate::digest::digest;
use crate::error::InputError;
use crate::results::{RowFile, write_together};
use crate::text_io::{LONGEST_TABLE, read_bytes, read_text};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// What the folder belongs to.
const IDENTITY: &str = "fleet.json";
/// The rows.
const ROWS: &str = "rows.jsonl";

/// The model of a fleet. Only rows of the same model and version belong together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetIdentity {
    /// Version of kmcfit.
    pub version: String,
    /// Model file, as given.
    pub model: PathBuf,
    /// SHA-256 digest of the model with its overrides, and of the files that it reads beside the records.
    sha256: String,
}

impl FleetIdentity {
    fn of(model: &ModelFile) -> Self {
        let mut content = model.effective_text().to_owned();
        let record = model.spec.experiments.first().and_then(|e| e.data.as_ref());
        let record = record.map(|name| model.resolve(name));
        let others = model.data_files().into_iter();
        for path in others.filter(|path| Some(path) != record.as_ref()) {
            // A file that cannot be read is the error of the fits.
            let bytes = read_bytes(&path, "a data file", LONGEST_TABLE);
            content += &digest(&bytes.unwrap_or_default());
        }
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            model: model.path.clone(),
            sha256: digest(content.as_bytes()),
        }
    }
}

/// The folder of a fleet, locked against other processes until drop.
#[derive(Debug)]
pub struct FleetFolder {
    /// Its path.
    pub path: PathBuf,
    file: RowFile,
    rows: HashMap<String, Row>,
}

impl FleetFolder {
    /// Creates the folder of a fleet, or opens it to go on after its rows.
    ///
    /// # Errors
    /// If the folder belongs to another model or holds other files, or another process works in it.
    pub fn open(path: &Path, model: &ModelFile) -> Result<Self, InputError> {
        let identity = FleetIdentity::of(model);
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
            _ => unusable(&file, &error),
        })?;
        Ok(Self {
            path: path.to_path_buf(),
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
    pub fn check_record(&self, record: &FleetRecord) -> Result<(), InputError> {
        // A record that could not be read has no digest, and may be there now.
        let row = self.row(&record.name).filter(|row| row.error.is_none());
        let is_same =
            row.is_none_or(|row| content_of(record).is_ok_and(|(_, now)| now == row.sha256));
        match is_same {
            true => Ok(()),
            false => Err(InputError::file(
                &record.path,
                "this record or its values in the table have changed since its row was written",
            )
            .expected("the records of the rows that are there")
            .hint(format!(
                "fit the records again in another folder than {}",
                self.path.display()
            ))),
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
        let [table_path, page_path] = ["rows.csv", "fleet.html"].map(|name| self.path.join(name));
        let files = [(table_path.as_path(), table), (page_path.as_path(), page)];
        let written = self.file.sync().and_then(|()| write_together(&files));
        written.map_err(|error| unusable(&self.path, &error))
    }
}

/// Refuses a folder of another fleet, and one with files of something else.
fn check(path: &Path, identity: &FleetIdentity) -> Result<(), InputError> {
    let file = path.join(IDENTITY);
    if !file.exists() {
        let entries = std::fs::read_dir(path).map_err(|error| unusable(path, &error))?;
        let names = entries.flatten().map(|entry| entry.file_name());
        let others = names.filter(|name| !name.to_string_lossy().starts_with(".kmcfit-"));
        return others.min().map_or(Ok(()), |name| {
            Err(
                InputError::file(path.join(name), "this file is not one of a fleet")
                    .expected("a folder of its own for the fleet")
                    .hint("move it away, or give another folder with --out"),
            )
        });
    }
    let text = read_text(&file, "the identity of a fleet", LONGEST_TABLE)?;
    let known: FleetIdentity = serde_json::from_str(&text).map_err(|error| {
        InputError::file(
            &file,
            "this is no fleet, or one of an earlier version of kmcfit",
        )
        .found(error)
        .expected("a folder of its own for the fleet")
        .hint("fit the records again into another folder with --out")
    })?;
    if known.version == identity.version && known.sha256 == identity.sha256 {
        return Ok(());
    }
    let found = match known.version == identity.version {
        true => format!("rows of another content of {}", known.model.display()),
        false => format!("rows of kmcfit {}", known.version),
    };
    Err(
        InputError::file(path, "the folder belongs to another fleet")
            .found(found)
            .expected("the model with which the fleet was begun, with its overrides and files, or a folder of its own"),
    )
}

fn unusable(path: &Path, error: &io::Error) -> InputError {
    InputError::file(path, "the fleet cannot be read or written to")
        .found(error)
        .expected("room for the rows, in a folder that can be written to")
        .hint("the same command goes on after the rows that are written")
}
