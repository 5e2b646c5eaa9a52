//! An output folder whose files appear whole or not at all.

use super::lock::Lock;
use crate::error::{InputError, Place};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::{NamedTempFile, TempDir};

/// Names of files and folders on their way begin so.
const ON_ITS_WAY: &str = ".kmcfit-";
/// Folders in an output folder.
const FOLDERS: [&str; 2] = ["figures", "readings"];
/// The file without which a folder holds no run.
const RESULT: &str = "result.json";
/// The tables and the page of a run.
const TABLES: [&str; 4] = [
    "history.csv",
    "functions.csv",
    "trajectory.csv",
    "report.html",
];

/// A folder that can be written to, and by nobody else as long as this lives.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    _lock: Option<Lock>,
}

impl OutputFolder {
    /// Makes the folder if need be, locks it, and proves that a file can be made in it, so that a long
    /// run does not end with nowhere to put its results. What a killed run left on its way is removed.
    ///
    /// # Errors
    /// If the folder cannot be made or written to, or another run writes to it.
    pub fn prepare(path: &Path) -> Result<Self, InputError> {
        let refuse = |problem: &str, error: &io::Error| {
            InputError::new(Place::Argument("--out".into()), problem)
                .found(format!("{}: {error}", path.display()))
                .expected("a folder that can be written to")
        };
        make_folder(path).map_err(|e| refuse("the output folder cannot be made", &e))?;
        let lock = Lock::take(path).map_err(|_| taken(path))?;
        on_its_way()
            .tempfile_in(path)
            .map_err(|e| refuse("the output folder cannot be written to", &e.kind().into()))?;
        let folder = Self {
            path: path.to_path_buf(),
            _lock: lock,
        };
        folder.tidy();
        Ok(folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes what was on its way when an earlier run was killed. What cannot be removed does no harm.
    fn tidy(&self) {
        let folders = FOLDERS.map(|name| self.path.join(name));
        for folder in std::iter::once(&self.path).chain(&folders) {
            for path in entries(folder) {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                if name.starts_with(ON_ITS_WAY) {
                    let _ = match path.is_dir() {
                        true => std::fs::remove_dir_all(&path),
                        false => std::fs::remove_file(&path),
                    };
                }
            }
        }
    }

    /// Takes away what an older run left: its result first, without which the folder holds no run, then
    /// its tables and figures.
    fn retire(&self) -> io::Result<()> {
        for name in std::iter::once(RESULT).chain(TABLES) {
            gone(std::fs::remove_file(self.path.join(name)))?;
        }
        for (name, kind) in FOLDERS.into_iter().zip(["svg", "csv"]) {
            for file in entries(&self.path.join(name)) {
                if file.extension().is_some_and(|e| e == kind) {
                    gone(std::fs::remove_file(file))?;
                }
            }
        }
        Ok(())
    }

    /// Makes names that came and went durable. A file system that cannot do so keeps what it keeps.
    fn settle(&self) {
        for folder in FOLDERS.map(|name| self.path.join(name)) {
            settle(&folder);
        }
        settle(&self.path);
    }

    /// Writes one file, replacing an older one at once: other readers see the old file or the new
    /// one, never a part.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, name: &str, contents: &str) -> io::Result<()> {
        let path = self.path.join(name);
        make_own_folder(&self.path, &path)?;
        write_whole(&path, contents)
    }

    /// Several files, which are made durable together.
    pub fn batch(&self) -> Batch<'_> {
        Batch {
            folder: &self.path,
            files: Vec::new(),
            names: None,
        }
    }

    /// Files that are seen together: none of them before all are written and durable.
    ///
    /// # Errors
    /// What the file system says.
    pub fn stage(&self) -> io::Result<Stage<'_>> {
        Ok(Stage {
            folder: self,
            place: on_its_way().tempdir_in(&self.path)?,
            names: Vec::new(),
        })
    }
}

fn taken(path: &Path) -> InputError {
    InputError::new(
        Place::Argument("--out".into()),
        "another run is writing to this folder",
    )
    .found(path.display())
    .expected("a folder of its own for each run")
    .hint("wait for the other run, or give another folder with --out")
}

