//! The journal of a fit: one line per iteration and per finished search, and a checkpoint beside it.
//!
//! Entries of iterations are buffered for some milliseconds, so a killed fit loses at most the last of them. The
//! checkpoint holds the state of the current solver run; it is replaced atomically at intervals of at least one second.
//! Both are removed when the results are written. [`CheckpointStore`] defines what they hold and how a fit is resumed
//! from it. Times are taken from a monotonic clock.

mod read;

use super::atomic::replace_with;
use super::heading::Heading;
use super::journal::{
    CHECKPOINT, FIT_JOURNAL, JournalFile, JournalPosition, push_line, write_line,
};
use super::system;
use super::work_folder::WorkFolder;
use crate::error::InputError;
use kmcfit_core::internals::solvers::{
    CheckpointStore, CheckpointUnit, ExactF64s, IterationRecord, SolverState,
};
use read::{JournalContents, JournalReader};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Least time between two checkpoints: about the largest loss of a killed fit.
const EVERY: Duration = Duration::from_secs(1);
/// Checkpoints take at most `1/SHARE` of the time of a fit.
const SHARE: u32 = 50;
/// Estimated time of the first checkpoint for each parameter: L-BFGS stores dozens of numbers of each.
const A_PARAMETER: Duration = Duration::from_micros(4);

/// Longest time for which entries of iterations are buffered; unbuffered writing would take 10 % of the time of quick
/// iterations.
const GATHER: Duration = Duration::from_millis(5);

/// Line of the journal: number of the unit, and entry.
#[derive(Serialize, Deserialize)]
struct JournalLine<E>(u64, E);

/// Entry of a line.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Entry {
    /// An iteration of a solver run.
    Row(IterationRecord),
    /// Final state of a solver run.
    End(Box<SolverState>),
    /// Computed numbers.
    Numbers(ExactF64s),
    /// End without a result.
    Nothing,
}

/// The open journal of a running fit.
#[derive(Debug)]
pub struct FitJournal {
    folder: PathBuf,
    heading: Heading,
    file: JournalFile,
    work: WorkFolder,
    /// Buffered lines, their end, and the time of the last write.
    waiting: Vec<u8>,
    waiting_end: JournalPosition,
    written: Instant,
    /// Contents of the journal of an earlier run of the same fit.
    before: JournalContents,
    /// Number of the current unit, from 1.
    unit: u64,
    /// True if the earlier run completed it.
    is_recalled: bool,
    pace: Pace,
    trouble: Option<io::Error>,
}

/// Schedule of the checkpoints.
#[derive(Debug)]
struct Pace {
    every: Duration,
    /// True for an interval given by the user.
    is_given: bool,
    last: Instant,
    took: Duration,
}

impl Pace {
    fn new(given: Option<f64>) -> Self {
        let given = given.and_then(|s| Duration::try_from_secs_f64(s).ok());
        Self {
            every: given.unwrap_or(EVERY),
            is_given: given.is_some(),
            last: Instant::now(),
            took: Duration::ZERO,
        }
    }

    fn is_due(&self, parameters: usize) -> bool {
        let took = match u32::try_from(parameters) {
            Ok(parameters) if self.took.is_zero() => A_PARAMETER * parameters,
            _ => self.took,
        };
        let rest = match self.is_given {
            true => self.every,
            false => self.every.max(SHARE * took),
        };
        self.last.elapsed() >= rest
    }
}

