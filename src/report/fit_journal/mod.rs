//! The journal of a fit: one line per iteration and per finished search, and a checkpoint beside it.
//!
//! Lines are appended and never changed; those of iterations wait for each other for some milliseconds, so
//! a fit that is killed loses at most the last of them. The checkpoint holds where the running search
//! stands; it is replaced as a whole every now and then. Both go when the results are written. What they
//! hold and how a fit goes on from it is told by [`Keeper`]; nothing here looks at the system clock.

mod heading;
mod read;

pub(super) use heading::hash;
pub use heading::{FitHeading, Source};

use super::files::{begun, write_whole_with};
use crate::error::InputError;
use crate::solvers::{Bits, Keeper, Kept, Row, Standing};
use read::{Contents, Reader, journal_file};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the journal.
pub const FIT_JOURNAL: &str = "fit.journal";
/// Name of the checkpoint.
pub const CHECKPOINT: &str = "fit.checkpoint";
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
struct Line<E>(u64, E);

/// What a line says.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Entry {
    /// An iteration of the search.
    Row(Row),
    /// The search has ended.
    End(Box<Standing>),
    /// Numbers that were computed.
    Piece(Bits),
    /// It ended without a result.
    Nothing,
}

/// The content of the checkpoint.
#[derive(Serialize, Deserialize)]
struct Checkpoint {
    /// Of the heading of the journal beside it.
    fit: String,
    unit: u64,
    standing: Standing,
}

/// A journal at work.
#[derive(Debug)]
pub struct FitJournal {
    folder: PathBuf,
    fingerprint: String,
    file: File,
    /// Lines that wait to be written, and when others were last.
    waiting: String,
    written: Instant,
    /// What an earlier run of the same fit left.
    before: Contents,
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
    pub fn begin(folder: &Path, heading: &FitHeading) -> io::Result<Self> {
        Self::clear(folder)?;
        let mut text = serde_json::to_string(heading).map_err(io::Error::other)?;
        text.push('\n');
        let file = begun(&folder.join(FIT_JOURNAL), &text)?;
        Ok(Self::new(folder, heading, file, Contents::default()))
    }

    /// The heading of the journal in a folder; nothing where there is no journal.
    ///
    /// # Errors
    /// If it is not the journal of a fit of this format.
    pub fn heading(folder: &Path) -> Result<Option<FitHeading>, InputError> {
        match folder.join(FIT_JOURNAL).exists() {
            true => Reader::open(folder).map(|reader| Some(reader.heading)),
            false => Ok(None),
        }
    }

    /// The journal in a folder, to be gone on with. A last line that was cut off does not count.
    ///
    /// # Errors
    /// If there is none, or it is of another model, other data or another version.
    pub fn go_on(folder: &Path, heading: &FitHeading) -> Result<Self, InputError> {
        let path = journal_file(folder)?;
        let reader = Reader::open(folder)?;
        heading.same_as(&reader.heading, &path)?;
        let fingerprint = reader.heading.fingerprint();
        let before = reader.contents(&fingerprint);
        let file = OpenOptions::new().append(true).open(&path);
        let file = file.map_err(|error| {
            InputError::file(
                &path,
                format!("the journal cannot be gone on with: {error}"),
            )
        })?;
        Ok(Self::new(folder, &reader.heading, file, before))
    }

    fn new(folder: &Path, heading: &FitHeading, file: File, before: Contents) -> Self {
        Self {
            folder: folder.to_path_buf(),
            fingerprint: heading.fingerprint(),
            file,
            waiting: String::new(),
            written: Instant::now(),
            before,
            unit: 0,
            is_recalled: false,
            pace: Pace::new(heading.checkpoint),
            trouble: None,
        }
    }

    /// Takes journal and checkpoint away: of a fit that is over there is nothing to go on with.
    ///
    /// # Errors
    /// What the file system says.
    pub fn clear(folder: &Path) -> io::Result<()> {
        for name in [CHECKPOINT, FIT_JOURNAL] {
            match std::fs::remove_file(folder.join(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
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
        if !matches!(entry, Entry::Row(_)) {
            self.write();
            if self.trouble.is_none() {
                self.trouble = self.stream(entry).err();
            }
            return;
        }
        match serde_json::to_string(&Line(self.unit, entry)) {
            Ok(line) => {
                self.waiting += &line;
                self.waiting.push('\n');
            }
            Err(error) => self.trouble = Some(io::Error::other(error)),
        }
        if self.written.elapsed() >= GATHER {
            self.write();
        }
    }

    /// Writes a line that may be long: as a text it would take a multiple of the memory of the fit.
    fn stream(&self, entry: Entry) -> io::Result<()> {
        let mut out = BufWriter::with_capacity(1 << 16, &self.file);
        serde_json::to_writer(&mut out, &Line(self.unit, entry))?;
        out.write_all(b"\n")?;
        out.flush()
    }

    /// Writes the lines that wait.
    fn write(&mut self) {
        if self.trouble.is_none() {
            self.trouble = self.file.write_all(self.waiting.as_bytes()).err();
        }
        self.waiting.clear();
        self.written = Instant::now();
    }

    /// Drops what an earlier run left after the first `length` bytes.
    fn cut(&mut self, length: u64) {
        self.before = Contents::default();
        self.write();
        if let Err(error) = self.file.set_len(length) {
            self.trouble = Some(error);
        }
    }

    fn checkpoint(&mut self, standing: Standing) -> io::Result<()> {
        // The iterations before it must not be lost when it is not.
        self.write();
        self.file.sync_data()?;
        let checkpoint = Checkpoint {
            fit: self.fingerprint.clone(),
            unit: self.unit,
            standing,
        };
        write_whole_with(&self.folder.join(CHECKPOINT), |file| {
            Ok(serde_json::to_writer(file, &checkpoint)?)
        })
    }
}

impl Drop for FitJournal {
    fn drop(&mut self) {
        self.write();
    }
}

impl Keeper for FitJournal {
    fn begin(&mut self) -> Option<Kept> {
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

    fn row(&mut self, row: &Row) {
        self.append(Entry::Row(row.clone()));
    }

    fn is_due(&self, parameters: usize) -> bool {
        self.trouble.is_none() && self.pace.is_due(parameters)
    }

    fn stand(&mut self, standing: Standing) {
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
            Some(piece) => Entry::Piece(Bits(piece.to_vec())),
            None => Entry::Nothing,
        });
    }
}
