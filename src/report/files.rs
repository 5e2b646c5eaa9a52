//! An output folder whose files appear whole or not at all.

use crate::error::{InputError, Place};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

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
        NamedTempFile::new_in(path)
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
    /// which the folder holds no run, its page, its figures and its tables of readings.
    ///
    /// # Errors
    /// What the file system says.
    pub fn begin(&self) -> io::Result<()> {
        let gone = |result: io::Result<()>| match result {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
        for name in ["result.json", "report.html"] {
            gone(std::fs::remove_file(self.path.join(name)))?;
        }
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

    /// Several files, which are made durable together.
    pub fn batch(&self) -> Batch<'_> {
        Batch {
            folder: self,
            files: Vec::new(),
        }
    }
}

/// So many files are made durable at once: each takes a thread and is open until then.
const AT_ONCE: usize = 16;

/// Files on their way into a folder. A disk makes many durable in little more time than one, if it is
/// asked for all at once: a run's tables then take a few milliseconds and not some each.
#[derive(Debug)]
pub struct Batch<'a> {
    folder: &'a OutputFolder,
    files: Vec<(NamedTempFile, PathBuf)>,
}

impl Batch<'_> {
    /// Adds a file, which is seen when the batch is finished, or before.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&mut self, name: &str, contents: &str) -> io::Result<()> {
        let path = self.folder.path.join(name);
        self.files.push((written(&path, contents)?, path));
        match self.files.len() < AT_ONCE {
            true => Ok(()),
            false => self.settle(),
        }
    }

    /// Puts all files in their places, each whole.
    ///
    /// # Errors
    /// What the file system says.
    pub fn finish(mut self) -> io::Result<()> {
        self.settle()
    }

    fn settle(&mut self) -> io::Result<()> {
        std::thread::scope(|scope| {
            let syncs = self.files.iter().map(|(file, _)| {
                let sync = || file.as_file().sync_all();
                let thread = std::thread::Builder::new().spawn_scoped(scope, sync);
                // Without a thread to spare it only takes longer.
                thread.map_err(|_| sync())
            });
            let syncs: Vec<_> = syncs.collect();
            syncs.into_iter().try_for_each(|sync| match sync {
                Ok(thread) => (thread.join())
                    .unwrap_or_else(|_| Err(io::Error::other("a file was not made durable"))),
                Err(done) => done,
            })
        })?;
        for (file, path) in self.files.drain(..) {
            file.persist(path).map_err(|e| e.error)?;
        }
        Ok(())
    }
}

/// Writes `contents` to `path` by a temporary file in the same folder, made durable and renamed.
///
/// # Errors
/// What the file system says.
pub fn write_whole(path: &Path, contents: &str) -> io::Result<()> {
    let file = written(path, contents)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// A temporary file with `contents` in the folder of `path`, which is made if need be.
fn written(path: &Path, contents: &str) -> io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    make_folder(folder)?;
    let mut file = whole_file(folder)?;
    file.write_all(contents.as_bytes())?;
    Ok(file)
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
fn whole_file(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names and contents of the files in a folder that are not on their way.
    fn files(folder: &Path) -> Vec<(String, String)> {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let mut files: Vec<(String, String)> = entries
            .map(|entry| entry.expect("an entry").path())
            .filter_map(|path| {
                let name = path.file_name()?.to_str()?.to_owned();
                let contents = std::fs::read_to_string(path).ok()?;
                (!name.starts_with('.')).then_some((name, contents))
            })
            .collect();
        files.sort();
        files
    }

    #[test]
    fn a_batch_puts_every_file_in_its_place() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = OutputFolder::prepare(place.path()).expect("a folder to write to");
        let expected: Vec<(String, String)> = (10..10 + 2 * AT_ONCE + 1)
            .map(|i| (format!("{i}.txt"), format!("number {i}")))
            .collect();
        let mut batch = folder.batch();
        batch.write("10.txt", "an older one").expect("room");
        assert_eq!(files(place.path()), []);
        batch.finish().expect("room");
        let mut batch = folder.batch();
        for (name, contents) in &expected {
            batch.write(name, contents).expect("room");
        }
        // What is not finished is not seen, and an older file is whole until then.
        assert_eq!(files(place.path()), expected[..2 * AT_ONCE]);
        batch.finish().expect("room");
        assert_eq!(files(place.path()), expected);
    }

    #[test]
    fn a_batch_that_is_dropped_leaves_nothing() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = OutputFolder::prepare(place.path()).expect("a folder to write to");
        let mut batch = folder.batch();
        batch.write("a.txt", "text").expect("room");
        drop(batch);
        assert_eq!(
            std::fs::read_dir(place.path()).expect("a folder").count(),
            0
        );
    }
}
