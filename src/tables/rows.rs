//! Iteration over the rows of a text with their line numbers, without comments and blank lines.

use std::borrow::Cow;
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::InputError;
use crate::text_io::line_ends;

/// Shortest text that is read in halves, bytes: it takes a millisecond.
const LONG: usize = 1 << 18;

/// A text prepared for the csv crate: runs of blanks replaced by tabs, leading lines removed.
pub struct CsvText<'a> {
    text: Cow<'a, str>,
    delimiter: u8,
    first_line: usize,
}

impl<'a> CsvText<'a> {
    /// The text after `skip` lines; a blank as delimiter denotes runs of blanks and tabs.
    pub fn new(text: &'a str, skip: usize, delimiter: char) -> Self {
        let rest = after_lines(text, skip);
        let (text, delimiter) = match delimiter {
            ' ' => (Cow::Owned(runs_to_tabs(rest)), '\t'),
            _ => (Cow::Borrowed(rest), delimiter),
        };
        Self {
            text,
            delimiter: u8::try_from(delimiter).unwrap_or(b','),
            first_line: skip + 1,
        }
    }

    /// Its rows; messages name `path`.
    pub fn rows(&'a self, path: &'a Path) -> TableRows<'a> {
        let reader = || {
            ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .delimiter(self.delimiter)
                .comment(Some(b'#'))
                .trim(Trim::All)
                .from_reader(self.text.as_bytes())
        };
        TableRows {
            path,
            text: &self.text,
            delimiter: self.delimiter,
            quoted: (!is_plain(&self.text)).then(reader),
            counted: 0,
            line: self.first_line,
        }
    }
}

/// [`str::trim`], faster for the usual field without blanks.
fn trimmed(field: &str) -> &str {
    match field.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => field,
        _ => field.trim(),
    }
}

/// True for a text whose lines are its rows: without quotes, and with line ends `\n` or `\r\n` only.
fn is_plain(text: &str) -> bool {
    let bytes = text.as_bytes();
    let mut returns = memchr::memchr_iter(b'\r', bytes);
    memchr::memchr(b'"', bytes).is_none() && returns.all(|at| bytes.get(at + 1) == Some(&b'\n'))
}

/// Replaces line ends `\r` by `\n`: for the csv crate a comment ends at `\n` only.
pub fn with_newlines(text: String) -> String {
    let has = |byte| memchr::memchr(byte, text.as_bytes()).is_some();
    match has(b'\r') && !has(b'\n') {
        true => text.replace('\r', "\n"),
        false => text,
    }
}

/// The text after the first `lines` lines.
fn after_lines(text: &str, lines: usize) -> &str {
    let Some(last) = lines.checked_sub(1) else {
        return text;
    };
    match text.match_indices('\n').nth(last) {
        Some((at, _)) => &text[at + 1..],
        None => "",
    }
}

/// Replaces each run of blanks and tabs outside quotes by one tab, and removes those at the ends of lines.
fn runs_to_tabs(text: &str) -> String {
    let mut tabbed = String::with_capacity(text.len());
    let (mut quoted, mut run, mut begun) = (false, false, false);
    for c in text.chars() {
        match c {
            ' ' | '\t' if !quoted => run = true,
            '\n' | '\r' => {
                (quoted, run, begun) = (false, false, false);
                tabbed.push(c);
            }
            c => {
                if run && begun {
                    tabbed.push('\t');
                }
                quoted ^= c == '"';
                (run, begun) = (false, true);
                tabbed.push(c);
            }
        }
    }
    tabbed
}

/// Rows of a table.
pub struct TableRows<'a> {
    path: &'a Path,
    text: &'a str,
    /// ASCII.
    delimiter: u8,
    /// Reads a text with quotes or other line ends.
    quoted: Option<csv::Reader<&'a [u8]>>,
    /// Bytes whose lines are counted, and the line of the next one.
    counted: usize,
    line: usize,
}

