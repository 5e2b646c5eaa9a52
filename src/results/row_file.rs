//! Append-only files of lines, one process each.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;

/// A file of lines, each of which is complete: a line that a killed process left unfinished is removed, as is one that cannot be written
/// in full. Locked against other processes until drop.
#[derive(Debug)]
pub struct RowFile {
    file: File,
    /// Bytes of the complete lines.
    length: u64,
}

impl RowFile {
    /// Opens or creates a file and hands its complete lines to `each`.
    ///
    /// # Errors
    /// Errors of the file system and of `each`; [`io::ErrorKind::WouldBlock`] where another process has the file open.
    pub fn open(path: &Path, mut each: impl FnMut(&str) -> io::Result<()>) -> io::Result<Self> {
        if path.is_symlink() {
            return Err(io::Error::other(
                "a symbolic link, which may lead elsewhere",
            ));
        }
        let file = OpenOptions::new().append(true).create(true).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
            // A file system without locks.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let length = complete_lines(path, |_, line| each(line))?;
        if file.metadata()?.len() > length {
            file.set_len(length)?;
        }
        Ok(Self { file, length })
    }

    /// Appends a line, which ends with a newline.
    ///
    /// # Errors
    /// Errors of the file system; the file then ends with the line before.
    pub fn append(&mut self, line: &[u8]) -> io::Result<()> {
        if let Err(error) = (&self.file).write_all(line) {
            // Otherwise the next process removes it.
            let _ = self.file.set_len(self.length);
            return Err(error);
        }
        self.length += line.len() as u64;
        Ok(())
    }

    /// Makes the lines durable.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }
}

impl Drop for RowFile {
    fn drop(&mut self) {
        // A forked process holds the file open, and with it the lock.
        let _ = self.file.unlock();
    }
}

/// Hands the complete lines of a file, each with the position of its first byte, to `each`; returns the bytes of all. The last one is
/// incomplete without a newline.
///
/// # Errors
/// Errors of the file system and of `each`.
pub fn complete_lines(
    path: &Path,
    mut each: impl FnMut(u64, &str) -> io::Result<()>,
) -> io::Result<u64> {
    let mut reader = BufReader::new(File::open(path)?);
    let mut position = 0;
    let mut line = Vec::new();
    loop {
        line.clear();
        let count = reader.read_until(b'\n', &mut line)? as u64;
        if !line.ends_with(b"\n") {
            return Ok(position);
        }
        let text = std::str::from_utf8(&line).map_err(io::Error::other)?;
        each(position, text)?;
        position += count;
    }
}