impl FitJournal {
    /// Creates a journal in a folder; replaces an older one.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn begin(folder: &Path, heading: &Heading) -> io::Result<Self> {
        Self::clear(folder)?;
        let work = WorkFolder::create_in(folder)?;
        let file = JournalFile::begin(&work, &folder.join(FIT_JOURNAL), heading)?;
        Ok(Self::new(
            folder,
            heading,
            (file, work),
            JournalContents::default(),
        ))
    }

    /// The heading of the journal in a folder; `None` where there is no journal.
    ///
    /// # Errors
    /// If it is not the journal of a fit of this format.
    pub fn heading(folder: &Path) -> Result<Option<Heading>, InputError> {
        match folder.join(FIT_JOURNAL).exists() {
            true => JournalReader::open(folder).map(|reader| Some(reader.text.heading)),
            false => Ok(None),
        }
    }

    /// Resumes the journal in a folder, up to the first damaged line.
    ///
    /// # Errors
    /// If there is no journal, or it was started with another model, other data or by another version.
    pub fn resume(folder: &Path, heading: &Heading) -> Result<Self, InputError> {
        let path = folder.join(FIT_JOURNAL);
        let reader = JournalReader::open(folder)?;
        heading.check_same(&reader.text.heading, &path)?;
        let (before, end) = reader.contents();
        let work = WorkFolder::create_in(folder).map_err(|error| {
            InputError::file(folder, "the journal cannot be written to").found(error)
        })?;
        let file = JournalFile::resume(&path, end)?;
        Ok(Self::new(
            folder,
            &reader.text.heading,
            (file, work),
            before,
        ))
    }

    fn new(
        folder: &Path,
        heading: &Heading,
        (file, work): (JournalFile, WorkFolder),
        before: JournalContents,
    ) -> Self {
        Self {
            folder: folder.to_path_buf(),
            heading: heading.clone(),
            waiting_end: file.end,
            file,
            work,
            waiting: Vec::new(),
            written: Instant::now(),
            before,
            unit: 0,
            is_recalled: false,
            pace: Pace::new(heading.checkpoint),
            trouble: None,
        }
    }

    /// Removes journal and checkpoint of a finished fit.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn clear(folder: &Path) -> io::Result<()> {
        for name in [CHECKPOINT, FIT_JOURNAL] {
            system::remove_file(&folder.join(name))?;
        }
        Ok(())
    }

    /// The error of a failed write, if any; the fit continues without the journal.
    pub fn trouble(&self) -> Option<&io::Error> {
        self.trouble.as_ref()
    }

    fn append(&mut self, entry: Entry) {
        if self.trouble.is_some() || self.is_recalled {
            return;
        }
        let line = JournalLine(self.unit, entry);
        if !matches!(line.1, Entry::Row(_)) {
            self.write();
            if self.trouble.is_none() {
                self.trouble = self.file.append(&line).err();
                self.waiting_end = self.file.end;
            }
            return;
        }
        match push_line(&mut self.waiting, self.waiting_end, &line) {
            Ok(end) => self.waiting_end = end,
            Err(error) => self.trouble = Some(error),
        }
        if self.written.elapsed() >= GATHER {
            self.write();
        }
    }

    /// Writes the buffered lines.
    fn write(&mut self) {
        if self.trouble.is_none() && !self.waiting.is_empty() {
            let written = self.file.append_text(&self.waiting, self.waiting_end);
            self.trouble = written.err();
        }
        self.waiting.clear();
        self.written = Instant::now();
    }

    /// Discards the contents of an earlier run after a position.
    fn cut(&mut self, end: JournalPosition) {
        self.before = JournalContents::default();
        self.write();
        match self.file.truncate(end) {
            Ok(()) => self.waiting_end = end,
            Err(error) => self.trouble = Some(error),
        }
    }

    fn checkpoint(&mut self, state: SolverState) -> io::Result<()> {
        // The iterations before a checkpoint are written first.
        self.write();
        self.file.sync()?;
        let path = self.folder.join(CHECKPOINT);
        replace_with(self.work.path(), &path, |out| {
            let begin = write_line(&mut *out, JournalPosition::default(), &self.heading)?;
            write_line(out, begin, &(self.unit, state))?;
            Ok(())
        })
    }
}

impl Drop for FitJournal {
    fn drop(&mut self) {
        self.write();
    }
}

impl CheckpointStore for FitJournal {
    fn begin(&mut self) -> Option<CheckpointUnit> {
        self.unit += 1;
        self.is_recalled = false;
        let end = self.before.end?;
        let Some(unit) = self.before.units.remove(&self.unit) else {
            self.cut(end);
            return None;
        };
        self.before.begin = unit.begin;
        self.before.end = Some(unit.end);
        match unit.kept {
            Some(kept) => {
                self.is_recalled = true;
                Some(kept)
            }
            None => {
                // An unfinished unit continues from its checkpoint, or starts over.
                let state = self.before.state.take().filter(|(u, _)| *u == self.unit);
                let (length, kept) = unit.at_work(state.map(|(_, state)| state));
                let begin = self.before.begin;
                self.cut(length);
                self.before.begin = begin;
                kept
            }
        }
    }

    fn discard(&mut self) {
        self.is_recalled = false;
        self.cut(self.before.begin);
    }

    fn save_iteration(&mut self, row: &IterationRecord) {
        self.append(Entry::Row(row.clone()));
    }

    fn is_due(&self, parameters: usize) -> bool {
        self.trouble.is_none() && self.pace.is_due(parameters)
    }

    fn save_state(&mut self, state: SolverState) {
        if self.trouble.is_some() || self.is_recalled {
            return;
        }
        if state.outcome.is_some() {
            return self.append(Entry::End(Box::new(state)));
        }
        let clock = Instant::now();
        self.trouble = self.checkpoint(state).err();
        self.pace.took = clock.elapsed();
        self.pace.last = Instant::now();
    }

    fn end(&mut self, numbers: Option<&[f64]>) {
        self.append(match numbers {
            Some(numbers) => Entry::Numbers(ExactF64s(numbers.to_vec())),
            None => Entry::Nothing,
        });
    }
}
