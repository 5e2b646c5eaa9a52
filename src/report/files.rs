//! An output folder whose files appear whole or not at all.

use crate::error::{InputError, Place};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A folder that can be written to.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Makes the folder if need be and proves that a file can be made in it, so that a long run does
    /// not end with nowhere to put its results.
    ///
    /// # Errors
    /// If the folder cannot be made or written to.
    pub fn prepare(path: &Path) -> Result<Self, InputError> {
        let refuse = |problem: &str, error: &io::Error| {
            InputError::new(Place::Argument("--out".into()), problem)
                .found(format!("{}: {error}", path.display()))
                .expected("a folder that can be written to")
        };
        make_folder(path).map_err(|e| refuse("the output folder cannot be made", &e))?;
        tempfile::NamedTempFile::new_in(path)
            .map_err(|e| refuse("the output folder cannot be written to", &e.kind().into()))?;
        Ok(Self {
            path: path.to_path_buf(),
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes away what an older run left that the new one may not write again: its result, without
    /// which the folder holds no run, its figures and its tables of readings.
    ///
    /// # Errors
    /// What the file system says.
    pub fn begin(&self) -> io::Result<()> {
        let gone = |result: io::Result<()>| match result {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
        gone(std::fs::remove_file(self.path.join("result.json")))?;
        for (name, kind) in [("figures", "svg"), ("readings", "csv")] {
            let Ok(files) = std::fs::read_dir(self.path.join(name)) else {
                continue;
            };
            for file in files.flatten().map(|entry| entry.path()) {
                if file.extension().is_some_and(|e| e == kind) {
                    gone(std::fs::remove_file(file))?;
                }
            }
        }
        Ok(())
    }

    /// Writes one file, replacing an older one at once: other readers see the old file or the new
    /// one, never a part.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, name: &str, contents: &str) -> io::Result<()> {
        write_whole(&self.path.join(name), contents)
    }
}

/// Writes `contents` to `path` by a temporary file in the same folder, made durable and renamed.
///
/// # Errors
/// What the file system says.
pub fn write_whole(path: &Path, contents: &str) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    make_folder(folder)?;
    let mut file = whole_file(folder)?;
    file.write_all(contents.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Makes a folder and those above it; where a file is in the way, the error says which.
fn make_folder(folder: &Path) -> io::Result<()> {
    match folder.ancestors().find(|above| above.is_file()) {
        Some(file) => Err(io::Error::other(format!(
            "{} is a file, not a folder",
            file.display()
        ))),
        None => std::fs::create_dir_all(folder),
    }
}

/// A temporary file that, once renamed, has the permissions of an ordinary new file.
fn whole_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}
