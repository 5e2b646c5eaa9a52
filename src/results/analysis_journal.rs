//! A journal of finished analyses: an interrupted study or comparison resumes after the last one.

use super::heading::Heading;
use super::journal::{JournalFile, JournalText};
use super::work_folder::WorkFolder;
use crate::error::InputError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

const WHAT: &str = "the journal of a study or comparison that was started by kmcfit";

/// Entry of the journal: the name of an analysis and its result.
#[derive(Serialize, Deserialize)]
struct AnalysisLine {
    analysis: String,
    result: Value,
}

/// Name of the entry that is written after the results; neither an analysis nor a file has this name.
const FINISHED: &str = "results/written";

/// True if the work of a journal is finished and its results were written.
pub(super) fn is_finished(path: &Path) -> bool {
    let Ok(text) = JournalText::read(path, WHAT) else {
        return false;
    };
    text.lines()
        .any(|(line, _): (AnalysisLine, _)| line.analysis == FINISHED)
}

/// Journal of finished analyses; each is made durable when it ends.
#[derive(Debug)]
pub struct AnalysisJournal {
    file: JournalFile,
    done: BTreeMap<String, Value>,
}

impl AnalysisJournal {
    /// Creates a journal of this name in a folder; replaces an older one.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn begin(folder: &Path, name: &str, heading: &Heading) -> io::Result<Self> {
        let work = WorkFolder::create_in(folder)?;
        Ok(Self {
            file: JournalFile::begin(&work, &folder.join(name), heading)?,
            done: BTreeMap::new(),
        })
    }

    /// The heading of the journal of this name in a folder.
    ///
    /// # Errors
    /// If there is no journal of this format.
    pub fn heading(folder: &Path, name: &str) -> Result<Heading, InputError> {
        Ok(JournalText::read(&folder.join(name), WHAT)?.heading)
    }

    /// Resumes the journal of this name in a folder, up to the first damaged line.
    ///
    /// # Errors
    /// If there is no journal, or it was started with other inputs or by another version.
    pub fn resume(folder: &Path, name: &str, heading: &Heading) -> Result<Self, InputError> {
        let path = folder.join(name);
        let text = JournalText::read(&path, WHAT)?;
        heading.check_same(&text.heading, &path)?;
        let mut done = BTreeMap::new();
        let mut end = text.begin;
        for (AnalysisLine { analysis, result }, next) in text.lines() {
            done.insert(analysis, result);
            end = next;
        }
        Ok(Self {
            file: JournalFile::resume(&path, end)?,
            done,
        })
    }

    /// True if there is an analysis of this name.
    pub fn has(&self, name: &str) -> bool {
        self.done.contains_key(name)
    }

    /// Marks the work as finished if `is_done`: its results are written, and results of other inputs may replace them.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn finish_if(&mut self, is_done: bool) -> io::Result<()> {
        match is_done {
            true => self.analysis(FINISHED, || true, || true).map(drop),
            false => Ok(()),
        }
    }

    /// Discards an analysis that cannot be deserialised, so that it is repeated.
    pub fn forget_unless<T: DeserializeOwned>(
        &mut self,
        name: &str,
        is_right: impl Fn(&T) -> bool,
    ) {
        let kept = self.done.get(name);
        let read = kept.and_then(|kept| T::deserialize(kept).ok());
        if !read.as_ref().is_some_and(is_right) {
            self.done.remove(name);
        }
    }

    /// The result of an analysis: read from the journal, or computed and stored; `None` if the computed result is not
    /// `whole`.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn analysis<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        compute: impl FnOnce() -> T,
        whole: impl FnOnce() -> bool,
    ) -> io::Result<Option<T>> {
        if let Some(kept) = self.done.get(name)
            && let Ok(result) = T::deserialize(kept)
        {
            return Ok(Some(result));
        }
        let result = compute();
        if !whole() {
            return Ok(None);
        }
        let line = AnalysisLine {
            analysis: name.to_owned(),
            result: serde_json::to_value(&result).map_err(io::Error::other)?,
        };
        self.file.append(&line)?;
        self.file.sync()?;
        // The value as read back from JSON; a result with numbers that JSON cannot represent is computed again when the
        // study is resumed.
        Ok(Some(T::deserialize(&line.result).unwrap_or(result)))
    }
}
