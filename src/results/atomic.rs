//! Atomic writing of files: written under a temporary name, made durable, renamed.

use super::system::{self, Writer};
use super::work_folder::fresh_name;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Size of the write buffer, bytes.
const BUFFER: usize = 1 << 16;

/// Writes `contents` to `path` atomically: a reader gets the complete old or the complete new file.
///
/// # Errors
/// Errors of the file system; the old file is then unchanged.
pub fn write_whole(path: &Path, contents: &str) -> io::Result<()> {
    write_together(&[(path, contents)])
}

/// Writes the output of `write` to `path` atomically.
///
/// # Errors
/// Errors of the file system or of `write`; the old file is then unchanged.
pub fn write_stream(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    replace_with(folder_of(path), path, write)
}

/// Writes files that belong together: none of them appears before all are durable.
///
/// # Errors
/// Errors of the file system. The older files are then restored or, if that fails as well, some are replaced by new
/// ones.
pub fn write_together(files: &[(&Path, &str)]) -> io::Result<()> {
    let files = files.iter().map(|(path, contents)| {
        system::create_folders(folder_of(path))?;
        let file = Temporary::create_in(folder_of(path))?;
        system::write_all(&file.file, contents.as_bytes())?;
        system::sync(&file.file)?;
        Ok((file, *path))
    });
    let files = files.collect::<io::Result<Vec<_>>>()?;
    let mut done: Vec<(&Path, Option<PathBuf>)> = Vec::new();
    let replace = || {
        for (file, path) in files {
            done.push((path, second_name(path)?));
            file.rename_to(path)?;
        }
        Ok(())
    };
    let result: io::Result<()> = replace();
    for (path, old) in done.iter().rev() {
        let _ = match (&result, old) {
            (Ok(()), Some(old)) => system::remove_file(old),
            (Err(_), Some(old)) => system::rename(old, path),
            // Removes a new file that had no predecessor.
            (Err(_), None) => system::remove_file(path),
            (Ok(()), None) => Ok(()),
        };
        system::sync_folder(folder_of(path));
    }
    result
}

/// Creates a second name for the file at `path`, which survives its replacement; `None` if there is no file.
fn second_name(path: &Path) -> io::Result<Option<PathBuf>> {
    if path.symlink_metadata().is_err() {
        return Ok(None);
    }
    let old = folder_of(path).join(fresh_name());
    system::hard_link(path, &old).or_else(|_| system::rename(path, &old))?;
    Ok(Some(old))
}

/// Creates the file `path` with `contents`, replacing an older one, and returns it open for appending. Its temporary
/// name is in `work_folder`.
///
/// # Errors
/// Errors of the file system; an older file is then unchanged.
pub(super) fn begin_file(work_folder: &Path, path: &Path, contents: &str) -> io::Result<File> {
    let file = Temporary::create_in(work_folder)?;
    system::write_all(&file.file, contents.as_bytes())?;
    file.rename_to(path)
}

/// Replaces the file `path` by the output of `write`. Its temporary name is in `work_folder`.
///
/// # Errors
/// Errors of the file system or of `write`; an older file is then unchanged.
pub(super) fn replace_with(
    work_folder: &Path,
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let file = Temporary::create_in(work_folder)?;
    let mut buffered = BufWriter::with_capacity(BUFFER, Writer(&file.file));
    write(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    system::sync(&file.file)?;
    file.rename_to(path)?;
    system::sync_folder(folder_of(path));
    Ok(())
}

/// A file under a temporary name, removed on drop.
struct Temporary {
    file: File,
    path: PathBuf,
}

impl Temporary {
    fn create_in(folder: &Path) -> io::Result<Self> {
        loop {
            let path = folder.join(fresh_name());
            match system::create_new(&path) {
                Ok(file) => return Ok(Self { file, path }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn rename_to(mut self, path: &Path) -> io::Result<File> {
        system::rename(&self.path, path)?;
        self.path = PathBuf::new();
        self.file.try_clone()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            let _ = system::remove_file(&self.path);
        }
    }
}

/// The folder of a file.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
