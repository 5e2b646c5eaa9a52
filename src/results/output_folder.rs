//! Folders of results. The files of a run are written into a folder beside its place, which takes the place in one step: a reader, and
//! whoever kills the process, finds the whole old run or the whole new one.
//!
//! The document of a run, such as `result.json`, lists its files with their digests. A folder that holds other or edited files is refused
//! before the work begins, so nothing of the user's is replaced.

use super::exchange::{PREFIX, complete, exchange, location, locked, remove_leftovers, unwritable};
use crate::digest::{digest, digest_of_file};
use crate::error::InputError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;

/// Name of the result document of a fit.
pub const RESULT: &str = "result.json";

/// The document of each command: a folder with one of them belongs to that command.
const DOCUMENTS: [(&str, &str); 6] = [
    ("fit", RESULT),
    ("study", "study.json"),
    ("compare", "compare.json"),
    ("predict", "predictions.json"),
    ("demo", "demo.json"),
    ("fleet", "fleet.json"),
];
/// Digests of the files of a run, by their paths relative to its folder, with `/` as separator.
type Digests = BTreeMap<String, String>;

/// The part of a document that lists the files.
#[derive(Deserialize)]
struct Listing {
    files: Digests,
}

/// A document with the files of its run.
#[derive(Serialize)]
struct Listed<'a, T> {
    #[serde(flatten)]
    document: &'a T,
    files: &'a Digests,
}

/// The folder of a run that is being made.
#[derive(Debug)]
pub struct OutputFolder {
    shown: PathBuf,
    path: PathBuf,
    command: &'static str,
    inputs: Vec<PathBuf>,
    /// Folder beside the place, in which the files are written.
    staging: TempDir,
    files: Mutex<Digests>,
    /// Held while the process lives: a later run removes folders that no process holds.
    _lock: Option<File>,
}

impl OutputFolder {
    /// Checks that `command` may write its results to `path`, without a change there; `inputs` are files that it reads.
    ///
    /// # Errors
    /// If nothing can be written beside the folder, or it holds files that are not those of an earlier run of the same command, changed
    /// ones among them. The error names the file.
    pub fn prepare(
        path: &Path,
        command: &'static str,
        inputs: impl IntoIterator<Item = PathBuf>,
    ) -> Result<Self, InputError> {
        let shown = path.to_path_buf();
        let path = location(path)?;
        // `location` accepts paths with a parent.
        let parent = path.parent().unwrap_or(&path);
        remove_leftovers(parent);
        complete(&path);
        let inputs: Vec<PathBuf> = inputs.into_iter().collect();
        if let Some(around) = path.ancestors().skip(1).find(|at| listing(at).is_some()) {
            return Err(InputError::argument(
                "--out",
                "this folder is inside results of kmcfit, which are replaced as a whole",
            )
            .found(around.display())
            .expected("a folder beside them"));
        }
        check(&path, &shown, command, &inputs, true)?;
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let staging = builder.prefix(PREFIX).tempdir_in(parent);
        let staging = staging.map_err(|error| unwritable(parent, &error))?;
        Ok(Self {
            shown,
            command,
            inputs,
            // Shared, so that runs inside it can be read.
            _lock: locked(staging.path(), File::lock_shared),
            staging,
            path,
            files: Mutex::default(),
        })
    }

    /// Its path, as given.
    pub fn shown(&self) -> &Path {
        &self.shown
    }

    /// The path from the folder, or from one `inside` it, to a `target` that exists, so that the two can be moved together.
    pub fn path_to(&self, inside: Option<&str>, target: Option<&Path>) -> PathBuf {
        let target = match target {
            Some(target) if !target.as_os_str().is_empty() => target,
            _ => Path::new("."),
        };
        let from = inside.map_or_else(|| self.path.clone(), |inside| self.path.join(inside));
        target
            .canonicalize()
            .map_or_else(|_| target.to_path_buf(), |target| relative(&from, &target))
    }

    /// Names of the files written so far.
    pub fn files(&self) -> Vec<String> {
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        files.keys().cloned().collect()
    }

    /// Where a folder inside this one is written, until the run takes its place.
    pub fn staged(&self, inside: &str) -> PathBuf {
        self.staging.path().join(inside)
    }