impl<'a> TableRows<'a> {
    /// Splits off the later half of the rows that are not read yet; `None` for a short text or one with quotes.
    pub fn split_off(&mut self) -> Option<TableRows<'a>> {
        let rest = &self.text.as_bytes()[self.counted.min(self.text.len())..];
        (self.quoted.is_none() && rest.len() >= LONG).then_some(())?;
        let middle = rest.len() / 2;
        let half = middle + memchr::memchr(b'\n', &rest[middle..])? + 1;
        let lines = line_ends(&rest[..half]);
        let whole = self.text;
        self.text = &whole[..self.counted + half];
        Some(TableRows {
            path: self.path,
            text: whole,
            delimiter: self.delimiter,
            quoted: None,
            counted: self.text.len(),
            line: self.line + lines,
        })
    }

    /// Reads the next row into `record` and returns its line number; `None` at the end.
    pub fn read(&mut self, record: &mut StringRecord) -> Result<Option<usize>, InputError> {
        loop {
            let Some(line) = self.next_line(record)? else {
                return Ok(None);
            };
            let first = record.get(0).unwrap_or_default();
            let blank = record.len() == 1 && first.is_empty();
            if !blank && !first.starts_with('#') {
                return Ok(Some(line));
            }
        }
    }

    /// The next row, blank rows and comments after blanks included.
    fn next_line(&mut self, record: &mut StringRecord) -> Result<Option<usize>, InputError> {
        if let Some(records) = &mut self.quoted {
            let more = records.read_record(record).map_err(|error| {
                InputError::file(self.path, format!("the file cannot be read: {error}"))
            })?;
            let byte = record.position().map_or(0, csv::Position::byte);
            let byte = usize::try_from(byte).unwrap_or(usize::MAX);
            return Ok(more.then(|| self.line_from(byte)));
        }
        while let Some(rest) = self
            .text
            .get(self.counted..)
            .filter(|rest| !rest.is_empty())
        {
            let end = memchr::memchr(b'\n', rest.as_bytes()).unwrap_or(rest.len());
            let (text, line) = (rest[..end].trim_end_matches('\r'), self.line);
            self.counted += end + 1;
            self.line += 1;
            if !text.is_empty() && !text.starts_with('#') {
                record.clear();
                let mut from = 0;
                for to in memchr::memchr_iter(self.delimiter, text.as_bytes()) {
                    record.push_field(trimmed(&text[from..to]));
                    from = to + 1;
                }
                record.push_field(trimmed(&text[from..]));
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    /// The line of the first field at or after a byte: the csv crate's position of a record is
    /// before the blank lines and comments that it skips.
    fn line_from(&mut self, byte: usize) -> usize {
        let bytes = self.text.as_bytes();
        let mut comment = false;
        while let Some(&here) = bytes.get(self.counted) {
            let at_line_end = matches!(here, b'\n' | b'\r');
            if self.counted >= byte && !at_line_end && !comment {
                if here != b'#' {
                    break;
                }
                comment = true;
            }
            comment &= !at_line_end;
            let windows = here == b'\r' && bytes.get(self.counted + 1) == Some(&b'\n');
            self.line += usize::from(at_line_end && !windows);
            self.counted += 1;
        }
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_blanks_are_one_tab() {
        assert_eq!(
            runs_to_tabs("  t \t y  \r\n\" a b\"   1\n"),
            "t\ty\r\n\" a b\"\t1\n"
        );
    }

    /// Rows and lines of a text are those of the csv crate, which reads it where a field has quotes.
    #[test]
    fn plain_texts_have_the_rows_of_the_csv_crate() {
        let rows = |text: &str| {
            let source = CsvText::new(text, 1, ';');
            let (mut rows, mut record) = (source.rows(Path::new("t")), StringRecord::new());
            let mut found = Vec::new();
            while let Some(line) = rows.read(&mut record).unwrap() {
                found.push((line, record.iter().map(str::to_owned).collect::<Vec<_>>()));
            }
            found
        };
        let plain = "head\n# a; b\n\n t;  y\r\n1; 2 \n \n  # c;d\n;\n3;4;\u{a0}5";
        assert!(is_plain(plain));
        let quoted = plain.replace("4", "\"4\"");
        let alone = plain.replace("\r\n", "\r");
        assert!(!is_plain(&quoted) && !is_plain(&alone));
        assert_eq!(rows(plain), rows(&quoted));
        assert_eq!(rows(plain), rows(&alone));
        let lines: Vec<usize> = rows(plain).iter().map(|row| row.0).collect();
        assert_eq!(lines, [4, 5, 8, 9]);
    }

    #[test]
    fn halves_have_the_rows_and_lines_of_the_whole() {
        let mut text = String::from("t,y\r\n# none\n\n");
        for i in 0..40_000 {
            text += &format!("{i},{}{}", 2 * i, ["\n", "\r\n", "\n\n"][i % 3]);
        }
        let read = |rows: &mut TableRows| {
            let (mut record, mut found) = (StringRecord::new(), Vec::new());
            while let Some(line) = rows.read(&mut record).unwrap() {
                found.push((line, record.iter().map(str::to_owned).collect::<Vec<_>>()));
            }
            found
        };
        let source = CsvText::new(&text, 0, ',');
        let whole = read(&mut source.rows(Path::new("t")));
        assert_eq!(whole.len(), 40_001);
        let (mut first, mut record) = (source.rows(Path::new("t")), StringRecord::new());
        first.read(&mut record).unwrap();
        let mut second = first.split_off().expect("a long text");
        let (first, second) = (read(&mut first), read(&mut second));
        assert!(first.len().abs_diff(second.len()) < 2000);
        assert_eq!([first, second].concat(), whole[1..]);
        // Short texts and those with quotes are read as a whole.
        let short = CsvText::new(&text[..1000], 0, ',');
        assert!(short.rows(Path::new("t")).split_off().is_none());
        let quoted = text.replacen("39999", "\"39999\"", 1);
        let quoted = CsvText::new(&quoted, 0, ',');
        assert!(quoted.rows(Path::new("t")).split_off().is_none());
    }

    #[test]
    fn lines_are_skipped() {
        assert_eq!(after_lines("a\nb\nc", 0), "a\nb\nc");
        assert_eq!(after_lines("a\nb\nc", 2), "c");
        assert_eq!(after_lines("a\nb\nc", 3), "");
    }
}
