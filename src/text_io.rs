//! Reading of text files with limits on length and memory, and quotation of their contents in messages.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata};
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::time::SystemTime;

use crate::error::InputError;
use crate::memory;
use crate::spelling::did_you_mean;

/// Longest quotation of an input in a message, in characters.
const LONGEST_QUOTE: usize = 40;

/// Most names that are listed in a message.
const MOST_NAMES: usize = 30;

/// Longest table of measurements, bytes: a hundred million rows of time and sample, more than `simulate` writes on any
/// grid that fits into memory. The available memory is checked before reading.
pub const LONGEST_TABLE: u64 = 1 << 32;

/// Memory that a file's text takes for each of its bytes: itself, and a copy in another encoding or with
/// other delimiters.
const BYTES_PER_BYTE: u64 = 2;

/// Memory of a JSON document per byte of its text: the text, and its values as a tree and as a struct. A list of short
/// numbers, the longest of the results, takes half of it.
pub const JSON: u64 = 64;

/// Longest line of a table, bytes, about a hundred times that of a table with hundreds of columns. It limits the memory
/// for the fields of one line.
pub const LONGEST_LINE: usize = 1 << 20;

/// Reads a text file of at most `limit` bytes; a byte order mark is dropped.
///
/// `what` describes the expected file in messages, for instance `a model file (YAML)`.
///
/// # Errors
///
/// If the file does not exist, it is a folder, it cannot be read, it is longer than `limit`, or it
/// is not UTF-8 text.
pub fn read_text(path: &Path, what: &str, limit: u64) -> Result<String, InputError> {
    let bytes = read_bytes(path, what, limit)?;
    utf8(path, bytes).map_err(|error| error.expected_if_none(what))
}

/// Reads a text file as [`read_text`] does, after a check of the available memory for `bytes_per_byte` bytes per byte of text.
///
/// # Errors
///
/// As there, and when it does not fit into memory.
pub fn read_text_within(
    path: &Path,
    what: &str,
    limit: u64,
    bytes_per_byte: u64,
) -> Result<String, InputError> {
    if let Ok(metadata) = fs::metadata(path)
        && metadata.len() <= limit
    {
        memory::check_file(path, metadata.len().saturating_mul(bytes_per_byte))?;
    }
    read_text(path, what, limit)
}

/// Reads a file of at most `limit` bytes; `what` describes it in messages.
///
/// # Errors
///
/// When the file does not exist, is a folder, a device or a pipe of another process, cannot be read, is longer than
/// `limit`, or does not fit into memory.
pub fn read_bytes(path: &Path, what: &str, limit: u64) -> Result<Vec<u8>, InputError> {
    let before = state(path);
    let (file, length) = open(path, what)?;
    // A file that is too long is not read at all; sparse files can be longer than the disk.
    if length > limit {
        return Err(too_long(path, limit)
            .found(binary_size(length))
            .expected(format!("{what} of at most {}", binary_size(limit))));
    }
    memory::check_file(path, length.saturating_mul(BYTES_PER_BYTE))?;
    // One allocation: a vector that grows is copied several times.
    let mut bytes = Vec::new();
    // A failed reservation is reported by the read.
    let _ = bytes.try_reserve_exact(usize::try_from(length).unwrap_or(0));
    let bytes =
        read_into(bytes, path, file, limit).map_err(|error| error.expected_if_none(what))?;
    match before.is_some() && state(path) != before {
        true => Err(changing(path)),
        false => Ok(bytes),
    }
}

/// Length and time of the last change of a file; `None` for one that has none, such as a pipe.
pub fn state(path: &Path) -> Option<(u64, Option<SystemTime>)> {
    let found = path.metadata().ok().filter(Metadata::is_file)?;
    Some((found.len(), found.modified().ok()))
}

/// The error of a file that changes while it is used.
pub fn changing(path: &Path) -> InputError {
    InputError::file(path, "this file changed while it was read")
        .expected("a file that is complete")
        .hint("wait until it is written or copied, then run the command again")
}

