//! Heading of a journal, its first line: the command and its inputs with digests.

use crate::config::ModelFile;
use crate::digest::{FileDigests, digest};
use crate::error::InputError;
use crate::text_io::LONGEST_TABLE;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Version of the format of journals.
const FORMAT: u32 = 2;

/// Identity of the work in a journal. Only the same version of kmcfit with the same inputs resumes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Version of the format.
    pub format: u32,
    /// Version of kmcfit; results of other versions can differ in the last bits.
    pub version: String,
    /// The command: `fit`, `study` or `compare`.
    pub command: String,
    /// Model files and folders of runs, as given on the command line.
    pub inputs: Vec<PathBuf>,
    /// Overrides (`--set`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Files that are written on request.
    #[serde(flatten)]
    pub requested: RequestedFiles,
    /// Least time between two checkpoints, s, if given.
    pub checkpoint: Option<f64>,
    /// The inputs and the files that they read.
    pub sources: Vec<SourceFile>,
}

/// Files of a fit that are written on request.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RequestedFiles {
    /// Figures and the page.
    pub figures: bool,
    /// One row per node in the tables over time.
    #[serde(default)]
    pub tables: bool,
    /// Number of draws in `draws.csv`; 0 for none.
    #[serde(default)]
    pub draws: usize,
}

impl RequestedFiles {
    /// Figures and the page only.
    pub fn figures() -> Self {
        Self {
            figures: true,
            ..Self::default()
        }
    }
}

/// A file on which the results depend.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceFile {
    /// The file.
    pub file: PathBuf,
    /// Its SHA-256 digest, or the reason for its absence.
    pub sha256: String,
}

impl Heading {
    /// The heading for a command with these inputs.
    pub fn new(command: &str, inputs: Vec<PathBuf>) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            command: command.into(),
            inputs,
            overrides: Vec::new(),
            requested: RequestedFiles::figures(),
            checkpoint: None,
            sources: Vec::new(),
        }
    }

    /// The heading for a command on one model; `checkpoint` is the least time between two checkpoints, s.
    pub fn of_model(
        command: &str,
        file: &ModelFile,
        requested: RequestedFiles,
        checkpoint: Option<f64>,
    ) -> Self {
        let mut heading = Self::new(command, vec![file.path.clone()]).with_model(file);
        heading.overrides = file.override_texts();
        heading.requested = requested;
        heading.checkpoint = checkpoint;
        heading
    }

    /// Adds a model and the files that it reads to the sources.
    #[must_use]
    pub fn with_model(mut self, file: &ModelFile) -> Self {
        self.sources.push(SourceFile {
            file: file.path.clone(),
            sha256: digest(file.text.as_bytes()),
        });
        for path in file.data_files() {
            self = self.with_digest(path, file.digests());
        }
        self
    }

    /// Adds a file to the sources.
    #[must_use]
    pub fn with_file(self, file: PathBuf) -> Self {
        self.with_digest(file, &FileDigests::default())
    }

    fn with_digest(mut self, file: PathBuf, digests: &FileDigests) -> Self {
        // The command refuses a longer file; its digest would take half a minute for ten gigabytes.
        let size = file.metadata().ok().map(|found| found.len());
        let sha256 = size
            .filter(|size| *size <= LONGEST_TABLE)
            .and_then(|_| digests.of(&file).ok())
            .unwrap_or_else(|| "not readable".into());
        self.sources.push(SourceFile { file, sha256 });
        self
    }

    /// Refuses a heading of another format.
    pub(super) fn check_format(value: &Value, journal: &Path) -> Result<(), InputError> {
        match value.get("format").and_then(Value::as_u64) {
            Some(format) if format != u64::from(FORMAT) => Err(InputError::file(
                journal,
                "unsupported format version of the journal",
            )
            .found(format)
            .expected(FORMAT.to_string())),
            _ => Ok(()),
        }
    }

    /// Refuses to resume work that was started with other inputs, settings or another version.
    ///
    /// # Errors
    /// If version, values or files differ.
    pub(super) fn check_same(&self, before: &Self, journal: &Path) -> Result<(), InputError> {
        let command = &before.command;
        let differs = |what: &str, found: String, expected: String| {
            InputError::file(journal, format!("this {command} was started {what}"))
                .found(found)
                .expected(format!("{expected}, or a new {command}"))
        };
        if before.version != self.version {
            return Err(differs(
                "by another version of kmcfit",
                format!("version {}", before.version),
                format!("version {}", self.version),
            ));
        }
        if before.command != self.command || before.inputs != self.inputs {
            return Err(differs(
                "with other arguments",
                before.text_of_command(),
                self.text_of_command(),
            ));
        }
        if before.overrides != self.overrides {
            return Err(differs(
                "with other values beside the model",
                before.overrides.join(", "),
                "the same values".into(),
            ));
        }
        let changed = |source: &&SourceFile| !before.sources.contains(source);
        let changed = self.sources.iter().find(changed);
        let missing = |source: &&SourceFile| !self.sources.contains(source);
        match changed.or_else(|| before.sources.iter().find(missing)) {
            Some(source) => Err(InputError::file(
                &source.file,
                format!("this file has changed since the {command} was started"),
            )
            .expected(format!("the same model and data, or a new {command}"))),
            None => Ok(()),
        }
    }

    /// True if another heading names the same inputs, in the same order.
    pub(super) fn has_inputs_of(&self, other: &Self) -> bool {
        let place = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
        self.inputs
            .iter()
            .map(place)
            .eq(other.inputs.iter().map(place))
    }

    pub(super) fn text_of_command(&self) -> String {
        let inputs = self.inputs.iter().map(|input| input.display().to_string());
        let words = std::iter::once(self.command.clone()).chain(inputs);
        words.collect::<Vec<_>>().join(" ")
    }
}
