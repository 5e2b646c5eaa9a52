//! Output folders: checked and locked before the work of a command begins, written atomically at its end.

use super::analysis_journal;
use super::claim::Claim;
use super::exchange::{self, Stage};
use super::heading::Heading;
use super::journal;
use super::lock::Lock;
use super::manifest::{FileState, MANIFEST, Manifest};
use super::system;
use super::work_folder::{self, WorkFolder};
use crate::error::InputError;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// A folder for the results of one command, locked against other runs until drop.
///
/// The folder may hold files of the user, which are not changed, and the results of an older run of the same command,
/// which the new results replace ([`Stage::commit`]).
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    claim: Claim,
    /// True if this run created it.
    is_new: bool,
    _lock: Option<Lock>,
}

impl Drop for OutputFolder {
    /// Removes a folder that this run created and left empty.
    fn drop(&mut self) {
        if self.is_new {
            // The system refuses to remove a folder with contents.
            let _ = system::remove_folder(&self.path);
        }
    }
}

impl OutputFolder {
    /// Creates the folder if necessary, locks it, completes an interrupted exchange, and checks that the files of
    /// `claim` can be written.
    ///
    /// # Errors
    /// If the folder cannot be created or written to, another run uses it, it holds the results of another command, or
    /// a file that the claim covers is an input, was not written by kmcfit or was changed since. The error names
    /// the file, and nothing in the folder has changed.
    pub fn prepare(path: &Path, claim: Claim) -> Result<Self, InputError> {
        let refuse = |problem: &str, folder: &Path, error: &io::Error| {
            InputError::argument("--out", problem)
                .found(format!("{}: {error}", folder.display()))
                .expected("a folder that can be written to")
        };
        let is_new = !path.exists();
        system::create_folders(path).map_err(|e| {
            let error = refuse("the output folder cannot be created", existing(path), &e);
            match e.kind() {
                // The text names the file in the way.
                io::ErrorKind::Other => error.found(e),
                // Error of virtual file systems such as /proc.
                io::ErrorKind::NotFound => {
                    error.found(format!("{} takes no new folders", existing(path).display()))
                }
                _ => error,
            }
        })?;
        let lock = Lock::take(path).map_err(|_| taken(path))?;
        exchange::complete_locked(path)?;
        work_folder::remove_leftovers(path);
        let manifest = Manifest::read(path)?;
        let folder = Self {
            path: path.to_path_buf(),
            claim,
            is_new,
            _lock: lock,
        };
        folder.check_command(manifest.as_ref())?;
        folder.check_inputs(manifest.as_ref())?;
        folder.check_places(manifest.as_ref())?;
        folder.check_journals()?;
        for folder in folder.folders(manifest.as_ref()) {
            work_folder::remove_leftovers(&folder);
            WorkFolder::create_in(&folder)
                .map_err(|e| refuse("a folder for results cannot be written to", &folder, &e))?;
        }
        Ok(folder)
    }

    /// [`OutputFolder::prepare`] for a folder inside this one. A symbolic link is refused, because it could lead out of
    /// the folder.
    ///
    /// # Errors
    /// As for [`OutputFolder::prepare`].
    pub fn prepare_inside(&self, name: &str, claim: Claim) -> Result<Self, InputError> {
        let path = self.path.join(name);
        match path.is_symlink() {
            true => Err(a_link(&path)),
            false => Self::prepare(&path, claim),
        }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Existing folders that results are written into.
    fn folders(&self, manifest: Option<&Manifest>) -> BTreeSet<PathBuf> {
        let old = manifest
            .into_iter()
            .flat_map(|manifest| manifest.files.keys());
        let names = self.claim.fixed().chain(old.map(String::as_str));
        let parents = names.filter_map(|name| Path::new(name).parent());
        let families = self
            .claim
            .families
            .iter()
            .map(|family| Path::new(family.folder));
        let folders = parents.chain(families).map(|name| self.path.join(name));
        let folders = folders.chain([self.path.clone()]);
        folders.filter(|folder| folder.is_dir()).collect()
    }

    /// True if starting the work of `heading` discards unfinished work of the same command on the same inputs.
    ///
    /// # Errors
    /// If the unfinished work has other inputs; it is kept.
    pub fn discards(&self, heading: &Heading) -> Result<bool, InputError> {
        let mut is_discarded = false;
        for name in journal::NAMES {
            let path = self.path.join(name);
            let Some(before) = journal::heading_of(&path) else {
                continue;
            };
            // The journals of studies and comparisons are kept beside their results.
            if analysis_journal::is_finished(&path) {
                continue;
            }
            if !heading.has_inputs_of(&before) {
                return Err(self.unfinished(&path, &before));
            }
            is_discarded = true;
        }
        Ok(is_discarded)
    }

    fn unfinished(&self, journal: &Path, before: &Heading) -> InputError {
        InputError::file(journal, "this folder holds unfinished work")
            .found(format!("the journal of `kmcfit {}`", before.text_of_command()))
            .expected("a folder without it")
            .hint(format!(
                "finish it with `kmcfit resume {}`, give another folder with --out, or remove the journal to discard \
                 the work",
                self.path.display()
            ))
    }

    /// Begins to write results.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn stage(&self) -> io::Result<Stage<'_>> {
        Stage::begin(&self.path, &self.claim)
    }

