//! The folder of a fleet: which model on which records.

use super::journal::journals;
use super::model::FleetModel;
use super::records::{Record, RecordList};
use crate::config::Override;
use crate::digest::digest;
use crate::error::InputError;
use crate::results::{MANIFEST, complete_lines, write_together};
use crate::text_io::{quote, read_text};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// Identity of the fleet.
const IDENTITY: &str = "fleet.json";
/// Its records.
const RECORDS: &str = "records.jsonl";
/// Files of a fleet without which a folder that has one of them is none of a fleet.
const OWN_FILES: [&str; 4] = [
    "fleet.html",
    "rows.parquet",
    "curves.parquet",
    "summary.json",
];
/// Version of the format.
const FORMAT: u32 = 1;
/// Longest identity, bytes.
const LONGEST: u64 = 1 << 24;

/// Identity of a fleet: rows of the same identity belong together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetIdentity {
    /// Version of the format.
    pub format: u32,
    /// Version of kmcfit.
    pub version: String,
    /// Model file, as given.
    pub model: PathBuf,
    /// SHA-256 digest of the model with its overrides.
    pub model_sha256: String,
    /// Overrides (`--set`).
    #[serde(default)]
    pub overrides: Vec<String>,
    /// Number of records.
    pub records: usize,
    /// SHA-256 digest of the list of records.
    pub records_sha256: String,
    /// True where a fit starts from the estimates of the record before.
    pub warm_start: bool,
    /// Column of the table over which the page shows the estimates, where one was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trend: Option<String>,
}

impl FleetIdentity {
    /// File name of the model.
    pub fn model_name(&self) -> String {
        let name = self.model.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Identity of a model on records.
    pub fn of(model: &FleetModel, list: &RecordList, warm_start: bool) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            model: std::path::absolute(&model.file.path)
                .unwrap_or_else(|_| model.file.path.clone()),
            model_sha256: digest(model.file.effective_text().as_bytes()),
            overrides: model.file.override_texts(),
            records: list.records.len(),
            records_sha256: list.digest(),
            warm_start,
            trend: None,
        }
    }
}

/// A record in the file of records.
#[derive(Serialize, Deserialize)]
struct RecordLine {
    record: String,
    path: PathBuf,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    overrides: Vec<String>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    system: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    columns: Vec<String>,
}

/// The folder of a fleet.
#[derive(Debug, Clone)]
pub struct FleetFolder {
    /// Path.
    pub path: PathBuf,
    /// Identity.
    pub identity: FleetIdentity,
}

impl FleetFolder {
    /// Creates the folder of a fleet, or opens that of the same fleet.
    ///
    /// # Errors
    /// If the folder belongs to another fleet or command, or cannot be written to.
    pub fn prepare(
        path: &Path,
        model: &FleetModel,
        list: &RecordList,
        warm_start: bool,
    ) -> Result<Self, InputError> {
        let own = FleetIdentity::of(model, list, warm_start);
        if let Some(found) = Self::existing(path)? {
            found.check(&own)?;
            return Ok(found);
        }
        Self::written(path, own, list)
    }

    /// The folder with this column as the axis of its page, if one is given.
    ///
    /// # Errors
    /// If the folder cannot be written to.
    pub fn with_trend(mut self, trend: Option<&str>) -> Result<Self, InputError> {
        if trend.is_some() && self.identity.trend.as_deref() != trend {
            self.identity.trend = trend.map(str::to_owned);
            write_identity(&self.path, &self.identity)?;
        }
        Ok(self)
    }

    /// Refuses a model that has changed since the fleet began.
    ///
    /// # Errors
    /// With what has changed.
    pub fn check_model(&self, effective_text: &str) -> Result<(), InputError> {
        self.check(&FleetIdentity {
            model_sha256: digest(effective_text.as_bytes()),
            version: env!("CARGO_PKG_VERSION").into(),
            ..self.identity.clone()
        })
    }

    /// As [`FleetFolder::prepare`], for records that become known one after another: their list is that of [`FleetFolder::complete`].
    ///
    /// # Errors
    /// If the folder belongs to another model or command, or cannot be written to.
    pub fn begin(path: &Path, model: &FleetModel, warm_start: bool) -> Result<Self, InputError> {
        let list = RecordList::default();
        let own = FleetIdentity::of(model, &list, warm_start);
        if let Some(found) = Self::existing(path)? {
            found.check(&FleetIdentity {
                records_sha256: found.identity.records_sha256.clone(),
                ..own
            })?;
            return Ok(found);
        }
        Self::written(path, own, &list)
    }

    /// The folder of [`FleetFolder::begin`] with the list of its records.
    ///
    /// # Errors
    /// If an earlier list has other records, or the folder cannot be written to.
    pub fn complete(self, list: &RecordList) -> Result<Self, InputError> {
        let own = FleetIdentity {
            records: list.records.len(),
            records_sha256: list.digest(),
            ..self.identity.clone()
        };
        match self.identity.records {
            0 => Self::written(&self.path, own, list),
            _ => self.check(&own).map(|()| self),
        }
    }

