//! All operations that change the file system.
//!
//! Each calls [`faults::check`], so that tests can make any of them fail.

#![allow(clippy::disallowed_methods)]

use crate::faults::{self, Operation};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

/// Creates a file for appending; fails if the file or a link of this name exists.
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

/// Opens a lock file; creates it if necessary.
pub fn open_lock(path: &Path) -> io::Result<File> {
    faults::check(Operation::Create)?;
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).open(path)
}

/// Writes all bytes. An injected fault writes the first half, like a full disk.
pub fn write_all(mut file: &File, bytes: &[u8]) -> io::Result<()> {
    if let Err(fault) = faults::check(Operation::Write) {
        let _ = file.write_all(&bytes[..bytes.len() / 2]);
        return Err(fault);
    }
    file.write_all(bytes)
}

/// A file as a writer that calls [`write_all`].
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

/// Begins to make the contents of a file durable on a thread of its own; without a free thread it is done here.
pub fn begin_sync(file: File) -> io::Result<Option<JoinHandle<io::Result<()>>>> {
    let file = Arc::new(file);
    let other = Arc::clone(&file);
    let thread =
        faults::check(Operation::Spawn).and_then(|()| Builder::new().spawn(move || sync(&other)));
    match thread {
        Ok(thread) => Ok(Some(thread)),
        Err(_) => sync(&file).map(|()| None),
    }
}

/// Makes the names in a folder durable, if the system supports it. Refusals are ignored, because the names exist
/// regardless.
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

/// Removes a file; a missing file is not an error.
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

/// Removes a folder with its contents; links are removed, not followed.
pub fn remove_tree(path: &Path) -> io::Result<()> {
    faults::check(Operation::Remove)?;
    fs::remove_dir_all(path)
}

/// Creates one folder; fails if it exists.
pub fn create_folder(path: &Path) -> io::Result<()> {
    faults::check(Operation::Create)?;
    fs::create_dir(path)
}

/// Creates a folder and its parents; the error names a file in the way.
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
