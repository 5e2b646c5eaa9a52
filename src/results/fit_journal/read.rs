//! Reading the journal and checkpoint of an unfinished fit.

use super::{Entry, JournalLine};
use crate::error::InputError;
use crate::results::journal::{CHECKPOINT, FIT_JOURNAL, JournalPosition, JournalText};
use kmcfit_core::internals::solvers::{CheckpointUnit, IterationRecord, SolverState};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const WHAT: &str = "the journal of a fit that was started by `kmcfit fit`";

/// A journal that was read.
pub(super) struct JournalReader {
    folder: PathBuf,
    pub text: JournalText,
}

/// Contents of a journal and its checkpoint.
#[derive(Debug, Default)]
pub(super) struct JournalContents {
    pub units: BTreeMap<u64, JournalUnit>,
    /// Number of the unfinished unit and its state.
    pub state: Option<(u64, SolverState)>,
    /// Begin of the unfinished unit.
    pub begin: JournalPosition,
    /// End of the recalled part; `None` for all of it.
    pub end: Option<JournalPosition>,
}

/// Entries of one unit.
#[derive(Debug)]
pub(super) struct JournalUnit {
    pub begin: JournalPosition,
    pub end: JournalPosition,
    /// Result, if it ended.
    pub kept: Option<CheckpointUnit>,
    /// Iterations, each with the end of its line.
    rows: Vec<(IterationRecord, JournalPosition)>,
}

impl JournalUnit {
    fn new(begin: JournalPosition) -> Self {
        Self {
            begin,
            end: begin,
            kept: None,
            rows: Vec::new(),
        }
    }

    /// Adds an entry; false if it cannot follow the previous ones.
    fn take(&mut self, entry: Entry, end: JournalPosition) -> bool {
        if self.kept.is_some() {
            return false;
        }
        match entry {
            Entry::Row(row) if row.iteration == self.rows.len() as u64 + 1 => {
                self.rows.push((row, end));
            }
            Entry::End(state) if state.iterations == self.rows.len() as u64 => {
                let rows = std::mem::take(&mut self.rows).into_iter();
                let rows = rows.map(|(row, _)| row).collect();
                self.kept = Some(CheckpointUnit::Search(rows, state));
            }
            Entry::Numbers(numbers) if self.rows.is_empty() => {
                self.kept = Some(CheckpointUnit::Numbers(numbers.0));
            }
            Entry::Nothing if self.rows.is_empty() => self.kept = Some(CheckpointUnit::Nothing),
            _ => return false,
        }
        self.end = end;
        true
    }

    /// End of the usable entries of an unfinished unit, and the state to continue from.
    pub fn at_work(
        mut self,
        state: Option<SolverState>,
    ) -> (JournalPosition, Option<CheckpointUnit>) {
        let usable = state.and_then(|state| {
            let iterations = usize::try_from(state.iterations).ok()?;
            let (_, end) = *self.rows.get(iterations.checked_sub(1)?)?;
            Some((state, iterations, end))
        });
        match usable {
            None => (self.begin, None),
            Some((state, iterations, end)) => {
                self.rows.truncate(iterations);
                let rows = self.rows.into_iter().map(|(row, _)| row).collect();
                (end, Some(CheckpointUnit::Search(rows, Box::new(state))))
            }
        }
    }
}

impl JournalReader {
    /// Reads the journal in a folder.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        Ok(Self {
            folder: folder.to_path_buf(),
            text: JournalText::read(&folder.join(FIT_JOURNAL), WHAT)?,
        })
    }

    /// Contents up to the first line that is damaged or cannot follow the previous ones, with the checkpoint if it
    /// belongs to this fit; and the begin of that line.
    pub fn contents(&self) -> (JournalContents, JournalPosition) {
        let mut end = self.text.begin;
        let mut units: BTreeMap<u64, JournalUnit> = BTreeMap::new();
        for (JournalLine(unit, entry), next) in self.text.lines() {
            let last = units.last_key_value().map_or(0, |(unit, _)| *unit);
            let is_next = unit == last + 1 && units.get(&last).is_none_or(|u| u.kept.is_some());
            if !(is_next || unit == last && last > 0) {
                break;
            }
            let known = units.entry(unit).or_insert_with(|| JournalUnit::new(end));
            if !known.take(entry, next) {
                break;
            }
            end = next;
        }
        let contents = JournalContents {
            units,
            state: self.state(),
            begin: JournalPosition::default(),
            end: Some(self.text.begin),
        };
        (contents, end)
    }

    /// The checkpoint, if undamaged and of this fit.
    fn state(&self) -> Option<(u64, SolverState)> {
        let checkpoint = JournalText::read(&self.folder.join(CHECKPOINT), WHAT).ok()?;
        let is_of_this_fit = checkpoint.heading == self.text.heading;
        let (state, _) = checkpoint.lines().next()?;
        is_of_this_fit.then_some(state)
    }
}