    /// Writes a file of the run.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> io::Result<()> {
        let path = self.staging.path().join(name);
        fs::create_dir_all(path.parent().unwrap_or(&path))?;
        fs::write(path, contents.as_ref())?;
        let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        files.insert(name.to_owned(), digest(contents.as_ref()));
        Ok(())
    }

    /// Writes the document of a run in a folder `inside` this one, which lists the files written there so far.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write_document(
        &self,
        inside: &str,
        name: &str,
        document: &impl Serialize,
    ) -> io::Result<()> {
        let prefix = format!("{inside}/");
        let all = self
            .files
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        let own = all.into_iter();
        let own =
            own.filter_map(|(file, digest)| Some((file.strip_prefix(&prefix)?.to_owned(), digest)));
        self.write(
            &format!("{prefix}{name}"),
            listed(document, &own.collect())?,
        )
    }

    /// Writes the document of the run and puts the folder into its place, in exchange for the run before.
    ///
    /// # Errors
    /// Errors of the file system, and files of the user that came into the folder in the meantime; the run before is then unchanged.
    pub fn commit(&self, document: &impl Serialize) -> io::Result<()> {
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let text = listed(document, &files)?;
        fs::write(self.staging.path().join(document_of(self.command)), text)?;
        let parent = self.path.parent().unwrap_or(&self.path);
        let _lock = locked(parent, File::lock);
        check(&self.path, &self.shown, self.command, &self.inputs, false)
            .map_err(io::Error::other)?;
        exchange(self.staging.path(), &self.path)
    }
}

/// The path from one absolute path to another.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let [from, to] = [from, to].map(|path| path.components().collect::<Vec<_>>());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n(Component::ParentDir, from.len() - common);
    up.chain(to[common..].iter().copied()).collect()
}

fn listed(document: &impl Serialize, files: &Digests) -> io::Result<String> {
    let mut text = serde_json::to_string_pretty(&Listed { document, files })?;
    text.push('\n');
    Ok(text)
}

/// Name of the document of a command.
fn document_of(command: &str) -> &'static str {
    let found = DOCUMENTS.iter().find(|(name, _)| *name == command);
    found.map_or(RESULT, |(_, document)| document)
}

/// The command whose document a folder holds.
pub fn owner(folder: &Path) -> Option<&'static str> {
    let found = DOCUMENTS
        .iter()
        .find(|(_, document)| folder.join(document).is_file());
    found.map(|(command, _)| *command)
}

/// The files that the document of a folder lists.
fn listing(folder: &Path) -> Option<Digests> {
    let text = fs::read(folder.join(document_of(owner(folder)?))).ok()?;
    let listing: Listing = serde_json::from_slice(&text).ok()?;
    Some(listing.files)
}

/// Refuses a folder that holds anything but the files of an earlier run of the command, with `is_thorough` unchanged ones.
fn check(
    path: &Path,
    shown: &Path,
    command: &str,
    inputs: &[PathBuf],
    is_thorough: bool,
) -> Result<(), InputError> {
    if !path.is_dir() {
        return Ok(());
    }
    let files = files_in(path).map_err(|error| unwritable(shown, &error))?;
    let other = |name: &str, problem: &str| {
        InputError::file(shown.join(name), problem)
            .expected("an output folder without it")
            .hint("move it away, or give another folder with --out")
    };
    let mut inputs = inputs.iter().filter_map(|input| input.canonicalize().ok());
    if let Some(input) = inputs.find(|input| input.starts_with(path)) {
        return Err(
            InputError::file(input, "this input would be replaced by the results")
                .found(format!("--out {}", shown.display()))
                .expected("another output folder, or another place for the input"),
        );
    }
    let own = document_of(command);
    if let Some(owner) = owner(path).filter(|owner| *owner != command) {
        return Err(InputError::argument(
            "--out",
            "this folder holds the results of another command",
        )
        .found(format!("{}: results of `kmcfit {owner}`", shown.display()))
        .expected(format!(
            "a new folder, or one with results of `kmcfit {command}`"
        )));
    }
    if path.join("kmcfit-manifest.json").is_file() {
        return Err(other("", "a run of an earlier version of kmcfit"));
    }
    let listing = listing(path);
    let is_run = listing.is_some();
    let known = listing.unwrap_or_default();
    for name in files {
        let is_document = name == own && is_run;
        match known.get(&name) {
            _ if is_document => {}
            None => {
                return Err(other(
                    &name,
                    "this file is not one of an earlier run, and would be removed",
                ));
            }
            Some(before) => {
                let is_changed =
                    is_thorough && digest_of_file(&path.join(&name)).ok().as_ref() != Some(before);
                if is_changed {
                    return Err(other(
                        &name,
                        "this file was changed since kmcfit wrote it, and would be replaced",
                    ));
                }
            }
        }
    }
    Ok(())
}