/// What is in a folder; nothing where it is no folder or is a link, which may lead anywhere.
fn entries(folder: &Path) -> Vec<PathBuf> {
    if folder.is_symlink() {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    entries.flatten().map(|entry| entry.path()).collect()
}

/// Makes the names in a folder durable, where there is such a thing.
fn settle(folder: &Path) {
    #[cfg(unix)]
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    #[cfg(not(unix))]
    let _ = folder;
}

fn gone(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// The results of a run on their way: written to a folder beside the old ones, which stay whole until
/// the new ones are, and then put in their places by renaming. A full disk costs the new ones only.
#[derive(Debug)]
pub struct Stage<'a> {
    folder: &'a OutputFolder,
    place: TempDir,
    names: Vec<String>,
}

impl Stage<'_> {
    /// Adds files, durable when the batch is finished, but not yet seen.
    pub fn batch(&mut self) -> Batch<'_> {
        Batch {
            folder: self.place.path(),
            files: Vec::new(),
            names: Some(&mut self.names),
        }
    }

    /// Puts the files in their places, in the order in which they were added.
    ///
    /// # Errors
    /// What the file system says.
    pub fn commit(self) -> io::Result<()> {
        for name in &self.names {
            let path = self.folder.path.join(name);
            make_own_folder(&self.folder.path, &path)?;
            // What a result speaks of is there before it is, even if the power fails between.
            if name == RESULT {
                self.folder.settle();
            }
            std::fs::rename(self.place.path().join(name), path)?;
        }
        self.folder.settle();
        Ok(())
    }

    /// The same for a run with `result`, which comes last, so that a folder that has one is complete:
    /// an older run goes before the first new file comes, its result before all.
    ///
    /// # Errors
    /// What the file system says.
    pub fn commit_run(mut self, result: &str) -> io::Result<()> {
        let mut batch = self.batch();
        batch.write(RESULT, result)?;
        batch.finish()?;
        self.folder.retire()?;
        self.folder.settle();
        self.commit()
    }
}

/// Makes the folder of `path` inside `folder`; a link in its place could lead out of it.
fn make_own_folder(folder: &Path, path: &Path) -> io::Result<()> {
    let Some(parent) = path.parent().filter(|parent| *parent != folder) else {
        return Ok(());
    };
    if parent.is_symlink() {
        return Err(io::Error::other(format!(
            "{} is a link, and what is written there would be elsewhere",
            parent.display()
        )));
    }
    make_folder(parent)
}

/// So many files are made durable at once: each takes a thread and is open until then.
const AT_ONCE: usize = 16;

/// Files on their way into a folder. A disk makes many durable in little more time than one, if it is
/// asked for all at once: a run's tables then take a few milliseconds and not some each.
#[derive(Debug)]
pub struct Batch<'a> {
    folder: &'a Path,
    files: Vec<(NamedTempFile, PathBuf)>,
    /// Where the names of the files are noted.
    names: Option<&'a mut Vec<String>>,
}

impl Batch<'_> {
    /// Adds a file, which is seen when the batch is finished, or before.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&mut self, name: &str, contents: &str) -> io::Result<()> {
        let path = self.folder.join(name);
        make_own_folder(self.folder, &path)?;
        self.files.push((written(&path, contents)?, path));
        if let Some(names) = &mut self.names {
            names.push(name.to_owned());
        }
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
    write_whole_with(path, |file| file.write_all(contents.as_bytes()))
}

/// The same for what `write` writes, piece by piece.
///
/// # Errors
/// What the file system says, or `write`.
pub fn write_whole_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> io::Result<()> {
    let file = beside(path)?;
    let mut buffered = BufWriter::with_capacity(1 << 16, file.as_file());
    write(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    settle(folder_of(path));
    Ok(())
}

/// Writes files that belong together: none of them appears before all are durable.
///
/// # Errors
/// What the file system says.
pub fn write_together(files: &[(&Path, &str)]) -> io::Result<()> {
    let files = files.iter().map(|(path, contents)| {
        let file = written(path, contents)?;
        file.as_file().sync_all()?;
        Ok((file, path))
    });
    for (file, path) in files.collect::<io::Result<Vec<_>>>()? {
        file.persist(path).map_err(|e| e.error)?;
        settle(folder_of(path));
    }
    Ok(())
}

/// A new file at `path`, in the place of what was there: it begins with `contents` and can be appended
/// to.
///
/// # Errors
/// What the file system says.
pub(super) fn begun(path: &Path, contents: &str) -> io::Result<File> {
    written(path, contents)?.persist(path).map_err(|e| e.error)
}

/// A temporary file with `contents` in the folder of `path`.
fn written(path: &Path, contents: &str) -> io::Result<NamedTempFile> {
    let mut file = beside(path)?;
    file.write_all(contents.as_bytes())?;
    Ok(file)
}

/// A temporary file in the folder of `path`, which is made if need be.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = folder_of(path);
    make_folder(folder)?;
    whole_file(folder)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
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

/// Maker of files and folders on their way.
fn on_its_way() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(ON_ITS_WAY);
    builder
}

/// A temporary file that, once renamed, has the permissions of an ordinary new file.
fn whole_file(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = on_its_way();
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
