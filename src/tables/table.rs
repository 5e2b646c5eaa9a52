//! A table of numeric columns, parsed from a text file or made from the channels of a binary one.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::detect::{Layout, detect, without_footer};
use super::encoding::decode;
use super::format::{Detected, TableFormat};
use super::origin::{ColumnValues, Origin};
use super::rows::{CsvText, with_newlines};
use super::table_memory::TableMemory;
use crate::clock::DAY;
use crate::error::{InputError, Location};
use crate::formats;
use crate::text_io::{LONGEST_TABLE, check_lines, read_bytes, read_bytes_from};
use crate::units::{Measurand, Unit};
use kmcfit_core::number_format::significant;

/// Span of dates above which day and month may be exchanged, s.
const WEEKS: f64 = 20.0 * DAY;

/// Description of a table, for messages.
pub(crate) const TABLE: &str = "a CSV file with one row of column names and rows of numbers";

/// A table: columns of equal length.
///
/// The plain form is comma-separated, one row of column names first. Other forms are detected, or given by a
/// [`TableFormat`]: other delimiters, decimal commas, lines of text before the names, a row of units after them, no
/// names, encodings other than UTF-8.
///
/// Lines that begin with `#`, blank lines, spaces around a field and a byte order mark are ignored; the line ends of
/// any system are accepted. A column that is not used may hold text.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(super) path: PathBuf,
    pub(super) origin: Origin,
    pub(super) headers: Vec<String>,
    pub(super) units: Vec<String>,
    pub(super) columns: Vec<ColumnValues>,
    pub(super) lines: Vec<usize>,
    /// Treatment of the file, a clause each.
    pub(super) notes: Vec<String>,
    /// Number of columns of the file before the first one.
    pub(super) first: usize,
    /// Sampling interval that the file states beside the samples, s.
    pub(super) stated_step: Option<f64>,
}