/// Opens a file and returns its length; `what` describes it in messages.
///
/// # Errors
///
/// When the file does not exist, is a folder, a device or a pipe of another process, or cannot be opened.
pub fn open(path: &Path, what: &str) -> Result<(File, u64), InputError> {
    let metadata = fs::metadata(path).map_err(|error| unreadable(path, what, &error))?;
    if let Some(other) = no_file(path, &metadata) {
        return Err(InputError::file(path, format!("this is {other}, not a file")).expected(what));
    }
    let file = File::open(path).map_err(|error| unreadable(path, what, &error))?;
    Ok((file, metadata.len()))
}

/// Description of a path that is not a regular file: a folder, a device, which may never end, or a pipe of another
/// process, which may never begin. `None` for a regular file and for the program's own pipes (`/dev/stdin`).
fn no_file(path: &Path, metadata: &Metadata) -> Option<&'static str> {
    let is_own = ["/dev", "/proc"].iter().any(|own| path.starts_with(own));
    match () {
        () if metadata.is_file() => None,
        () if metadata.is_dir() => Some("a folder"),
        () if !is_pipe(metadata) => Some("a device"),
        () => (!is_own).then_some("a pipe"),
    }
}

#[cfg(unix)]
fn is_pipe(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    metadata.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &Metadata) -> bool {
    false
}

/// Reads at most `limit` bytes from a reader; messages name `path`.
///
/// # Errors
///
/// When reading fails, or there is more than `limit`.
pub fn read_bytes_from(path: &Path, reader: impl Read, limit: u64) -> Result<Vec<u8>, InputError> {
    read_into(Vec::new(), path, reader, limit)
}

fn read_into(
    mut bytes: Vec<u8>,
    path: &Path,
    reader: impl Read,
    limit: u64,
) -> Result<Vec<u8>, InputError> {
    reader
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| InputError::file(path, format!("the file cannot be read: {error}")))?;
    if bytes.len() as u64 > limit {
        return Err(too_long(path, limit));
    }
    Ok(bytes)
}

fn too_long(path: &Path, limit: u64) -> InputError {
    InputError::file(path, "the file is too large")
        .expected(format!("at most {}", binary_size(limit)))
}

/// A size in the largest binary unit that it exceeds, rounded up.
pub(crate) fn binary_size(bytes: u64) -> String {
    let units = [(1u64 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    let found = units.into_iter().find(|(unit, _)| bytes >= *unit);
    let (unit, name) = found.unwrap_or((1 << 10, "KiB"));
    format!("{} {name}", bytes.div_ceil(unit))
}

/// Number of line ends.
pub fn line_ends(text: &[u8]) -> usize {
    memchr::memchr_iter(b'\n', text).count()
}

/// Refuses a table with a line longer than `LONGEST_LINE`.
///
/// # Errors
///
/// At the first such line.
pub fn check_lines(path: &Path, text: &str) -> Result<(), InputError> {
    let ends = memchr::memchr_iter(b'\n', text.as_bytes()).chain([text.len()]);
    let mut from = 0;
    for (index, end) in ends.enumerate() {
        if end - from > LONGEST_LINE {
            return Err(long_line(path, index + 1));
        }
        from = end + 1;
    }
    Ok(())
}

fn long_line(path: &Path, line: usize) -> InputError {
    let problem = format!("the line is longer than {LONGEST_LINE} bytes");
    InputError::line(path, line, 1, problem).expected("one row of a table in each line")
}

/// The lines of a table that is too long to be kept as text, one after the other.
pub struct Lines<'a> {
    path: &'a Path,
    reader: BufReader<File>,
    line: Vec<u8>,
    count: usize,
}

impl<'a> Lines<'a> {
    /// The lines of a file; messages name `path`.
    pub fn new(path: &'a Path, file: File) -> Self {
        Self {
            path,
            reader: BufReader::with_capacity(1 << 18, file),
            line: Vec::new(),
            count: 0,
        }
    }

    /// The next line without its end and, if it is the first, without a byte order mark; `None` at the
    /// end of the file.
    ///
    /// # Errors
    ///
    /// When the file cannot be read, or the line is longer than `LONGEST_LINE`, or not UTF-8.
    pub fn next(&mut self) -> Result<Option<&str>, InputError> {
        self.line.clear();
        let most = LONGEST_LINE as u64 + 2;
        let mut rest = (&mut self.reader).take(most);
        rest.read_until(b'\n', &mut self.line).map_err(|error| {
            InputError::file(self.path, format!("the file cannot be read: {error}"))
        })?;
        if self.line.is_empty() {
            return Ok(None);
        }
        self.count += 1;
        let ended = self.line.strip_suffix(b"\n");
        let line = ended.unwrap_or(&self.line);
        if line.len() > LONGEST_LINE {
            return Err(long_line(self.path, self.count));
        }
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        match std::str::from_utf8(line) {
            Ok(text) if self.count == 1 => Ok(Some(text.trim_start_matches('\u{feff}'))),
            Ok(text) => Ok(Some(text)),
            Err(error) => Err(not_utf8(self.path, self.count, line, error.valid_up_to())),
        }
    }
}

/// The error for a byte of a line that is not UTF-8.
fn not_utf8(path: &Path, number: usize, line: &[u8], at: usize) -> InputError {
    let column = 1 + String::from_utf8_lossy(&line[..at]).chars().count();
    InputError::line(path, number, column, "the file is not UTF-8 text")
        .found(format!("the byte 0x{:02x}", line[at]))
}

/// A quotation for a message: one line, shortened if long.
pub fn quote(text: &str) -> String {
    let mut quoted = String::from("`");
    for (count, c) in text.chars().enumerate() {
        if count == LONGEST_QUOTE {
            quoted.push('…');
            break;
        }
        match c {
            c if c.is_control() => quoted.extend(c.escape_default()),
            c => quoted.push(c),
        }
    }
    quoted.push('`');
    quoted
}

/// Names separated by commas, `a, b, c`; the first ones if there are many.
pub fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    match names.len().checked_sub(MOST_NAMES) {
        None | Some(0) => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..MOST_NAMES].join(", ")),
    }
}

