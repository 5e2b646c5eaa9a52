//! A journal of finished pieces: a study that is interrupted goes on where it was.

use super::files::begun;
use super::fit_journal::hash;
use crate::error::InputError;
use crate::input::read_text;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Name of the file.
pub const JOURNAL: &str = "study.journal";
/// Longest journal that is read, bytes.
const LONGEST: u64 = 1 << 30;
const FORMAT: u32 = 1;

/// What the journal is about: its first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Version of the format.
    pub format: u32,
    /// The model file, as it was given.
    pub model: PathBuf,
    /// What was given beside it, in the place of its own values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Of the model's text and of what its start costs: a changed model or changed data do not go on.
    pub fingerprint: String,
}

impl Heading {
    /// The heading for a model of this text whose start costs `cost`.
    pub fn new(model: &Path, text: &str, cost: f64) -> Self {
        Self {
            format: FORMAT,
            model: model.to_path_buf(),
            overrides: Vec::new(),
            fingerprint: format!("{}-{:016x}", hash(text.as_bytes()), cost.to_bits()),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Line {
    piece: String,
    result: Value,
}

/// The finished pieces, on disk as soon as they are.
#[derive(Debug)]
pub struct Journal {
    file: File,
    done: BTreeMap<String, Value>,
}

impl Journal {
    /// A new journal in a folder, in the place of an older one.
    ///
    /// # Errors
    /// What the file system says.
    pub fn begin(folder: &Path, heading: &Heading) -> io::Result<Self> {
        Ok(Self {
            file: begun(&folder.join(JOURNAL), &line(heading)?)?,
            done: BTreeMap::new(),
        })
    }

    /// The heading of the journal in a folder.
    ///
    /// # Errors
    /// If there is none of this format.
    pub fn heading(folder: &Path) -> Result<Heading, InputError> {
        let path = folder.join(JOURNAL);
        let text = read_text(&path, "the journal of a study", LONGEST)?;
        let first = text.lines().next().unwrap_or_default();
        let heading: Heading = serde_json::from_str(first).map_err(|error| {
            InputError::file(&path, "this is no journal of a study")
                .found(error)
                .expected("the folder of a study that was begun by `kmcfit study`")
        })?;
        match heading.format {
            FORMAT => Ok(heading),
            other => Err(
                InputError::file(&path, "the journal has another format version")
                    .found(other)
                    .expected(FORMAT.to_string()),
            ),
        }
    }

    /// The journal in a folder, to be gone on with. A last line that was cut off does not count.
    ///
    /// # Errors
    /// If there is none, or it is of another model or other data.
    pub fn go_on(folder: &Path, heading: &Heading) -> Result<Self, InputError> {
        let path = folder.join(JOURNAL);
        let before = Self::heading(folder)?;
        if before.fingerprint != heading.fingerprint {
            return Err(InputError::file(
                &path,
                "the model or its data are not those that the study was begun with",
            )
            .expected("both unchanged, or a new study"));
        }
        let text = read_text(&path, "the journal of a study", LONGEST)?;
        let mut done = BTreeMap::new();
        let mut kept = String::new();
        for (i, line) in text.lines().enumerate() {
            if i > 0 {
                let Ok(Line { piece, result }) = serde_json::from_str(line) else {
                    break;
                };
                done.insert(piece, result);
            }
            kept += line;
            kept.push('\n');
        }
        let unwritable = |error: io::Error| {
            InputError::file(
                &path,
                format!("the journal cannot be gone on with: {error}"),
            )
        };
        let file = begun(&path, &kept).map_err(unwritable)?;
        Ok(Self { file, done })
    }

    /// Whether there is a piece of this name.
    pub fn has(&self, name: &str) -> bool {
        self.done.contains_key(name)
    }

    /// Forgets a piece that is not as it must be, so that it is computed again.
    pub fn forget_unless<T: DeserializeOwned>(
        &mut self,
        name: &str,
        is_right: impl Fn(&T) -> bool,
    ) {
        let kept = self.done.get(name).cloned();
        let read = kept.and_then(|kept| serde_json::from_value(kept).ok());
        if !read.as_ref().is_some_and(is_right) {
            self.done.remove(name);
        }
    }

    /// The result of a piece: as it was kept, or computed now and kept; nothing if it is not `whole`
    /// after it was computed.
    ///
    /// # Errors
    /// What the file system says.
    pub fn piece<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        compute: impl FnOnce() -> T,
        whole: impl FnOnce() -> bool,
    ) -> io::Result<Option<T>> {
        if let Some(kept) = self.done.get(name)
            && let Ok(result) = serde_json::from_value(kept.clone())
        {
            return Ok(Some(result));
        }
        let result = compute();
        if !whole() {
            return Ok(None);
        }
        let line = Line {
            piece: name.to_owned(),
            result: serde_json::to_value(&result).map_err(io::Error::other)?,
        };
        write_line(&mut self.file, &line)?;
        // What is told now is what would be read back; a piece with numbers that JSON does not have is
        // computed again by whoever goes on.
        Ok(Some(serde_json::from_value(line.result).unwrap_or(result)))
    }
}

fn write_line(file: &mut File, content: &impl Serialize) -> io::Result<()> {
    file.write_all(line(content)?.as_bytes())?;
    file.sync_data()
}

fn line(content: &impl Serialize) -> io::Result<String> {
    let text = serde_json::to_string(content).map_err(io::Error::other)?;
    Ok(text + "\n")
}