    /// The fleet of a folder that is there; `None` for a folder that may become that of a fleet.
    fn existing(path: &Path) -> Result<Option<Self>, InputError> {
        if path.join(IDENTITY).exists() {
            return Self::open(path).map(Some);
        }
        if path.join(MANIFEST).exists() {
            return Err(
                InputError::file(path, "the folder holds a run of another command")
                    .found(MANIFEST)
                    .expected("a folder of its own for the fleet"),
            );
        }
        if path.is_dir() && !journals(path)?.is_empty() {
            return Err(
                InputError::file(path, "the folder holds rows of an unknown fleet")
                    .found(format!("rows without {IDENTITY}"))
                    .expected("a folder of its own for the fleet"),
            );
        }
        if let Some(foreign) = OWN_FILES.iter().find(|name| path.join(name).exists()) {
            return Err(InputError::file(
                path,
                "the folder holds a file that the fleet would replace",
            )
            .found(*foreign)
            .expected("a folder of its own for the fleet"));
        }
        Ok(None)
    }

    fn written(
        path: &Path,
        identity: FleetIdentity,
        list: &RecordList,
    ) -> Result<Self, InputError> {
        let lines = std::iter::once(Ok(json_line(&list.columns))).chain(list.records.iter().map(
            |record| {
                Ok::<_, InputError>(json_line(&RecordLine {
                    record: record.name.clone(),
                    path: match record.is_in_memory() {
                        true => record.path.clone(),
                        false => absolute(&record.path)?,
                    },
                    overrides: record.overrides.iter().map(Override::to_string).collect(),
                    system: record.system.clone(),
                    columns: record.columns.clone(),
                }))
            },
        ));
        let lines: String = lines.collect::<Result<_, _>>()?;
        // The identity comes last: a folder with it has its records.
        write_file(path, RECORDS, &lines)?;
        write_identity(path, &identity)?;
        Ok(Self {
            path: path.to_path_buf(),
            identity,
        })
    }

    /// Opens the folder of a fleet.
    ///
    /// # Errors
    /// If it is none.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let file = path.join(IDENTITY);
        if !file.exists() {
            return Err(InputError::file(path, "this is not the folder of a fleet")
                .found(format!("no {IDENTITY}"))
                .expected("the folder of `kmcfit fleet --out`"));
        }
        let text = read_text(&file, "the identity of a fleet", LONGEST)?;
        let identity = serde_json::from_str(&text).map_err(|error| {
            InputError::file(&file, "the identity of the fleet is damaged").found(error)
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            identity,
        })
    }

    /// Error where the folder belongs to another fleet, which names what differs.
    fn check(&self, own: &FleetIdentity) -> Result<(), InputError> {
        let there = &self.identity;
        let other = |problem: &str, found: String, expected: String| {
            Err(InputError::file(&self.path, problem)
                .found(found)
                .expected(expected)
                .hint("give another folder with --out"))
        };
        if there.model_sha256 != own.model_sha256 {
            let problem = match there.model == own.model {
                true => "the model has changed since this fleet began",
                false => "the folder belongs to a fleet of another model",
            };
            return other(problem, quote(&there.model_name()), "the same model".into());
        }
        if there.records_sha256 != own.records_sha256 {
            return other(
                "the folder belongs to a fleet of other records",
                format!("{} records", there.records),
                format!(
                    "the same records in the same order, of which {} are given",
                    own.records
                ),
            );
        }
        if there.warm_start != own.warm_start {
            let word = |is: bool| {
                if is {
                    "with --warm-start"
                } else {
                    "without --warm-start"
                }
            };
            return other(
                "the fleet began with another option",
                word(there.warm_start).into(),
                word(there.warm_start).into(),
            );
        }
        if there.version != own.version {
            return other(
                "the fleet began with another version of kmcfit",
                there.version.clone(),
                own.version.clone(),
            );
        }
        Ok(())
    }

    /// The records of the fleet.
    ///
    /// # Errors
    /// If their file cannot be read.
    pub fn records(&self) -> Result<RecordList, InputError> {
        let file = self.path.join(RECORDS);
        let mut list = RecordList::default();
        let mut is_first = true;
        let read = complete_lines(&file, |_, line| {
            if std::mem::take(&mut is_first) {
                list.columns = serde_json::from_str(line)?;
                return Ok(());
            }
            let line: RecordLine = serde_json::from_str(line)?;
            list.records.push(Record {
                name: line.record,
                path: line.path,
                overrides: Override::parse_all(&line.overrides).map_err(io::Error::other)?,
                system: line.system,
                columns: line.columns,
            });
            Ok(())
        });
        read.map_err(|error| {
            InputError::file(&file, "the list of records cannot be read").found(error)
        })?;
        match list.records.len() == self.identity.records {
            true => Ok(list),
            false => Err(InputError::file(&file, "the list of records is damaged")
                .found(format!("{} records", list.records.len()))
                .expected(format!("{}", self.identity.records))),
        }
    }
}

fn write_identity(path: &Path, identity: &FleetIdentity) -> Result<(), InputError> {
    write_file(path, IDENTITY, &json_line(identity))
}

fn write_file(path: &Path, name: &str, text: &str) -> Result<(), InputError> {
    let file = path.join(name);
    write_together(&[(&file, text)]).map_err(|error| {
        InputError::file(path, "the folder of the fleet cannot be written to")
            .found(error)
            .expected("a folder that can be written to")
    })
}

fn json_line(value: &impl Serialize) -> String {
    // Maps with string keys and lists are always written.
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

fn absolute(path: &Path) -> Result<PathBuf, InputError> {
    std::path::absolute(path)
        .map_err(|error| InputError::file(path, "the path of the record is invalid").found(error))
}