/// Accepted names for a message: `one of: a, b, c`.
pub fn one_of<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter().peekable();
    match (names.next(), names.peek()) {
        (Some(only), None) => format!("`{only}`"),
        (first, _) => format!("one of: {}", listed(first.into_iter().chain(names))),
    }
}

/// The error for a file that could not be opened.
fn unreadable(path: &Path, what: &str, error: &std::io::Error) -> InputError {
    if error.kind() != ErrorKind::NotFound {
        return InputError::file(path, format!("the file cannot be read: {error}")).expected(what);
    }
    InputError::file(path, "no such file")
        .expected(what)
        .hint_if(foreign_path(path).or_else(|| similar_name(path)))
}

/// Remedy for a path that another program or system wrote: in quotes, or with backslashes.
fn foreign_path(path: &Path) -> Option<String> {
    let text = path.to_str()?;
    let is_quote = |c: char| matches!(c, '"' | '\'' | '\u{201c}' | '\u{201d}');
    if text.starts_with(is_quote) && text.ends_with(is_quote) {
        return Some("the quotes are part of the name: leave them out".to_owned());
    }
    (cfg!(unix) && text.contains('\\'))
        .then(|| "a path of Windows: on this system folders are separated by `/`".to_owned())
}

/// Remedy for a missing file: a missing folder, or a similar file name.
fn similar_name(path: &Path) -> Option<String> {
    let folder = match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => return None,
    };
    if !folder.is_dir() {
        return Some(format!("the folder {} does not exist", folder.display()));
    }
    let mut names: Vec<String> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    names.sort();
    let wanted = path.file_name().and_then(OsStr::to_str)?;
    did_you_mean(wanted, names.iter().map(String::as_str))
}

/// The bytes as text, without a byte order mark.
fn utf8(path: &Path, bytes: Vec<u8>) -> Result<String, InputError> {
    let utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    match String::from_utf8(bytes) {
        Ok(text) => Ok(match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => text,
        }),
        Err(error) => {
            let good = error.utf8_error().valid_up_to();
            let before = String::from_utf8_lossy(&error.as_bytes()[..good]).into_owned();
            let byte = error.as_bytes().get(good).copied().unwrap_or_default();
            Err(
                InputError::after(path, &before, "the file is not UTF-8 text")
                    .found(format!("the byte 0x{byte:02x}"))
                    .hint(if utf16 {
                        "it looks like UTF-16: save it as UTF-8"
                    } else {
                        "save it as UTF-8, or write only plain letters there"
                    }),
            )
        }
    }
}

impl InputError {
    /// Sets the accepted values unless set before.
    fn expected_if_none(mut self, expected: &str) -> Self {
        self.expected.get_or_insert_with(|| expected.to_owned());
        self
    }
}
