//! The format of all journals: text files to which lines are appended while a command works.
//!
//! A line is a JSON value, a tab, and 16 hexadecimal digits: the chained checksum, the first 8 bytes of
//! `SHA-256(previous checksum || JSON)`. The first line holds the [`Heading`]. A line with a wrong checksum was
//! truncated, edited, moved or taken from another journal: reading stops before it, and the work of this and all
//! following lines is repeated.

use super::atomic::begin_file;
use super::heading::Heading;
use super::system::{self, Writer};
use super::work_folder::WorkFolder;
use crate::error::InputError;
use crate::text_io::{open, read_bytes};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::Path;

/// Name of the journal of a fit.
pub const FIT_JOURNAL: &str = "fit.journal";
/// Name of its checkpoint.
pub const CHECKPOINT: &str = "fit.checkpoint";
/// Name of the journal of a study.
pub const STUDY_JOURNAL: &str = "study.journal";
/// Name of the journal of a comparison.
pub const COMPARE_JOURNAL: &str = "compare.journal";
/// All journals and checkpoints of output folders.
pub(super) const NAMES: [&str; 4] = [FIT_JOURNAL, CHECKPOINT, STUDY_JOURNAL, COMPARE_JOURNAL];
/// Longest journal, bytes: limited by memory alone, since every written journal must be readable.
const LONGEST: u64 = u64::MAX;
/// Longest first line of a journal, bytes: room for the paths and digests of 2000 records.
const LONGEST_HEADING: u64 = 1 << 24;
/// Size of the write buffer, bytes.
const BUFFER: usize = 1 << 16;
/// Digits of a checksum at the end of a line, with the tab before them.
const TAIL: usize = 17;

/// Position between two lines: the number of bytes before it, and the checksum of the line that ends there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct JournalPosition {
    pub bytes: u64,
    chain: u64,
}

/// The checksum of a line from that of the line before and its JSON.
struct ChainedChecksum(Sha256);

impl ChainedChecksum {
    fn after(previous: u64) -> Self {
        Self(Sha256::new().chain_update(previous.to_be_bytes()))
    }

    fn finish(self) -> u64 {
        let digest = self.0.finalize();
        digest[..8]
            .iter()
            .fold(0, |sum, byte| sum << 8 | u64::from(*byte))
    }
}

/// Appends a line to a text; returns the position after it.
pub(super) fn push_line(
    text: &mut Vec<u8>,
    mark: JournalPosition,
    entry: &impl Serialize,
) -> io::Result<JournalPosition> {
    write_line(text, mark, entry)
}

/// A writer that computes the checksum of its output.
struct Summing<W> {
    inner: W,
    chain: ChainedChecksum,
    bytes: u64,
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.inner.write(bytes)?;
        self.chain.0.update(&bytes[..count]);
        self.bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Writes a line as a stream: in memory a long one would take a multiple of the memory of a fit.
pub(super) fn write_line(
    out: impl Write,
    mark: JournalPosition,
    entry: &impl Serialize,
) -> io::Result<JournalPosition> {
    let mut summing = Summing {
        inner: out,
        chain: ChainedChecksum::after(mark.chain),
        bytes: 0,
    };
    serde_json::to_writer(&mut summing, entry)?;
    let Summing {
        mut inner,
        chain,
        bytes,
    } = summing;
    let chain = chain.finish();
    inner.write_all(format!("\t{chain:016x}\n").as_bytes())?;
    inner.flush()?;
    Ok(JournalPosition {
        bytes: mark.bytes + bytes + TAIL as u64 + 1,
        chain,
    })
}

/// The JSON of a line with a correct checksum, and the position after it; `None` for any other line.
fn checked(line: &[u8], mark: JournalPosition) -> Option<(&[u8], JournalPosition)> {
    let text = line.strip_suffix(b"\n")?;
    let (json, tail) = text.split_at_checked(text.len().checked_sub(TAIL)?)?;
    let digits = std::str::from_utf8(tail.strip_prefix(b"\t")?).ok()?;
    let mut chain = ChainedChecksum::after(mark.chain);
    chain.0.update(json);
    let chain = chain.finish();
    let mark = JournalPosition {
        bytes: mark.bytes + line.len() as u64,
        chain,
    };
    // Compared as text: the program writes a number in one form only.
    (format!("{chain:016x}") == digits).then_some((json, mark))
}

/// The heading of a journal or checkpoint; `None` for a file that kmcfit did not write, without a heading and its
/// checksum.
pub(super) fn heading_of(path: &Path) -> Option<Heading> {
    let (file, _) = open(path, "a journal").ok()?;
    let line = first_line(file).ok()?;
    let (json, _) = checked(&line, JournalPosition::default())?;
    let value: serde_json::Value = serde_json::from_slice(json).ok()?;
    let heading = Heading::deserialize(&value).ok()?;
    (!path.is_symlink()).then_some(heading)
}

/// The first line of a file, up to the longest heading.
fn first_line(file: File) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    let file = BufReader::new(file);
    file.take(LONGEST_HEADING).read_until(b'\n', &mut line)?;
    Ok(line)
}