impl Table {
    /// Reads a table from a text file or a binary file of a data logger; its format is detected.
    ///
    /// # Errors
    ///
    /// When there is no such file, or [`parse`](Self::parse) fails.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_with_overrides(path, &TableFormat::default())
    }

    /// Reads a table from a file; `format` states the format of text.
    ///
    /// # Errors
    ///
    /// When there is no such file, or [`parse_with`](Self::parse_with) fails.
    pub fn read_with_overrides(
        path: impl AsRef<Path>,
        format: &TableFormat,
    ) -> Result<Self, InputError> {
        Self::only(Self::read_all(path, format)?)
    }

    /// Reads all tables of a file: one of a text file; of a binary file one for each set of channels with the same times.
    ///
    /// # Errors
    ///
    /// As [`read_with_overrides`](Self::read_with_overrides), apart from the choice of a set.
    pub fn read_all(path: impl AsRef<Path>, format: &TableFormat) -> Result<Vec<Self>, InputError> {
        let path = path.as_ref();
        Self::from_bytes(path, read_bytes(path, TABLE, LONGEST_TABLE)?, format)
    }

    /// Parses all tables of the content of a file; messages name `path`.
    ///
    /// # Errors
    ///
    /// As [`read_all`](Self::read_all), apart from the file system.
    pub fn parse_all(
        path: impl AsRef<Path>,
        reader: impl Read,
        format: &TableFormat,
    ) -> Result<Vec<Self>, InputError> {
        let path = path.as_ref();
        let bytes = read_bytes_from(path, reader, LONGEST_TABLE)?;
        Self::from_bytes(path, bytes, format)
    }

    /// Parses a table; messages name `path`.
    ///
    /// ```
    /// use kmcfit::tables::Table;
    /// let table = Table::parse("free.csv", "t_s,y_m,note\n0.0,3.3,start\n0.1,3.2,\n".as_bytes())?;
    /// assert_eq!(table.column("y_m")?, [3.3, 3.2]);
    /// assert!(table.column("note").is_err());
    /// # Ok::<(), kmcfit::error::InputError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// For a text: when it has no rows, rows of different length, or two columns with the same name. For a binary file: when it
    /// is damaged, is of a format that is not read, or has several sets of channels with different times.
    pub fn parse(path: impl AsRef<Path>, reader: impl Read) -> Result<Self, InputError> {
        Self::parse_with(path, reader, &TableFormat::default())
    }

    /// Parses a table of a given format; messages name `path`.
    ///
    /// # Errors
    ///
    /// As [`parse`](Self::parse), and when the format has an invalid delimiter or decimal sign.
    pub fn parse_with(
        path: impl AsRef<Path>,
        reader: impl Read,
        format: &TableFormat,
    ) -> Result<Self, InputError> {
        Self::only(Self::parse_all(path, reader, format)?)
    }

    /// The path, as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The detected format of a text; `None` for a binary file.
    pub fn text_format(&self) -> Option<&Detected> {
        match &self.origin {
            Origin::Text(format) => Some(format),
            Origin::Channels(_) => None,
        }
    }

    /// The format of the file, in words.
    pub fn format_in_words(&self) -> String {
        match &self.origin {
            Origin::Text(format) => format.to_string(),
            Origin::Channels(origin) => origin.format().to_string(),
        }
    }

    /// Names of the columns, in order; empty where the file has none.
    pub fn headers(&self) -> &[String] {
        &self.headers
    }

    /// The texts of the row of units, in order; empty where the file has none.
    pub fn units_row(&self) -> &[String] {
        &self.units
    }

    /// Treatment of the file, a clause each: cut channels, units of clocks, lines that are left out.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Scales of a column that the file states and that are not applied.
    pub fn unapplied(&self, index: usize) -> &[String] {
        self.columns
            .get(index)
            .map_or(&[], |column| &column.unapplied)
    }

    /// Sampling rate that a text states beside the samples, Hz.
    pub fn stated_rate(&self) -> Option<f64> {
        let step = self.stated_step.filter(|_| self.text_format().is_some())?;
        let rate = 1.0 / step;
        // Its printed digits, without the rounding of the division.
        Some(significant(rate, 12).parse().unwrap_or(rate))
    }

    /// Time by which the samples of a column are later than the times of the table, s.
    pub fn late(&self, index: usize) -> f64 {
        self.columns.get(index).map_or(0.0, |column| column.late)
    }

    /// Line in the file of each data row, from 1; of a binary file the number of the sample.
    pub fn lines(&self) -> &[usize] {
        &self.lines
    }

    /// Number of data rows; at least one.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.columns.len()
    }

    /// The values of a column, as [`find`](Self::find) finds it by its name.
    ///
    /// # Errors
    ///
    /// When there is no such column, or one of its fields is not a finite number.
    pub fn column(&self, name: &str) -> Result<&[f64], InputError> {
        self.values(self.find(&name.into())?)
    }

    /// The values of a column, by its index from 0: a finite number in every row.
    ///
    /// # Errors
    ///
    /// When one of its fields is not a finite number, or there is no such column.
    pub fn values(&self, index: usize) -> Result<&[f64], InputError> {
        let column = self.at(index)?;
        match &column.unnumbered {
            None => Ok(&column.samples),
            Some(error) => Err(error.clone()),
        }
    }

    /// The samples of a column, by its index from 0; NaN for a missing sample: a field that is empty, `NaN`, `NA`,
    /// `N/A`, `#N/A`, `null`, `-` or `--`.
    ///
    /// ```
    /// use kmcfit::tables::Table;
    /// let table = Table::parse("gaps.csv", "t,y\n0,3.3\n1,\n2,3.1\n".as_bytes())?;
    /// let samples = table.samples(1)?;
    /// assert_eq!((samples[0], samples[2]), (3.3, 3.1));
    /// assert!(samples[1].is_nan());
    /// # Ok::<(), kmcfit::error::InputError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// When one of its fields is neither a finite number nor missing, or there is no such column.
    pub fn samples(&self, index: usize) -> Result<&[f64], InputError> {
        let column = self.at(index)?;
        match &column.unreadable {
            None => Ok(&column.samples),
            Some(error) => Err(error.clone()),
        }
    }

    /// Location of a data row, counted from 0, for errors.
    pub fn location(&self, row: usize, column: Option<&str>) -> Location {
        let (file, column) = (self.path.clone(), column.map(str::to_owned));
        let line = self.lines.get(row).copied().unwrap_or_default();
        match self.origin {
            Origin::Text(_) => Location::Row { file, line, column },
            Origin::Channels(_) => Location::Sample {
                file,
                sample: line,
                channel: column,
            },
        }
    }

    /// A data row, counted from 0, in words: `line 12`, or `sample 12` of a binary file.
    pub fn row_in_words(&self, row: usize) -> String {
        let line = self.lines.get(row).copied().unwrap_or_default();
        match self.origin {
            Origin::Text(_) => format!("line {line}"),
            Origin::Channels(_) => format!("sample {line}"),
        }
    }

    fn at(&self, index: usize) -> Result<&ColumnValues, InputError> {
        match self.columns.get(index) {
            Some(column) => Ok(column),
            None => Err(self.no_such_number(index.saturating_add(1))),
        }
    }

    pub(crate) fn from_bytes(
        path: &Path,
        bytes: Vec<u8>,
        format: &TableFormat,
    ) -> Result<Vec<Self>, InputError> {
        format.check()?;
        let mut found = formats::recognise(path, &bytes)?;
        let mut bytes = bytes;
        if let Some(unpacked) = formats::unpacked(path, &bytes, found)? {
            found = formats::recognise(path, &unpacked)?;
            bytes = unpacked;
        }
        match found {
            Some(binary) if !(binary.is_text() && format.first_given().is_some()) => {
                Self::from_binary(path, bytes, binary, format)
            }
            _ => Ok(Self::from_text(path, bytes, format)?.runs()),
        }
    }

    fn from_text(path: &Path, bytes: Vec<u8>, format: &TableFormat) -> Result<Self, InputError> {
        let (text, encoding) = decode(path, bytes)?;
        if is_model(&text) {
            return Err(InputError::file(path, "a model file in place of data")
                .expected(TABLE)
                .hint("name the record; `kmcfit fit` and `kmcfit check` read models"));
        }
        let text = with_newlines(text);
        check_lines(path, &text)?;
        let layout = detect(path, &text, format);
        let skipped = format.skip.unwrap_or(0);
        let detected = Detected {
            encoding,
            delimiter: layout.delimiter,
            decimal: layout.decimal,
            skipped,
            header: None,
            units_row: None,
        };
        let room = TableMemory::of(path, &text);
        let width = layout.width.unwrap_or(1);
        room.check(width)?;
        let (rows, footer) = without_footer(&text, &layout);
        let source = CsvText::new(rows, skipped, layout.delimiter);
        let fill = |day_first| {
            let (layout, mut detected) = (
                Layout {
                    day_first,
                    ..layout
                },
                detected,
            );
            let mut table = Self::empty(path, Origin::Text(detected));
            table.lines = room.list(width)?;
            let repeated = table.fill(&source, &layout, room, &mut detected)?;
            table.origin = Origin::Text(detected);
            Ok::<_, InputError>((table, repeated))
        };
        let (mut table, mut repeated) = fill(false)?;
        // In the other order of day and month the next day is weeks away, or before.
        let span = table.span_of_dates();
        if span > WEEKS
            && let Ok(other) = fill(true)
            && other.0.span_of_dates() < span
        {
            (table, repeated) = other;
        }
        for (count, what) in [
            (footer, "of text after the rows"),
            (repeated, "that repeat the column names"),
        ] {
            if count > 0 {
                table.notes.push(format!("lines {what}, left out: {count}"));
            }
        }
        if table.headers.is_empty() && format.header.is_none() {
            table.name_by_comments(&text, layout.delimiter);
        }
        // A row of units without names begins with that of the times.
        let is_time = |name: &String| Unit::recognise(Measurand::Time, name).is_some();
        let mut others = table.headers.iter().skip(1);
        if table.units.is_empty()
            && table.headers.first().is_some_and(is_time)
            && others.len() > 0
            && others.all(|name| Unit::any(name).is_some())
        {
            table.units.clone_from(&table.headers);
        }
        table.state_by_preamble(&text, layout.delimiter);
        table.check_ranges();
        table.state_clocks();
        Ok(table)
    }

    /// A table without columns.
    pub(super) fn empty(path: &Path, origin: Origin) -> Self {
        Self {
            path: path.to_path_buf(),
            origin,
            headers: Vec::new(),
            units: Vec::new(),
            columns: Vec::new(),
            lines: Vec::new(),
            notes: Vec::new(),
            first: 0,
            stated_step: None,
        }
    }
}

/// True for the text of a model file: a line that begins with each of its first keys.
fn is_model(text: &str) -> bool {
    let has = |key: &str| text.lines().any(|line| line.starts_with(key));
    has("format:") && has("experiments:") && has("functions:")
}
