//! Manifest of an output folder: the files written by kmcfit, with their digests.
//!
//! A file may be replaced or removed only if the manifest names it and its contents still have the recorded digest. A
//! file that was edited since, or that the manifest does not name, belongs to the user.

use crate::digest::{digest, digest_of_file};
use crate::error::InputError;
use crate::text_io::read_text;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Component, Path};

/// Name of the manifest.
pub const MANIFEST: &str = "kmcfit-manifest.json";
/// Version of its format.
const FORMAT: u32 = 1;
/// Longest manifest, bytes: an entry takes some 150, and a run of 2000 records has 10,000 files.
const LONGEST: u64 = 1 << 24;

/// Files of a folder that one command of kmcfit wrote.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    format: u32,
    /// Version of kmcfit that wrote the files.
    pub version: String,
    /// The command that wrote them: `fit`, `study`, ...
    pub command: String,
    /// Records of the files by path relative to the folder, with `/` as separator.
    pub files: BTreeMap<String, FileRecord>,
    /// Digest of all the above.
    checksum: String,
}

/// Length and digest of a file when it was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Its length.
    pub bytes: u64,
    /// Its SHA-256 digest, in hexadecimal digits.
    pub sha256: String,
}

impl FileRecord {
    /// The record of a file with these contents.
    pub fn of(contents: &[u8]) -> Self {
        Self {
            bytes: contents.len() as u64,
            sha256: digest(contents),
        }
    }
}

/// A file of another length or digest.
const CHANGED: &str = "this file was changed since kmcfit wrote it";
/// A file whose length or contents cannot be read.
const UNREADABLE: &str = "this file cannot be read to check that kmcfit wrote it";

/// State of a file named by the manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileState {
    /// Nothing.
    Missing,
    /// The file with the recorded contents.
    Unchanged,
    /// Something else, as a message describes it.
    Other(&'static str),
}

impl FileRecord {
    /// Compares the file at `path` with this record.
    pub fn state(&self, path: &Path) -> FileState {
        match path.symlink_metadata() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => FileState::Missing,
            Err(_) => FileState::Other(UNREADABLE),
            Ok(metadata) if !metadata.is_file() => {
                FileState::Other("a file written by kmcfit was replaced by something else")
            }
            Ok(metadata) if metadata.len() != self.bytes => FileState::Other(CHANGED),
            Ok(_) => match digest_of_file(path) {
                Ok(found) if found == self.sha256 => FileState::Unchanged,
                Ok(_) => FileState::Other(CHANGED),
                Err(_) => FileState::Other(UNREADABLE),
            },
        }
    }
}

impl Manifest {
    /// The manifest of files that `command` wrote.
    pub fn new(command: &str, files: BTreeMap<String, FileRecord>) -> Self {
        let mut manifest = Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            command: command.into(),
            files,
            checksum: String::new(),
        };
        manifest.checksum = manifest.own_checksum();
        manifest
    }

    fn own_checksum(&self) -> String {
        let mut text = format!("{}\n{}\n{}\n", self.format, self.version, self.command);
        for (name, FileRecord { bytes, sha256 }) in &self.files {
            text += &format!("{sha256} {bytes} {name}\n");
        }
        digest(text.as_bytes())
    }

    /// The manifest in a folder; `None` where there is none.
    ///
    /// # Errors
    /// If the file is not a valid manifest; then no file of the folder is attributed to kmcfit.
    pub fn read(folder: &Path) -> Result<Option<Self>, InputError> {
        let path = folder.join(MANIFEST);
        let unknown = |problem: &str| {
            InputError::file(&path, problem)
                .expected("the manifest as kmcfit wrote it, or none")
                .hint("give another folder with --out, or move this file away")
        };
        match path.symlink_metadata() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Ok(metadata) if metadata.is_file() => {}
            Ok(_) => return Err(unknown("this is not a file")),
            Err(error) => return Err(unknown("the manifest cannot be read").found(error)),
        }
        let text = read_text(&path, "the manifest of an output folder", LONGEST)?;
        let manifest: Self = serde_json::from_str(&text).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            unknown("this is not a manifest of kmcfit")
                .found(format!("other text at line {line}, column {column}"))
        })?;
        if manifest.format != FORMAT {
            return Err(unknown("unsupported format version of the manifest")
                .found(manifest.format)
                .expected(FORMAT.to_string()));
        }
        let is_sound = manifest.checksum == manifest.own_checksum()
            && manifest.files.keys().all(|name| stays_inside(name));
        match is_sound {
            true => Ok(Some(manifest)),
            false => Err(unknown("the manifest was changed since kmcfit wrote it")),
        }
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        // A plain struct with text keys, which always serialises.
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        text + "\n"
    }
}

/// True for a relative path of plain names, which cannot lead out of its folder.
pub(super) fn stays_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest() -> Manifest {
        let files = [("a.csv", "1"), ("figures/b.svg", "<svg/>")];
        let files = files.map(|(name, text)| (name.into(), FileRecord::of(text.as_bytes())));
        Manifest::new("fit", files.into())
    }

    #[test]
    fn a_manifest_comes_back_from_its_file() {
        let place = tempfile::tempdir().expect("a folder");
        assert_eq!(Manifest::read(place.path()), Ok(None));
        std::fs::write(place.path().join(MANIFEST), manifest().text()).expect("room");
        assert_eq!(Manifest::read(place.path()), Ok(Some(manifest())));
    }

    #[test]
    fn an_edited_manifest_is_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let text = manifest().text();
        for (from, to) in [
            ("a.csv", "b.csv"),
            ("\"bytes\": 1", "\"bytes\": 2"),
            ("\"fit\"", "\"study\""),
            ("\"format\": 1", "\"format\": 2"),
            ("{", "["),
        ] {
            let edited = text.replacen(from, to, 1);
            assert_ne!(edited, text);
            std::fs::write(place.path().join(MANIFEST), edited).expect("room");
            assert!(Manifest::read(place.path()).is_err(), "{from}");
        }
        let outside = [("../a.csv".to_owned(), FileRecord::of(b"1"))];
        let outside = Manifest::new("fit", outside.into());
        std::fs::write(place.path().join(MANIFEST), outside.text()).expect("room");
        assert!(Manifest::read(place.path()).is_err());
    }

    #[test]
    fn states_of_files() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("a.csv");
        let record = FileRecord::of(b"1,2\n");
        assert_eq!(record.state(&path), FileState::Missing);
        std::fs::write(&path, "1,2\n").expect("room");
        assert_eq!(record.state(&path), FileState::Unchanged);
        std::fs::write(&path, "1,3\n").expect("room");
        assert_eq!(record.state(&path), FileState::Other(CHANGED));
        std::fs::remove_file(&path).expect("removed");
        std::fs::create_dir(&path).expect("a folder");
        let state = record.state(&path);
        assert!(matches!(state, FileState::Other(text) if text != CHANGED));
    }
}
