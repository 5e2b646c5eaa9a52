//! Atomic exchange of the files of an older run for new ones: at every instant one of the two runs is complete.
//!
//! 1. All new files are written into a working folder and made durable ([`Stage`]), with a plan of what replaces what.
//!    The older run is unchanged so far.
//! 2. The working folder is renamed to `.kmcfit-exchange`. From this instant the new run is the valid one.
//! 3. The files move into their places one by one, the replaced ones into the exchange folder. If a move fails, the
//!    moves before it are undone, which restores the older run.
//! 4. The exchange folder is removed.
//!
//! A process that is killed in step 3 leaves the exchange folder with its plan; the next command that opens the output
//! folder, to write or to read, completes the exchange ([`complete`]). Files are identified by digest: a file that
//! neither run wrote is never moved.

use super::atomic::folder_of;
use super::claim::{Claim, RESULT};
use super::lock::Lock;
use super::manifest::{FileRecord, FileState, MANIFEST, Manifest, stays_inside};
use super::system;
use super::work_folder::{EXCHANGE, WorkFolder, is_marked};
use crate::digest::digest;
use crate::error::InputError;
use crate::text_io::read_text;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Names in a working folder: new files, replaced files, and the plan.
const NEW: &str = "new";
const OLD: &str = "old";
const PLAN: &str = "plan.json";
/// Longest plan, bytes: as long as the longest manifest.
const LONGEST_PLAN: u64 = 1 << 24;
/// Number of files that are made durable at the same time: each needs a thread and a file descriptor. A disk makes many
/// files durable in little more time than one.
const AT_ONCE: usize = 16;

/// Results in a working folder, moved into the output folder together.
#[derive(Debug)]
pub struct Stage<'a> {
    folder: &'a Path,
    claim: &'a Claim,
    /// Ends before the working folder is removed.
    syncs: Syncs,
    work: WorkFolder,
    records: Mutex<BTreeMap<String, FileRecord>>,
}

impl<'a> Stage<'a> {
    pub(super) fn begin(folder: &'a Path, claim: &'a Claim) -> io::Result<Self> {
        Ok(Self {
            folder,
            claim,
            syncs: Syncs::default(),
            work: WorkFolder::create_in(folder)?,
            records: Mutex::default(),
        })
    }

