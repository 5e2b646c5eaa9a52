//! SHA-256 digests of files, by which a run knows what it read and kmcfit the files that it wrote.

use crate::error::InputError;
use crate::text_io::{changing, read_bytes, state};
use data_encoding::HEXLOWER;
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// The SHA-256 digest of some bytes: 64 hexadecimal digits, as `sha256sum` prints them.
pub fn digest(bytes: &[u8]) -> String {
    HEXLOWER.encode(&Sha256::digest(bytes))
}

/// The digest of a file's contents.
///
/// # Errors
/// If the path is no file that can be read.
pub fn digest_of_file(path: &Path) -> io::Result<String> {
    if !path.metadata()?.is_file() {
        return Err(io::Error::other("not a file"));
    }
    let mut hasher = Sha256::new();
    let (mut file, mut block) = (File::open(path)?, vec![0; 1 << 16]);
    loop {
        match file.read(&mut block) {
            Ok(0) => break,
            Ok(count) => hasher.update(&block[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(HEXLOWER.encode(&hasher.finalize()))
}

/// A file as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadFile {
    /// Length, bytes.
    pub bytes: u64,
    /// Its digest.
    pub sha256: String,
    state: Option<(u64, Option<SystemTime>)>,
}

/// The files that were read, each with the digest of the bytes that were used.
#[derive(Debug, Default)]
pub struct ReadFiles(Mutex<BTreeMap<PathBuf, ReadFile>>);

impl ReadFiles {
    /// Reads a file of at most `limit` bytes; `what` it should be is named in errors.
    ///
    /// # Errors
    /// If it cannot be read or is longer, and if the file is not the one that was read before.
    pub fn read(&self, path: &Path, what: &str, limit: u64) -> Result<Vec<u8>, InputError> {
        let state = state(path);
        let bytes = read_bytes(path, what, limit)?;
        let found = ReadFile {
            bytes: bytes.len() as u64,
            sha256: digest(&bytes),
            state,
        };
        let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match files.insert(path.to_path_buf(), found.clone()) {
            Some(before) if before.sha256 != found.sha256 => Err(changing(path)),
            _ => Ok(bytes),
        }
    }

    /// A file, if it was read.
    pub fn of(&self, path: &Path) -> Option<ReadFile> {
        let files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.get(path).cloned()
    }

    /// Refuses files that have changed since they were read, as one that is still being copied.
    ///
    /// # Errors
    /// The first such file.
    pub fn check(&self) -> Result<(), InputError> {
        let files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_changed = |(path, file): &(&PathBuf, &ReadFile)| {
            file.state.is_some() && state(path) != file.state
        };
        match files.iter().find(is_changed) {
            Some((path, _)) => Err(changing(path)),
            None => Ok(()),
        }
    }
}

/// Models are equal whatever was read.
impl PartialEq for ReadFiles {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vector of FIPS 180-2 for `abc`.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn digests_of_bytes_and_files_agree() {
        assert_eq!(digest(b"abc"), ABC);
        let location = tempfile::tempdir().expect("a folder");
        let path = location.path().join("a.txt");
        std::fs::write(&path, "abc").expect("written");
        assert_eq!(digest_of_file(&path).expect("a digest"), ABC);
        assert!(digest_of_file(location.path()).is_err());
    }

    #[test]
    fn a_file_that_grows_is_refused() {
        let location = tempfile::tempdir().expect("a folder");
        let path = location.path().join("a.csv");
        std::fs::write(&path, "abc").expect("written");
        let files = ReadFiles::default();
        files.read(&path, "a table", 100).expect("read");
        assert_eq!(files.of(&path).expect("read").sha256, ABC);
        assert_eq!(files.check(), Ok(()));
        std::fs::write(&path, "abcd").expect("written");
        assert!(files.check().is_err() && files.read(&path, "a table", 100).is_err());
    }
}