    /// Refuses a folder with the results of another command.
    fn check_command(&self, manifest: Option<&Manifest>) -> Result<(), InputError> {
        match manifest {
            Some(manifest) if manifest.command != self.claim.command => Err(InputError::argument(
                "--out",
                "this folder holds the results of another command",
            )
            .found(format!(
                "{}: results of `kmcfit {}`",
                self.path.display(),
                manifest.command
            ))
            .expected(format!(
                "a new folder, or one with results of `kmcfit {}`",
                self.claim.command
            ))),
            _ => Ok(()),
        }
    }

    /// True if the command may write or remove a file of this relative path.
    fn is_claimed(&self, name: &str, manifest: Option<&Manifest>) -> bool {
        self.claim.covers(name)
            || name == MANIFEST
            || self.claim.journals.contains(&name)
            || manifest.is_some_and(|manifest| manifest.files.contains_key(name))
    }

    /// Refuses to replace an input.
    fn check_inputs(&self, manifest: Option<&Manifest>) -> Result<(), InputError> {
        let Ok(folder) = self.path.canonicalize() else {
            return Ok(());
        };
        for input in &self.claim.inputs {
            let Ok(path) = input.canonicalize() else {
                continue;
            };
            let Ok(inside) = path.strip_prefix(&folder) else {
                continue;
            };
            let parts = inside.components().map(|c| c.as_os_str().to_string_lossy());
            let name = parts.collect::<Vec<_>>().join("/");
            if self.is_claimed(&name, manifest) {
                return Err(
                    InputError::file(input, "this input would be replaced by a result")
                        .found(format!("--out {}", self.path.display()))
                        .expected("another output folder, or another place for the input"),
                );
            }
        }
        Ok(())
    }

    /// Refuses to replace a file that kmcfit did not write.
    fn check_places(&self, manifest: Option<&Manifest>) -> Result<(), InputError> {
        if let Some(manifest) = manifest {
            for (name, record) in &manifest.files {
                let path = self.path.join(name);
                self.check_parent(name)?;
                if let FileState::Other(problem) = record.state(&path) {
                    let problem = format!("{problem}, and would be replaced");
                    return Err(InputError::file(&path, problem)
                        .expected("the file as it was written, or none")
                        .hint("move it away, or give another folder with --out"));
                }
            }
        }
        let is_own =
            |name: &str| manifest.is_some_and(|manifest| manifest.files.contains_key(name));
        for name in self.claim.fixed().filter(|name| !is_own(name)) {
            self.check_parent(name)?;
            self.check_missing(name)?;
        }
        for family in &self.claim.families {
            self.check_parent(&format!("{}/", family.folder))?;
            let entries = std::fs::read_dir(self.path.join(family.folder));
            for entry in entries.into_iter().flatten().flatten() {
                let file_name = entry.file_name();
                let name = format!("{}/{}", family.folder, file_name.to_string_lossy());
                if family.covers(&file_name.to_string_lossy()) && !is_own(&name) {
                    return Err(unknown(&self.path.join(name)));
                }
            }
        }
        Ok(())
    }

    /// Refuses a relative path whose parents are not folders.
    fn check_parent(&self, name: &str) -> Result<(), InputError> {
        for (end, _) in name.match_indices('/') {
            let folder = self.path.join(&name[..end]);
            if folder.is_symlink() {
                return Err(a_link(&folder));
            }
            if folder.exists() && !folder.is_dir() {
                return Err(
                    InputError::file(&folder, "this is a file; results need a folder")
                        .expected("a folder, or nothing")
                        .hint("move it away, or give another folder with --out"),
                );
            }
        }
        Ok(())
    }

    fn check_missing(&self, name: &str) -> Result<(), InputError> {
        let path = self.path.join(name);
        match path.symlink_metadata() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            _ => Err(unknown(&path)),
        }
    }

    /// Refuses to replace a file that is not a journal of the same command.
    fn check_journals(&self) -> Result<(), InputError> {
        for name in journal::NAMES {
            let path = self.path.join(name);
            match journal::heading_of(&path) {
                Some(before) if before.command != self.claim.command => {
                    return Err(self.unfinished(&path, &before));
                }
                None if self.claim.journals.contains(&name) => self.check_missing(name)?,
                _ => {}
            }
        }
        Ok(())
    }
}

/// The folder itself, or the nearest one above it that exists.
fn existing(folder: &Path) -> &Path {
    let mut above = folder.ancestors();
    let above = above.find(|above| above.exists()).unwrap_or(folder);
    match above.as_os_str().is_empty() {
        true => Path::new("."),
        false => above,
    }
}

fn taken(path: &Path) -> InputError {
    InputError::argument("--out", "another run is writing to this folder")
        .found(path.display())
        .expected("a folder of its own for each run")
        .hint("wait for the other run, or give another folder with --out")
}

fn a_link(path: &Path) -> InputError {
    InputError::file(
        path,
        "this is a symbolic link: results would be written elsewhere",
    )
    .expected("a folder, or nothing")
    .hint("remove the link, or give another folder with --out")
}

fn unknown(path: &Path) -> InputError {
    InputError::file(
        path,
        "this file was not written by kmcfit, and would be replaced",
    )
    .expected("an output folder without it")
    .hint("move it away, or give another folder with --out")
}