    /// Adds a file, which appears with the others on commit. Several threads may add files at once.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> io::Result<()> {
        let contents = contents.as_ref();
        debug_assert!(self.claim.covers(name), "{name} was not claimed");
        self.add(name, contents)?;
        let record = FileRecord::of(contents);
        lock(&self.records).insert(name.to_owned(), record);
        Ok(())
    }

    fn add(&self, name: &str, contents: &[u8]) -> io::Result<()> {
        let path = self.work.path().join(NEW).join(name);
        system::create_folders(folder_of(&path))?;
        let file = system::create_new(&path)?;
        system::write_all(&file, contents)?;
        self.syncs.begin(file)
    }

    /// Moves the files into the output folder in the order of their names, the result document and the manifest last, and those of an older
    /// run of the same command aside.
    ///
    /// # Errors
    /// Errors of the file system, or a file in the way that kmcfit did not write. The older files are then in place, or
    /// the error names the folder of the new ones.
    pub fn commit(self) -> io::Result<()> {
        let refused = |error: InputError| io::Error::other(error.to_string());
        let before = Manifest::read(self.folder).map_err(refused)?;
        let records = std::mem::take(&mut *lock(&self.records));
        let manifest = Manifest::new(self.claim.command, records);
        self.add(MANIFEST, manifest.text().as_bytes())?;
        self.syncs.finish()?;
        let plan = self.plan(before.as_ref(), &manifest)?;
        let text = serde_json::to_string(&plan).map_err(io::Error::other)?;
        let file = system::create_new(&self.work.path().join(PLAN))?;
        system::write_all(&file, text.as_bytes())?;
        system::sync(&file)?;
        let new = self.work.path().join(NEW);
        plan.folders()
            .for_each(|name| system::sync_folder(&new.join(name)));
        system::sync_folder(self.work.path());
        let exchange = self.folder.join(EXCHANGE);
        self.work.rename_to(&exchange)?;
        system::sync_folder(self.folder);
        run(self.folder, &exchange, &plan)
    }

    /// The plan of the exchange, checked against the files in the folder.
    fn plan(&self, before: Option<&Manifest>, manifest: &Manifest) -> io::Result<Plan> {
        let own = (
            MANIFEST.to_owned(),
            FileRecord::of(manifest.text().as_bytes()),
        );
        let results = manifest.files.iter();
        let results = results.map(|(name, record)| (name.clone(), record.clone()));
        let mut put = Vec::new();
        for (name, record) in results.chain([own]) {
            let path = self.folder.join(&name);
            let known = before.and_then(|before| before.files.get(&name));
            let known = match name == MANIFEST {
                // The manifest was read and verified.
                true if before.is_some() => Some(FileRecord::of(&std::fs::read(&path)?)),
                _ => known.cloned(),
            };
            let state = known.as_ref().map(|record| record.state(&path));
            let is_free = match state {
                Some(state) => !matches!(state, FileState::Other(_)),
                None => path.symlink_metadata().is_err(),
            };
            if !is_free {
                return Err(in_the_way(&path));
            }
            put.push(Put {
                name,
                record,
                replaces: known.filter(|_| state == Some(FileState::Unchanged)),
            });
        }
        // The result document follows the files that it describes.
        put.sort_by_key(|put| (put.name == MANIFEST, put.name == RESULT));
        let old = before.map(|before| &before.files).into_iter().flatten();
        let remove = old.filter(|(name, _)| !manifest.files.contains_key(*name));
        let remove = remove.map(|(name, record)| (name.clone(), record.clone()));
        Ok(Plan::new(put, remove.collect()))
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Files that are made durable while further ones are prepared, in the order of addition.
#[derive(Debug, Default)]
struct Syncs(Mutex<VecDeque<JoinHandle<io::Result<()>>>>);

impl Syncs {
    fn begin(&self, file: File) -> io::Result<()> {
        let mut oldest = None;
        {
            let mut all = lock(&self.0);
            if all.len() >= AT_ONCE {
                oldest = all.pop_front();
            }
        }
        oldest.map_or(Ok(()), finish_one)?;
        let begun = system::begin_sync(file)?;
        lock(&self.0).extend(begun);
        Ok(())
    }

    fn finish(&self) -> io::Result<()> {
        let all = std::mem::take(&mut *lock(&self.0));
        let results: Vec<io::Result<()>> = all.into_iter().map(finish_one).collect();
        results.into_iter().collect()
    }
}

fn finish_one(thread: JoinHandle<io::Result<()>>) -> io::Result<()> {
    let panicked = |_| Err(io::Error::other("a file was not made durable"));
    thread.join().unwrap_or_else(panicked)
}

impl Drop for Syncs {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

fn in_the_way(path: &Path) -> io::Error {
    io::Error::other(format!(
        "{} was not written by kmcfit, or was changed since, and would be replaced",
        path.display()
    ))
}

/// Plan of an exchange.
#[derive(Debug, Serialize, Deserialize)]
struct Plan {
    put: Vec<Put>,
    remove: BTreeMap<String, FileRecord>,
    /// Digest of all the above.
    checksum: String,
}

/// A new file, and the file of the older run whose place it takes.
#[derive(Debug, Serialize, Deserialize)]
struct Put {
    name: String,
    record: FileRecord,
    replaces: Option<FileRecord>,
}

impl Put {
    /// True if the file at `place` is not the replaced one.
    fn is_done(&self, place: &Path) -> bool {
        let is_old = |old: &FileRecord| old.state(place) == FileState::Unchanged;
        let has_old = self.replaces.as_ref().is_some_and(is_old);
        let has_new = self.record.state(place) == FileState::Unchanged;
        has_new || (place.symlink_metadata().is_ok() && !has_old)
    }
}

impl Plan {
    fn new(put: Vec<Put>, remove: BTreeMap<String, FileRecord>) -> Self {
        let mut plan = Self {
            put,
            remove,
            checksum: String::new(),
        };
        plan.checksum = plan.own_checksum();
        plan
    }

    fn own_checksum(&self) -> String {
        digest(format!("{:?}\n{:?}", self.put, self.remove).as_bytes())
    }

    /// The folders that files move into or out of, relative to the output folder.
    fn folders(&self) -> impl Iterator<Item = &Path> {
        let names = self.put.iter().map(|put| put.name.as_str());
        let names = names.chain(self.remove.keys().map(String::as_str));
        let folders = names.filter_map(|name| Path::new(name).parent());
        folders.collect::<BTreeSet<_>>().into_iter()
    }

    /// The first new file that is neither in the exchange folder `new` nor in its place with its recorded contents.
    fn damaged(&self, folder: &Path, new: &Path) -> Option<&str> {
        let is_damaged = |put: &&Put| match put.record.state(&new.join(&put.name)) {
            FileState::Unchanged => false,
            FileState::Missing => !put.is_done(&folder.join(&put.name)),
            FileState::Other(_) => true,
        };
        self.put
            .iter()
            .find(is_damaged)
            .map(|put| put.name.as_str())
    }

    fn is_sound(&self) -> bool {
        let mut names = (self.put.iter().map(|put| &put.name)).chain(self.remove.keys());
        self.checksum == self.own_checksum() && names.all(|name| stays_inside(name))
    }
}

/// Moves the files of an exchange; after a failure the moves are undone.
fn run(folder: &Path, exchange: &Path, plan: &Plan) -> io::Result<()> {
    let moves = Moves {
        folder,
        new: exchange.join(NEW),
        old: exchange.join(OLD),
    };
    let mut done = Vec::new();
    let mut all = || {
        for put in &plan.put {
            done.extend(moves.put(put)?);
        }
        for (name, record) in &plan.remove {
            done.extend(moves.remove(name, record)?);
        }
        Ok(())
    };
    let result: io::Result<()> = all();
    let Err(error) = result else {
        plan.folders()
            .for_each(|name| system::sync_folder(&folder.join(name)));
        // The next run removes the exchange folder if this fails.
        let _ = WorkFolder::reclaim(exchange);
        return Ok(());
    };
    let undone = done
        .iter()
        .rev()
        .try_for_each(|one: &Move| moves.undo(one))
        .and_then(|()| WorkFolder::reclaim(exchange));
    Err(match undone {
        Ok(_) => error,
        Err(_) => io::Error::other(format!(
            "{error}; the new files are complete in {}, and the next kmcfit command on this folder \
             puts them into their places",
            exchange.display()
        )),
    })
}

/// A completed move.
struct Move {
    name: String,
    /// True if a new file was put in place.
    came: bool,
    /// True if an old file was moved aside.
    went: bool,
}

/// Folders between which files move.
struct Moves<'a> {
    folder: &'a Path,
    new: PathBuf,
    old: PathBuf,
}

impl Moves<'_> {
    /// Moves a new file into its place; `None` if that was done before.
    fn put(&self, put: &Put) -> io::Result<Option<Move>> {
        let (new, place) = (self.new.join(&put.name), self.folder.join(&put.name));
        if new.symlink_metadata().is_err() {
            return Ok(None);
        }
        self.create_parent(&place)?;
        let state = put.replaces.as_ref().map(|record| record.state(&place));
        let went = match state {
            Some(FileState::Unchanged) => true,
            Some(FileState::Missing) => false,
            None if place.symlink_metadata().is_err() => false,
            _ => return Err(in_the_way(&place)),
        };
        let old = self.old.join(&put.name);
        if went {
            self.set_aside(&place, &old)?;
        }
        if let Err(error) = system::rename(&new, &place) {
            if went && place.symlink_metadata().is_err() {
                system::rename(&old, &place)?;
            }
            return Err(error);
        }
        Ok(Some(Move {
            name: put.name.clone(),
            came: true,
            went,
        }))
    }

    /// Gives an old file a second name, so that the new file replaces it in one step; moves it away if the file system
    /// has no hard links.
    fn set_aside(&self, place: &Path, old: &Path) -> io::Result<()> {
        system::create_folders(folder_of(old))?;
        // Left by an interrupted exchange, with the same contents.
        system::remove_file(old)?;
        system::hard_link(place, old).or_else(|_| system::rename(place, old))
    }

    /// Removes a file of the older run, unless it was changed since.
    fn remove(&self, name: &str, record: &FileRecord) -> io::Result<Option<Move>> {
        let (place, old) = (self.folder.join(name), self.old.join(name));
        if record.state(&place) != FileState::Unchanged {
            return Ok(None);
        }
        system::create_folders(folder_of(&old))?;
        system::rename(&place, &old)?;
        Ok(Some(Move {
            name: name.to_owned(),
            came: false,
            went: true,
        }))
    }

    fn undo(&self, one: &Move) -> io::Result<()> {
        let place = self.folder.join(&one.name);
        if one.came {
            system::rename(&place, &self.new.join(&one.name))?;
        }
        if one.went {
            system::rename(&self.old.join(&one.name), &place)?;
        }
        Ok(())
    }

    /// Creates the folder of a file; a link in its place could lead out of the output folder.
    fn create_parent(&self, place: &Path) -> io::Result<()> {
        let parent = folder_of(place);
        match parent != self.folder && parent.is_symlink() {
            true => Err(io::Error::other(format!(
                "{} is a link, and results would be written elsewhere",
                parent.display()
            ))),
            false => system::create_folders(parent),
        }
    }
}

