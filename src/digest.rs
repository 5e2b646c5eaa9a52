//! SHA-256 digests of files, used to recognise files written by kmcfit and changed inputs.

use data_encoding::HEXLOWER;
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// The SHA-256 digest of some bytes: 64 hexadecimal digits, as `sha256sum` prints them.
pub fn digest(bytes: &[u8]) -> String {
    HEXLOWER.encode(&Sha256::digest(bytes))
}

/// The digest of a file's contents, read block by block.
///
/// # Errors
/// If the path is no file that can be read. The contents of a pipe can be read once only, so they have no digest.
pub fn digest_of_file(path: &Path) -> io::Result<String> {
    if !path.metadata()?.is_file() {
        return Err(io::Error::other("not a file"));
    }
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut block = vec![0; BLOCK];
    loop {
        match file.read(&mut block) {
            Ok(0) => return Ok(HEXLOWER.encode(&hasher.finalize())),
            Ok(count) => hasher.update(&block[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Length and time of the last change of a file.
type State = (u64, Option<SystemTime>);

/// Digests of files, each computed once while the length and the time of the last change of the file remain.
#[derive(Debug, Default)]
pub struct FileDigests(Mutex<BTreeMap<PathBuf, (State, String)>>);

impl FileDigests {
    /// As [`digest_of_file`].
    ///
    /// # Errors
    /// As there.
    pub fn of(&self, path: &Path) -> io::Result<String> {
        let state = |found: &Metadata| (found.len(), found.modified().ok());
        let now = state(&path.metadata()?);
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, digest)) = known.get(path).filter(|(before, _)| *before == now) {
            return Ok(digest.clone());
        }
        let digest = digest_of_file(path)?;
        known.insert(path.to_path_buf(), (now, digest.clone()));
        Ok(digest)
    }
}

/// Models are equal whatever digests are known.
impl PartialEq for FileDigests {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_file_has_another_digest() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.csv");
        let digests = FileDigests::default();
        assert!(digests.of(&path).is_err());
        for text in ["abc", "abcd", "abc"] {
            std::fs::write(&path, text).expect("a file");
            for _ in 0..2 {
                assert_eq!(
                    digests.of(&path).expect("a digest"),
                    digest(text.as_bytes())
                );
            }
        }
        std::fs::remove_file(&path).expect("a file");
        assert!(digests.of(&path).is_err());
    }
}
