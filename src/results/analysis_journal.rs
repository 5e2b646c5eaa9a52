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

const WHAT: &str = "the journal of a study or comparison that was begun by kmcfit";

/// A line: the name of an analysis and its result.
#[derive(Serialize, Deserialize)]
struct AnalysisLine {
    analysis: String,
    result: Value,
}

/// Name of the line that is written once the results are; no analysis has it, and no file.
const FINISHED: &str = "results/written";

/// Whether the work of a journal is finished and its results were written.
pub(super) fn is_finished(path: &Path) -> bool {
    let Ok(text) = JournalText::read(path, WHAT) else {
        return false;
    };
    text.lines()
        .any(|(line, _): (AnalysisLine, _)| line.analysis == FINISHED)
}

/// The finished analyses, on disk as soon as they are.
#[derive(Debug)]
pub struct AnalysisJournal {
    file: JournalFile,
    done: BTreeMap<String, Value>,
}

impl AnalysisJournal {
    /// A new journal of this name in a folder, in the place of an older one.
    ///
    /// # Errors
    /// What the file system says.
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
    /// If there is none of this format.
    pub fn heading(folder: &Path, name: &str) -> Result<Heading, InputError> {
        Ok(JournalText::read(&folder.join(name), WHAT)?.heading)
    }

    /// Resumes the journal of this name in a folder, up to the first line that is damaged.
    ///
    /// # Errors
    /// If there is none, or it was begun with other inputs or by another version.
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

    /// Whether there is an analysis of this name.
    pub fn has(&self, name: &str) -> bool {
        self.done.contains_key(name)
    }

    /// Marks the work as finished if it `is_done`: its results are written, and may be replaced by those of other inputs.
    ///
    /// # Errors
    /// What the file system says.
    pub fn finish_if(&mut self, is_done: bool) -> io::Result<()> {
        match is_done {
            true => self.analysis(FINISHED, || true, || true).map(drop),
            false => Ok(()),
        }
    }

    /// Forgets an analysis that does not have the expected form, so that it is made again.
    pub fn forget_unless<T: DeserializeOwned>(
        &mut self,
        name: &str,
        is_right: impl Fn(&T) -> bool,
    ) {
        let kept = self.done.get(name).cloned();
        let read = kept.and_then(|kept| serde_json::from_value(kept).ok());
        if !read.as_ref().is_some_and(is_right) {
            self.done.remove(name);
        }
    }

    /// The result of an analysis: as it was kept, or computed now and kept; `None` if it is not `whole`
    /// after it was computed.
    ///
    /// # Errors
    /// What the file system says.
    pub fn analysis<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        compute: impl FnOnce() -> T,
        whole: impl FnOnce() -> bool,
    ) -> io::Result<Option<T>> {
        if let Some(kept) = self.done.get(name)
            && let Ok(result) = serde_json::from_value(kept.clone())
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
        // The value as it would be read back; one with numbers that JSON does not have is computed again
        // when the study is resumed.
        Ok(Some(serde_json::from_value(line.result).unwrap_or(result)))
    }
}
