//! The operations on files that change something: the only place that calls the file system to write.
//!
//! Each passes [`faults::check`], so that the tests can make any of them fail.

#![allow(clippy::disallowed_methods)]

use crate::faults::{self, Operation};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Creates a file to append to that must not exist yet; a link in its place counts as existing.
pub fn create_new(path: &Path) -> io::Result<File> {
    faults::check(Operation::Create)?;
    let mut options = OpenOptions::new();
    options.append(true).create_new(true).open(path)
}

/// Opens an existing file to append to it.
pub fn open_to_append(path: &Path) -> io::Result<File> {
    faults::check(Operation::Create)?;
    OpenOptions::new().append(true).open(path)
}

/// Opens a file that serves as a lock, which is created if need be.
pub fn open_lock(path: &Path) -> io::Result<File> {
    faults::check(Operation::Create)?;
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).open(path)
}

/// Writes all bytes. An injected fault writes the first half of them, as a disk does that fills up.
pub fn write_all(mut file: &File, bytes: &[u8]) -> io::Result<()> {
    if let Err(fault) = faults::check(Operation::Write) {
        let _ = file.write_all(&bytes[..bytes.len() / 2]);
        return Err(fault);
    }
    file.write_all(bytes)
}

/// A file as a writer whose writes are those of [`write_all`].
pub struct Writer<'a>(pub &'a File);

impl Write for Writer<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        write_all(self.0, bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Makes the contents of a file durable.
pub fn sync(file: &File) -> io::Result<()> {
    faults::check(Operation::Sync)?;
    file.sync_data()
}

/// Makes the names in a folder durable, where the system has such an operation. A file system that cannot do so
/// still holds the names, so its refusal is no failure.
pub fn sync_folder(folder: &Path) {
    #[cfg(unix)]
    let _ = faults::check(Operation::Sync)
        .and_then(|()| File::open(folder))
        .and_then(|folder| folder.sync_all());
    #[cfg(not(unix))]
    let _ = folder;
}

/// Shortens a file.
pub fn truncate(file: &File, length: u64) -> io::Result<()> {
    faults::check(Operation::Remove)?;
    file.set_len(length)
}

/// Renames a file or folder; an existing file at `to` is replaced in one step.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    faults::check(Operation::Rename)?;
    fs::rename(from, to)
}

/// Gives a file a second name.
pub fn hard_link(from: &Path, to: &Path) -> io::Result<()> {
    faults::check(Operation::Rename)?;
    fs::hard_link(from, to)
}

/// Removes a file; one that does not exist is no error.
pub fn remove_file(path: &Path) -> io::Result<()> {
    faults::check(Operation::Remove)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Removes an empty folder.
pub fn remove_folder(path: &Path) -> io::Result<()> {
    faults::check(Operation::Remove)?;
    fs::remove_dir(path)
}

/// Removes a folder with all that is in it; links in it are removed, not followed.
pub fn remove_tree(path: &Path) -> io::Result<()> {
    faults::check(Operation::Remove)?;
    fs::remove_dir_all(path)
}

/// Creates one folder that must not exist yet.
pub fn create_folder(path: &Path) -> io::Result<()> {
    faults::check(Operation::Create)?;
    fs::create_dir(path)
}

/// Creates a folder and those above it; where a file stands in the place of one, the error names it.
pub fn create_folders(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    faults::check(Operation::Create)?;
    let is_no_folder = |above: &&Path| above.symlink_metadata().is_ok() && !above.is_dir();
    match folder.ancestors().find(is_no_folder) {
        Some(other) => Err(io::Error::other(format!(
            "{} is {}, not a folder",
            other.display(),
            match other {
                other if other.is_symlink() => "a link that leads to no folder",
                other if other.is_file() => "a file",
                _ => "a special file (device node, pipe or socket)",
            }
        ))),
        None => fs::create_dir_all(folder),
    }
}