/// The files of a folder and of the folders in it, links as what they are.
fn files_in(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![String::new()];
    while let Some(inside) = open.pop() {
        for entry in fs::read_dir(folder.join(&inside))? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let name = if inside.is_empty() {
                name
            } else {
                format!("{inside}/{name}")
            };
            match entry.file_type()?.is_dir() {
                true => open.push(name),
                false => found.push(name),
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn run(path: &Path, command: &'static str, files: &[(&str, &str)]) -> Result<(), String> {
        let folder = OutputFolder::prepare(path, command, []).map_err(|e| e.to_string())?;
        for (name, text) in files {
            folder.write(name, text).expect("written");
        }
        folder
            .commit(&json!({"format": 1}))
            .map_err(|e| e.to_string())
    }

    #[test]
    fn a_run_replaces_the_one_before_and_leaves_nothing_beside() {
        let location = tempfile::tempdir().expect("a folder");
        let path = location.path().join("runs/a");
        run(&path, "fit", &[("a.csv", "1"), ("figures/b.svg", "2")]).expect("new");
        run(&path, "fit", &[("a.csv", "3")]).expect("again");
        assert_eq!(files_in(&path).expect("files"), ["a.csv", RESULT]);
        assert_eq!(fs::read_to_string(path.join("a.csv")).expect("text"), "3");
        assert_eq!(
            fs::read_dir(location.path().join("runs"))
                .expect("a folder")
                .count(),
            1
        );
    }

    #[test]
    fn files_of_others_and_changed_ones_are_kept() {
        let location = tempfile::tempdir().expect("a folder");
        let path = location.path().join("a");
        run(&path, "fit", &[("a.csv", "1")]).expect("new");
        assert!(
            run(&path, "study", &[])
                .expect_err("refused")
                .contains("another command")
        );
        for (name, text, problem) in [
            ("notes.txt", "mine", "not one of"),
            ("a.csv", "2", "changed"),
        ] {
            fs::write(path.join(name), text).expect("written");
            assert!(
                run(&path, "fit", &[])
                    .expect_err("refused")
                    .contains(problem)
            );
            assert_eq!(fs::read_to_string(path.join(name)).expect("text"), text);
            fs::remove_file(path.join(name)).expect("removed");
        }
        // A file that comes while the command works.
        let folder = OutputFolder::prepare(&path, "fit", []).expect("a folder");
        fs::write(path.join("late.txt"), "mine").expect("written");
        assert!(folder.commit(&json!({})).is_err());
        assert_eq!(
            fs::read_to_string(path.join("late.txt")).expect("text"),
            "mine"
        );
    }

    #[test]
    fn the_folder_of_a_killed_run_is_removed_and_that_of_a_living_one_stays() {
        let location = tempfile::tempdir().expect("a folder");
        let living =
            OutputFolder::prepare(&location.path().join("a"), "fit", []).expect("a folder");
        fs::create_dir(location.path().join(".kmcfit-dead")).expect("a folder");
        fs::create_dir(location.path().join("kmcfit-notes")).expect("a folder");
        run(&location.path().join("b"), "fit", &[]).expect("a run");
        assert!(living.staging.path().exists() && location.path().join("kmcfit-notes").exists());
        assert!(!location.path().join(".kmcfit-dead").exists());
    }

    #[test]
    fn paths_lead_from_one_folder_to_another() {
        let of = |from, to| {
            relative(Path::new(from), Path::new(to))
                .display()
                .to_string()
        };
        assert_eq!(of("/a/runs/b", "/a/models"), "../../models");
        assert_eq!(of("/a", "/a/b"), "b");
        assert_eq!(of("/a/b", "/a/b"), "");
    }
}