/// An open journal. Lines are appended and never changed.
#[derive(Debug)]
pub(super) struct JournalFile {
    file: File,
    /// End of the written lines.
    pub end: JournalPosition,
}

impl JournalFile {
    /// Creates a journal; replaces an older one.
    pub fn begin(work: &WorkFolder, path: &Path, heading: &Heading) -> io::Result<Self> {
        let mut text = Vec::new();
        let end = push_line(&mut text, JournalPosition::default(), heading)?;
        let text = String::from_utf8(text).map_err(io::Error::other)?;
        let file = begin_file(work.path(), path, &text)?;
        Ok(Self { file, end })
    }

    /// Opens a journal for appending at `end`; discards the rest.
    pub fn resume(path: &Path, end: JournalPosition) -> Result<Self, InputError> {
        let resumed = system::open_to_append(path).and_then(|file| {
            let mut journal = Self { file, end };
            journal.truncate(end)?;
            Ok(journal)
        });
        resumed.map_err(|error| {
            InputError::file(path, "the journal cannot be written to").found(error)
        })
    }

    /// Truncates the file at a position.
    pub fn truncate(&mut self, end: JournalPosition) -> io::Result<()> {
        system::truncate(&self.file, end.bytes)?;
        self.end = end;
        Ok(())
    }

    /// Appends lines made by [`push_line`].
    pub fn append_text(&mut self, text: &[u8], end: JournalPosition) -> io::Result<()> {
        system::write_all(&self.file, text)?;
        self.end = end;
        Ok(())
    }

    /// Appends a line.
    pub fn append(&mut self, entry: &impl Serialize) -> io::Result<()> {
        let out = BufWriter::with_capacity(BUFFER, Writer(&self.file));
        self.end = write_line(out, self.end, entry)?;
        Ok(())
    }

    /// Makes the written lines durable.
    pub fn sync(&self) -> io::Result<()> {
        system::sync(&self.file)
    }
}

/// A journal in memory.
pub(super) struct JournalText {
    bytes: Vec<u8>,
    /// The first line.
    pub heading: Heading,
    /// The end of the first line.
    pub begin: JournalPosition,
}

impl JournalText {
    /// Reads a journal or checkpoint; `what` describes it in messages.
    ///
    /// # Errors
    /// If there is none of this format.
    pub fn read(path: &Path, what: &'static str) -> Result<Self, InputError> {
        if path.is_symlink() {
            return Err(InputError::file(path, "this is a symbolic link").expected(what));
        }
        // A file that is not a journal is not read beyond its first line.
        let (file, _) = open(path, what)?;
        let line = first_line(file)
            .map_err(|error| InputError::file(path, "the file cannot be read").found(error))?;
        let line = line.as_slice();
        // The version of the format is checked first, because the form of the lines depends on it.
        let json = line.split(|b| matches!(b, b'\t' | b'\n')).next();
        let value: serde_json::Value = serde_json::from_slice(json.unwrap_or_default())
            .map_err(|_| no_journal(path, what).found("a first line that is not JSON"))?;
        Heading::check_format(&value, path)?;
        let (_, begin) = checked(line, JournalPosition::default())
            .ok_or_else(|| no_journal(path, what).found("a first line with a wrong checksum"))?;
        let heading =
            Heading::deserialize(&value).map_err(|error| no_journal(path, what).found(error))?;
        Ok(Self {
            bytes: read_bytes(path, what, LONGEST)?,
            heading,
            begin,
        })
    }

    /// The lines after the heading up to the first damaged one, each with the position after it.
    pub fn lines<T: DeserializeOwned>(&self) -> impl Iterator<Item = (T, JournalPosition)> {
        let start = usize::try_from(self.begin.bytes).unwrap_or(usize::MAX);
        let mut rest = self.bytes.get(start..).unwrap_or_default();
        let mut mark = self.begin;
        std::iter::from_fn(move || {
            let length = rest.iter().position(|b| *b == b'\n')? + 1;
            let (line, behind) = rest.split_at(length);
            let (json, next) = checked(line, mark)?;
            let entry = serde_json::from_slice(json).ok()?;
            (rest, mark) = (behind, next);
            Some((entry, next))
        })
    }
}

fn no_journal(path: &Path, what: &str) -> InputError {
    InputError::file(path, "not a journal of kmcfit, or it was edited").expected(what)
}

/// A journal text from a heading and lines of JSON, with checksums; for tests that change the contents of a journal.
#[doc(hidden)]
pub fn with_checksums(heading: &Heading, lines: &[u8]) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    let mut mark = push_line(&mut text, JournalPosition::default(), heading)?;
    for json in lines.split_inclusive(|b| *b == b'\n') {
        let json = json.strip_suffix(b"\n").unwrap_or(json);
        let mut chain = ChainedChecksum::after(mark.chain);
        chain.0.update(json);
        mark.chain = chain.finish();
        text.extend(json);
        text.extend(format!("\t{:016x}\n", mark.chain).bytes());
    }
    Ok(text)
}
