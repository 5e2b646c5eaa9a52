//! Reading what a fit that did not come to its end left behind.

use super::heading::{FORMAT, FitHeading};
use super::{CHECKPOINT, Checkpoint, Entry, FIT_JOURNAL, Line};
use crate::error::InputError;
use crate::input::read_text;
use crate::solvers::{Kept, Row, Standing};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Longest journal or checkpoint that is read, bytes.
const LONGEST: u64 = 1 << 30;
const WHAT: &str = "the journal of a fit that was begun by `kmcfit fit`";

/// A journal that was read.
pub(super) struct Reader {
    folder: PathBuf,
    text: String,
    pub heading: FitHeading,
}

/// What a journal and its checkpoint hold.
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub units: BTreeMap<u64, Unit>,
    /// Where the running search stood, and which unit it was.
    pub standing: Option<(u64, Standing)>,
    /// Bytes of the journal before the unit that is at work.
    pub begin: u64,
    /// Bytes up to the end of what was recalled; nothing when all of it was.
    pub end: Option<u64>,
}

/// What a journal holds of one unit.
#[derive(Debug)]
pub(super) struct Unit {
    pub begin: u64,
    pub end: u64,
    /// What it came to, if it ended.
    pub kept: Option<Kept>,
    /// The iterations, and where the line of each ends.
    rows: Vec<(Row, u64)>,
}

impl Unit {
    fn new(begin: u64) -> Self {
        Self {
            begin,
            end: begin,
            kept: None,
            rows: Vec::new(),
        }
    }

    /// Takes a line; whether it can follow those before it.
    fn take(&mut self, entry: Entry, end: u64) -> bool {
        if self.kept.is_some() {
            return false;
        }
        match entry {
            Entry::Row(row) if row.iteration == self.rows.len() as u64 + 1 => {
                self.rows.push((row, end));
            }
            Entry::End(standing) if standing.iterations == self.rows.len() as u64 => {
                let rows = std::mem::take(&mut self.rows).into_iter();
                let rows = rows.map(|(row, _)| row).collect();
                self.kept = Some(Kept::Search(rows, standing));
            }
            Entry::Piece(piece) if self.rows.is_empty() => self.kept = Some(Kept::Piece(piece.0)),
            Entry::Nothing if self.rows.is_empty() => self.kept = Some(Kept::Nothing),
            _ => return false,
        }
        self.end = end;
        true
    }

    /// How a unit that had not ended goes on, and how many bytes of the journal are of use for it.
    pub fn at_work(mut self, standing: Option<Standing>) -> (u64, Option<Kept>) {
        let usable = standing.and_then(|standing| {
            let iterations = usize::try_from(standing.iterations).ok()?;
            let (_, end) = *self.rows.get(iterations.checked_sub(1)?)?;
            Some((standing, iterations, end))
        });
        match usable {
            None => (self.begin, None),
            Some((standing, iterations, end)) => {
                self.rows.truncate(iterations);
                let rows = self.rows.into_iter().map(|(row, _)| row).collect();
                (end, Some(Kept::Search(rows, Box::new(standing))))
            }
        }
    }
}

/// The journal in a folder; a link in its place could lead out of the folder.
pub(super) fn journal_file(folder: &Path) -> Result<PathBuf, InputError> {
    let path = folder.join(FIT_JOURNAL);
    match path.is_symlink() {
        true => Err(InputError::file(&path, "this is a link").expected(WHAT)),
        false => Ok(path),
    }
}

impl Reader {
    /// Reads the journal in a folder.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        let path = folder.join(FIT_JOURNAL);
        let text = read_journal(&path)?;
        let first = text.lines().next().unwrap_or_default();
        let damaged = |found: &dyn std::fmt::Display| {
            InputError::file(&path, "this is no journal of a fit")
                .found(found)
                .expected(WHAT)
        };
        let value: serde_json::Value = serde_json::from_str(first).map_err(|e| damaged(&e))?;
        let format = value.get("format").and_then(serde_json::Value::as_u64);
        if format.is_some_and(|format| format != u64::from(FORMAT)) {
            return Err(
                InputError::file(&path, "the journal has another format version")
                    .found(format.unwrap_or_default())
                    .expected(FORMAT.to_string()),
            );
        }
        let heading = serde_json::from_value(value).map_err(|e| damaged(&e))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            text,
            heading,
        })
    }

    /// What it holds up to the first line that is not whole, and the checkpoint if it is of this fit.
    pub fn contents(&self, fingerprint: &str) -> Contents {
        let mut lines = self.text.split_inclusive('\n');
        let mut end = lines.next().map_or(0, |line| line.len() as u64);
        let mut units: BTreeMap<u64, Unit> = BTreeMap::new();
        for line in lines.filter(|line| line.ends_with('\n')) {
            let Ok(Line(unit, entry)) = serde_json::from_str::<Line<Entry>>(line) else {
                break;
            };
            let next = end + line.len() as u64;
            let last = units.last_key_value().map_or(0, |(unit, _)| *unit);
            let is_next = unit == last + 1 && units.get(&last).is_none_or(|u| u.kept.is_some());
            if !(is_next || unit == last && last > 0) {
                break;
            }
            let known = units.entry(unit).or_insert_with(|| Unit::new(end));
            if !known.take(entry, next) {
                break;
            }
            end = next;
        }
        let first = self.text.split_inclusive('\n').next();
        Contents {
            units,
            standing: self.standing(fingerprint),
            begin: 0,
            end: first.map(|line| line.len() as u64),
        }
    }

    fn standing(&self, fingerprint: &str) -> Option<(u64, Standing)> {
        let path = self.folder.join(CHECKPOINT);
        let text = read_text(&path, "a checkpoint", LONGEST).ok()?;
        let checkpoint: Checkpoint = serde_json::from_str(&text).ok()?;
        (checkpoint.fit == fingerprint).then_some((checkpoint.unit, checkpoint.standing))
    }
}

/// The journal's text. What is behind a tear in it may not be text at all.
fn read_journal(path: &Path) -> Result<String, InputError> {
    let bytes = crate::input::read_bytes(path, WHAT, LONGEST)?;
    Ok(match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let good = error.utf8_error().valid_up_to();
            let mut bytes = error.into_bytes();
            bytes.truncate(good);
            String::from_utf8(bytes).unwrap_or_default()
        }
    })
}
