//! The place of a folder of results, and its exchange for the one before.

use crate::error::InputError;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Beginning of the names of folders beside a run.
pub(super) const PREFIX: &str = ".kmcfit-";

/// A lock against the exchange of the run at `path`, until it is dropped; `None` where the system has no locks. An exchange that was killed
/// is completed.
pub fn read_lock(path: &Path) -> Option<File> {
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    complete(&path);
    locked(path.parent()?, File::lock_shared)
}

pub(super) fn locked(folder: &Path, lock: fn(&File) -> io::Result<()>) -> Option<File> {
    let file = File::open(folder).ok()?;
    lock(&file).ok().map(|()| file)
}

/// What a path in place of a folder is.
fn no_folder(path: &Path) -> String {
    let is = match path.is_file() {
        true => "is a file, not a folder",
        false => "leads to no folder",
    };
    format!("{} {is}", path.display())
}

/// The absolute path of a folder for results, whose parent exists then.
pub(super) fn location(path: &Path) -> Result<PathBuf, InputError> {
    let refused = |problem: &str| InputError::argument("--out", problem).found(path.display());
    if path.exists() {
        let found = path
            .canonicalize()
            .map_err(|error| unwritable(path, &error))?;
        let is_around_us = std::env::current_dir().is_ok_and(|here| here.starts_with(&found));
        return match () {
            () if !found.is_dir() => Err(refused("the output folder cannot be created")
                .found(no_folder(path))
                .expected("a folder, or a new path")),
            () if is_around_us => Err(refused("the results take the place of their folder as a whole, and the current folder is in this one")
                .expected("a folder inside it, such as `--out runs/first`")),
            () if is_mount_point(&found) => Err(refused("the results take the place of their folder as a whole, and this one is a mount point")
                .expected("a folder inside it")),
            () => Ok(found),
        };
    }
    let Some(name) = path.file_name() else {
        return Err(refused("the output folder has no name")
            .expected("a path that ends with the name of a folder"));
    };
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let is_no_folder = |above: &&Path| above.symlink_metadata().is_ok() && !above.is_dir();
    if let Some(other) = path.ancestors().find(is_no_folder) {
        return Err(refused("the output folder cannot be created")
            .found(no_folder(other))
            .expected("a folder that can be written to"));
    }
    let created = fs::create_dir_all(parent).and_then(|()| parent.canonicalize());
    let parent = created.map_err(|error| unwritable(parent, &error))?;
    Ok(parent.join(name))
}

#[cfg(unix)]
fn is_mount_point(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let device = |path: &Path| path.metadata().map(|found| found.dev()).ok();
    path.parent()
        .is_some_and(|parent| device(parent) != device(path))
}

#[cfg(not(unix))]
fn is_mount_point(_: &Path) -> bool {
    false
}

/// Puts the folder `new` into the location of `path`, if possible in one step; where the system has none, the run before is moved aside first.
pub(super) fn exchange(new: &Path, path: &Path) -> io::Result<()> {
    if !path.exists() {
        return fs::rename(new, path);
    }
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        if renameat_with(CWD, new, CWD, path, RenameFlags::EXCHANGE).is_ok() {
            return Ok(());
        }
    }
    let aside = aside(path);
    fs::rename(path, &aside)?;
    match fs::rename(new, path) {
        Ok(()) => fs::remove_dir_all(aside),
        Err(error) => fs::rename(aside, path).and(Err(error)),
    }
}

/// Place of the run before during an exchange of two steps.
fn aside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{PREFIX}before-{name}"))
}

/// Completes an exchange of two steps that was killed: the run before returns where there is no new one, else it is removed.
pub(super) fn complete(path: &Path) {
    let aside = aside(path);
    if aside.is_dir() {
        let _lock = path.parent().and_then(|parent| locked(parent, File::lock));
        let _ = match path.exists() {
            true => fs::remove_dir_all(aside),
            false => fs::rename(aside, path),
        };
    }
}

/// Removes the folders of runs that were killed: those of our names that no process holds.
pub(super) fn remove_leftovers(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_ours = name
            .strip_prefix(PREFIX)
            .is_some_and(|rest| !rest.contains('-'));
        if is_ours
            && let Ok(folder) = File::open(entry.path())
            && folder.metadata().is_ok_and(|found| found.is_dir())
            && folder.try_lock().is_ok()
        {
            // What cannot be removed now is found again by the next run.
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

pub(super) fn unwritable(path: &Path, error: &io::Error) -> InputError {
    InputError::argument("--out", "the output folder cannot be written to")
        .found(format!("{}: {error}", path.display()))
        .expected("a folder that can be written to")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_of_two_steps_is_completed() {
        let parent = tempfile::tempdir().expect("a folder");
        let path = parent.path().join("a");
        fs::create_dir(&path).expect("new");
        fs::write(path.join("a.csv"), "1").expect("written");
        fs::rename(&path, aside(&path)).expect("moved");
        drop(read_lock(&path));
        assert!(path.join("a.csv").exists() && !aside(&path).exists());
    }
}