/// Completes an interrupted exchange in a folder that is read. A run that has locked the folder completes it itself.
///
/// # Errors
/// If it cannot be completed.
pub fn complete(folder: &Path) -> Result<(), InputError> {
    if !folder.join(EXCHANGE).is_dir() {
        return Ok(());
    }
    match Lock::take(folder) {
        Ok(_lock) => complete_locked(folder),
        Err(_) => Ok(()),
    }
}

/// [`complete`] in a folder that this run has locked.
pub(super) fn complete_locked(folder: &Path) -> Result<(), InputError> {
    let exchange = folder.join(EXCHANGE);
    if exchange.symlink_metadata().is_err() {
        return Ok(());
    }
    let unusable = |problem: &str| {
        InputError::file(&exchange, problem)
            .expected("leftovers of a killed run of kmcfit, or nothing")
            .hint("move it away")
    };
    if exchange.is_symlink() || !is_marked(&exchange) {
        return Err(unusable("this folder was not written by kmcfit"));
    }
    let text = read_text(
        &exchange.join(PLAN),
        "the plan of an exchange",
        LONGEST_PLAN,
    );
    let text =
        text.map_err(|error| unusable("the plan of this exchange cannot be read").found(error))?;
    let plan: Option<Plan> = serde_json::from_str(&text).ok();
    let plan = plan.filter(Plan::is_sound);
    let plan = plan.ok_or_else(|| unusable("the plan of this exchange is damaged"))?;
    if let Some(name) = plan.damaged(folder, &exchange.join(NEW)) {
        return Err(unusable("a file of this exchange is missing or damaged").found(name));
    }
    run(folder, &exchange, &plan).map_err(|error| {
        InputError::file(folder, "a run that was killed cannot be completed here")
            .found(error)
            .expected("a folder that can be written to")
    })
}
