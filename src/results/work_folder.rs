//! Working folders, in which files are prepared before they appear in an output folder.
//!
//! A working folder is inside the output folder, on the same file system, so that finished files are moved by renaming.
//! Its name begins with `.kmcfit-` and it contains a marker file, by which a later run recognises and removes the
//! working folder of a killed run. A folder of such a name without the marker is not changed.

use super::system;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Beginning of the names of working folders and of temporary files.
const PREFIX: &str = ".kmcfit-";
/// Name of the working folder of a running or interrupted exchange.
pub(super) const EXCHANGE: &str = ".kmcfit-exchange";
/// Name of the marker in a working folder, and its content.
const MARKER: &str = "kmcfit-working-folder";
const MARKER_TEXT: &str =
    "Working folder of kmcfit, left by a run that was killed. The next run removes it.\n";

/// A name with the prefix, new in this process.
pub(super) fn fresh_name() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("{PREFIX}{}-{count}", std::process::id())
}

/// True for a name of the form of [`fresh_name`].
fn is_fresh_name(name: &str) -> bool {
    let numbers = name
        .strip_prefix(PREFIX)
        .and_then(|rest| rest.split_once('-'));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    numbers.is_some_and(|(process, count)| is_number(process) && is_number(count))
}

/// A folder that is removed with its contents on drop.
#[derive(Debug)]
pub(super) struct WorkFolder {
    path: PathBuf,
}

impl WorkFolder {
    /// Creates a working folder inside `parent`.
    ///
    /// # Errors
    /// If no folder can be created or written to there.
    pub fn create_in(parent: &Path) -> io::Result<Self> {
        let path = loop {
            let path = parent.join(fresh_name());
            match system::create_folder(&path) {
                Ok(()) => break path,
                // Left by an earlier process with the same process ID.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        };
        let folder = Self { path };
        let marker = system::create_new(&folder.path.join(MARKER))?;
        system::write_all(&marker, MARKER_TEXT.as_bytes())?;
        Ok(folder)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the folder its final name; it is then kept.
    ///
    /// # Errors
    /// If it cannot be renamed.
    pub fn rename_to(mut self, path: &Path) -> io::Result<()> {
        system::rename(&self.path, path)?;
        self.path = PathBuf::new();
        Ok(())
    }

    /// Renames a folder with a marker at `path` to a new working folder.
    ///
    /// # Errors
    /// If it cannot be renamed.
    pub fn reclaim(path: &Path) -> io::Result<Self> {
        let to = path.with_file_name(fresh_name());
        system::rename(path, &to)?;
        Ok(Self { path: to })
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            // The next run removes the folder if this fails.
            let _ = remove(&self.path);
        }
    }
}

/// Removes a working folder, its marker last, so that the next run recognises a partly removed folder.
fn remove(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        match entry.file_type()?.is_dir() {
            _ if entry.file_name() == MARKER => {}
            true => system::remove_tree(&entry.path())?,
            false => system::remove_file(&entry.path())?,
        }
    }
    system::remove_file(&folder.join(MARKER))?;
    system::remove_folder(folder)
}

/// Removes the working folders of killed runs in a folder. Failures are ignored.
pub(super) fn remove_leftovers(parent: &Path) {
    let entries = std::fs::read_dir(parent).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let name = name.to_string_lossy();
        if !is_folder || !is_fresh_name(&name) {
            continue;
        }
        let path = entry.path();
        let _ = match contents(&path) {
            FolderContents::Nothing => system::remove_folder(&path),
            FolderContents::Marked => remove(&path),
            FolderContents::Foreign => Ok(()),
        };
    }
}

enum FolderContents {
    /// The process was killed before it wrote the marker.
    Nothing,
    Marked,
    Foreign,
}

fn contents(folder: &Path) -> FolderContents {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return FolderContents::Foreign;
    };
    let count = entries.count();
    if count == 0 {
        return FolderContents::Nothing;
    }
    let marker = folder.join(MARKER);
    let text = match marker.is_symlink() {
        true => return FolderContents::Foreign,
        false => std::fs::read_to_string(&marker),
    };
    match text {
        Ok(text) if text == MARKER_TEXT => FolderContents::Marked,
        // The process was killed while it wrote the marker.
        Ok(text) if count == 1 && MARKER_TEXT.starts_with(&text) => FolderContents::Marked,
        _ => FolderContents::Foreign,
    }
}

/// True for a folder with the marker of a working folder.
pub(super) fn is_marked(folder: &Path) -> bool {
    matches!(contents(folder), FolderContents::Marked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn leftovers_are_removed_and_foreign_folders_stay() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = WorkFolder::create_in(place.path()).expect("a folder");
        fs::write(folder.path().join("half.csv"), "1,2").expect("a file");
        std::mem::forget(folder);
        fs::create_dir(place.path().join(".kmcfit-1-2")).expect("a folder");
        fs::create_dir(place.path().join(".kmcfit-empty")).expect("a folder");
        let foreign = place.path().join(".kmcfit-notes");
        fs::create_dir(&foreign).expect("a folder");
        fs::write(foreign.join("notes.txt"), "mine").expect("a file");
        fs::write(place.path().join(".kmcfit-file"), "mine").expect("a file");
        remove_leftovers(place.path());
        let mut names: Vec<_> = fs::read_dir(place.path())
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name())
            .collect();
        names.sort();
        assert_eq!(names, [".kmcfit-empty", ".kmcfit-file", ".kmcfit-notes"]);
        assert!(foreign.join("notes.txt").exists());
    }

    #[test]
    fn a_dropped_working_folder_leaves_nothing() {
        let place = tempfile::tempdir().expect("a folder");
        drop(WorkFolder::create_in(place.path()).expect("a folder"));
        assert_eq!(fs::read_dir(place.path()).expect("a folder").count(), 0);
    }
}
