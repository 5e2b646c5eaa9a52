//! The journal of a fit: one line per iteration and per finished search, and a checkpoint beside it.
//!
//! Lines of iterations are collected for some milliseconds before they are written, so a fit that is killed loses at
//! most the last of them. The checkpoint holds the state of the running search; it is replaced as a whole every
//! now and then. Both are removed when the results are written. [`CheckpointStore`] defines what they hold and how a fit is
//! resumed from it. Times are taken from a monotonic clock.

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

/// Least time between two checkpoints: what a killed fit loses at most, about.
const EVERY: Duration = Duration::from_secs(1);
/// Checkpoints take at most one part in so many of the time of a fit.
const SHARE: u32 = 50;
/// What the first takes for each parameter, about: L-BFGS remembers dozens of numbers of each.
const A_PARAMETER: Duration = Duration::from_micros(4);

/// Lines of iterations wait so long for more: a thousand quick iterations would else take as long to write
/// down as a tenth of what they are.
const GATHER: Duration = Duration::from_millis(5);

/// A line: the number of the unit that it is about, and what is said of it.
#[derive(Serialize, Deserialize)]
struct JournalLine<E>(u64, E);

/// What a line says.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Entry {
    /// An iteration of the search.
    Row(IterationRecord),
    /// The search has ended.
    End(Box<SolverState>),
    /// Numbers that were computed.
    Piece(ExactF64s),
    /// It ended without a result.
    Nothing,
}

/// A journal at work.
#[derive(Debug)]
pub struct FitJournal {
    folder: PathBuf,
    heading: Heading,
    file: JournalFile,
    work: WorkFolder,
    /// Lines that wait to be written, where they end, and when others were last written.
    waiting: Vec<u8>,
    waiting_end: JournalPosition,
    written: Instant,
    /// What an earlier run of the same fit left.
    before: JournalContents,
    /// The unit that is at work, from 1.
    unit: u64,
    /// Whether it had ended before.
    is_recalled: bool,
    pace: Pace,
    trouble: Option<io::Error>,
}

/// When checkpoints are due.
#[derive(Debug)]
struct Pace {
    every: Duration,
    /// Whether somebody asked for this pace whatever it costs.
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
    /// A new journal in a folder, in the place of an older one.
    ///
    /// # Errors
    /// What the file system says.
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

    /// Resumes the journal in a folder, up to the first line that is damaged.
    ///
    /// # Errors
    /// If there is none, or it was begun with another model, other data or by another version.
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

    /// Removes journal and checkpoint of a fit that has come to its end.
    ///
    /// # Errors
    /// What the file system says.
    pub fn clear(folder: &Path) -> io::Result<()> {
        for name in [CHECKPOINT, FIT_JOURNAL] {
            system::remove_file(&folder.join(name))?;
        }
        Ok(())
    }

    /// Why the journal could not be written to, if it could not: the fit goes on without it.
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

    /// Writes the lines that wait.
    fn write(&mut self) {
        if self.trouble.is_none() && !self.waiting.is_empty() {
            let written = self.file.append_text(&self.waiting, self.waiting_end);
            self.trouble = written.err();
        }
        self.waiting.clear();
        self.written = Instant::now();
    }

    /// Drops what an earlier run left behind a place.
    fn cut(&mut self, end: JournalPosition) {
        self.before = JournalContents::default();
        self.write();
        match self.file.truncate(end) {
            Ok(()) => self.waiting_end = end,
            Err(error) => self.trouble = Some(error),
        }
    }

    fn checkpoint(&mut self, standing: SolverState) -> io::Result<()> {
        // The iterations before it must not be lost when it is not.
        self.write();
        self.file.sync()?;
        let path = self.folder.join(CHECKPOINT);
        replace_with(self.work.path(), &path, |out| {
            let begin = write_line(&mut *out, JournalPosition::default(), &self.heading)?;
            write_line(out, begin, &(self.unit, standing))?;
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
                // It was at work: it goes on from its checkpoint, or begins again.
                let standing = self.before.standing.take().filter(|(u, _)| *u == self.unit);
                let (length, kept) = unit.at_work(standing.map(|(_, standing)| standing));
                let begin = self.before.begin;
                self.cut(length);
                self.before.begin = begin;
                kept
            }
        }
    }

    fn refuse(&mut self) {
        self.is_recalled = false;
        self.cut(self.before.begin);
    }

    fn row(&mut self, row: &IterationRecord) {
        self.append(Entry::Row(row.clone()));
    }

    fn is_due(&self, parameters: usize) -> bool {
        self.trouble.is_none() && self.pace.is_due(parameters)
    }

    fn stand(&mut self, standing: SolverState) {
        if self.trouble.is_some() || self.is_recalled {
            return;
        }
        if standing.outcome.is_some() {
            return self.append(Entry::End(Box::new(standing)));
        }
        let clock = Instant::now();
        self.trouble = self.checkpoint(standing).err();
        self.pace.took = clock.elapsed();
        self.pace.last = Instant::now();
    }

    fn end(&mut self, piece: Option<&[f64]>) {
        self.append(match piece {
            Some(piece) => Entry::Piece(ExactF64s(piece.to_vec())),
            None => Entry::Nothing,
        });
    }
}
