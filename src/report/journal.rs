//! A journal of finished pieces: a study that is interrupted goes on where it was.

use crate::error::InputError;
use crate::input::read_text;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
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
    /// Of the model's text and of what its start costs: a changed model or changed data do not go on.
    pub fingerprint: String,
}

impl Heading {
    /// The heading for a model of this text whose start costs `cost`.
    pub fn new(model: &Path, text: &str, cost: f64) -> Self {
        // FNV-1a, which is the same on every machine.
        let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self {
            format: FORMAT,
            model: model.to_path_buf(),
            fingerprint: format!("{hash:016x}-{:016x}", cost.to_bits()),
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
        let mut file = File::create(folder.join(JOURNAL))?;
        write_line(&mut file, heading)?;
        Ok(Self {
            file,
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
        super::write_whole(&path, &kept).map_err(unwritable)?;
        let file = OpenOptions::new()
            .append(true)
            .open(&path)
            .map_err(unwritable)?;
        Ok(Self { file, done })
    }

    /// The result of a piece: as it was kept, or computed now and kept.
    ///
    /// # Errors
    /// What the file system says.
    pub fn piece<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        compute: impl FnOnce() -> T,
    ) -> io::Result<T> {
        if let Some(kept) = self.done.get(name)
            && let Ok(result) = serde_json::from_value(kept.clone())
        {
            return Ok(result);
        }
        let result = compute();
        let line = Line {
            piece: name.to_owned(),
            result: serde_json::to_value(&result).map_err(io::Error::other)?,
        };
        write_line(&mut self.file, &line)?;
        // What is told now is what would be read back; a piece with numbers that JSON does not have is
        // computed again by whoever goes on.
        Ok(serde_json::from_value(line.result).unwrap_or(result))
    }
}

fn write_line(file: &mut File, line: &impl Serialize) -> io::Result<()> {
    let mut text = serde_json::to_string(line).map_err(io::Error::other)?;
    text.push('\n');
    file.write_all(text.as_bytes())?;
    file.sync_data()
}
