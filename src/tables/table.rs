//! A table of numeric columns, parsed from a text file or made from the channels of a binary one.

use std::io::Read;
use std::path::{Path, PathBuf};

use csv::StringRecord;

use super::clock::Clock;
use super::detect::{Layout, detect, without_footer};
use super::encoding::decode;
use super::field::{self, Field};
use super::format::{Detected, TableFormat};
use super::origin::{ColumnValues, Origin};
use super::rows::{CsvText, TableRows, with_newlines};
use super::table_memory::TableMemory;
use crate::error::{InputError, Location};
use crate::formats;
use crate::text_io::{LONGEST_TABLE, check_lines, listed, quote, read_bytes, read_bytes_from};
use kmcfit_core::internals::threads::both;

/// Most columns: each takes some hundred bytes beside its fields.
const MOST_COLUMNS: usize = 10_000;

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
    pub fn place(&self, row: usize, column: Option<&str>) -> Location {
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
        match formats::recognise(path, &bytes)? {
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
        let mut detected = Detected {
            encoding,
            delimiter: layout.delimiter,
            decimal: layout.decimal,
            skipped,
            header: None,
            units_row: None,
        };
        let mut table = Self {
            path: path.to_path_buf(),
            origin: Origin::Text(detected),
            headers: Vec::new(),
            units: Vec::new(),
            columns: Vec::new(),
            lines: Vec::new(),
            notes: Vec::new(),
            first: 0,
        };
        let room = TableMemory::of(path, &text);
        let width = layout.width.unwrap_or(1);
        room.check(width)?;
        table.lines = room.list(width)?;
        let (rows, footer) = without_footer(&text, &layout);
        let source = CsvText::new(rows, skipped, layout.delimiter);
        let repeated = table.fill(&source, &layout, room, &mut detected)?;
        table.origin = Origin::Text(detected);
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
        table.state_clocks();
        Ok(table)
    }

    fn fill(
        &mut self,
        source: &CsvText,
        layout: &Layout,
        room: TableMemory,
        format: &mut Detected,
    ) -> Result<usize, InputError> {
        let mut repeated = 0;
        let path = self.path.clone();
        let mut rows = source.rows(&path);
        let mut fields = StringRecord::new();
        let mut count = 0;
        while let Some(line) = rows.read(&mut fields)? {
            let row = Some(count);
            check_width(&path, line, fields.len())?;
            if row == layout.header {
                check_headers(&path, line, &fields, layout.decimal)?;
                self.headers = fields.iter().map(str::to_owned).collect();
                self.columns = columns(fields.len(), room)?;
                format.header = Some(line);
            } else if row == layout.units {
                self.units = fields.iter().map(str::to_owned).collect();
                format.units_row = Some(line);
            } else if count >= layout.data {
                repeated += usize::from(!self.push(line, &fields, layout, room)?);
                // The first row of data defines the columns.
                if let Some(later) = rows.split_off() {
                    repeated += self.push_halves(rows, later, layout, room)?;
                    break;
                }
            }
            count += 1;
        }
        let first = self.lines.first().copied();
        match (format.header.or(first), first) {
            (None, _) => Err(empty(&path, format.skipped)),
            (_, None) => Err(InputError::file(&path, "the file has no data")
                .found("a row of column names only")
                .expected(TABLE)),
            (Some(head), _) => {
                format.skipped = head - 1;
                Ok(repeated)
            }
        }
    }

    /// Adds the rows of data of both halves of a text, which are read at the same time.
    fn push_halves(
        &mut self,
        first: TableRows,
        second: TableRows,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<usize, InputError> {
        let begun = |own: &ColumnValues| ColumnValues {
            clock: own.clock,
            ..ColumnValues::default()
        };
        let mut later = Self {
            path: self.path.clone(),
            origin: self.origin.clone(),
            headers: self.headers.clone(),
            units: self.units.clone(),
            columns: self.columns.iter().map(begun).collect(),
            lines: Vec::new(),
            notes: Vec::new(),
            first: 0,
        };
        let (first, second) = both(
            || self.push_all(first, layout, room),
            || Ok((later.push_all(second, layout, room)?, later)),
        );
        // The first mistake in the file is reported.
        let first = first?;
        let (second, later): (usize, Self) = second?;
        self.lines.extend(later.lines);
        for (column, later) in self.columns.iter_mut().zip(later.columns) {
            // An unreadable column has no samples after its first mistake.
            if column.unreadable.is_none() {
                column.samples.extend(later.samples);
                column.unreadable = later.unreadable;
                column.unnumbered = column.unnumbered.take().or(later.unnumbered);
            }
        }
        Ok(first + second)
    }

    /// Adds all rows as data, and counts those that repeat the column names.
    fn push_all(
        &mut self,
        mut rows: TableRows,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<usize, InputError> {
        let mut fields = StringRecord::new();
        let mut repeated = 0;
        while let Some(line) = rows.read(&mut fields)? {
            check_width(&self.path, line, fields.len())?;
            repeated += usize::from(!self.push(line, &fields, layout, room)?);
        }
        Ok(repeated)
    }

    /// Adds a data row, unless it is that of the column names. A field that is not a number makes its column unusable.
    fn push(
        &mut self,
        line: usize,
        fields: &StringRecord,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<bool, InputError> {
        if fields.get(0) == self.headers.first().map(String::as_str)
            && fields == self.headers.as_slice()
        {
            return Ok(false);
        }
        let row = self.lines.len();
        self.lines.push(line);
        if self.columns.is_empty() {
            let width = layout.width.unwrap_or(fields.len());
            self.columns = columns(width, room)?;
        }
        // Some loggers end every row of data, but not the row of names, with a delimiter.
        let width = self.columns.len();
        let ended = layout.width == Some(width + 1) && fields.get(width) == Some("");
        if fields.len() != width + usize::from(ended) {
            let place = self.place(row, None);
            let named = !self.headers.is_empty();
            return Err(ragged(place, fields, width, named));
        }
        for (index, text) in fields.iter().take(width).enumerate() {
            let column = &self.columns[index];
            if column.unreadable.is_some() {
                continue;
            }
            let read = field::read(text, layout.decimal);
            if let Field::Number(value) = read {
                self.columns[index].samples.push(value);
                continue;
            }
            let is_clock = || column.clock.is_some() || column.samples.iter().all(|x| x.is_nan());
            let clock = (read == Field::Text).then(|| Clock::read(text)).flatten();
            if let Some(clock) = clock.filter(|_| is_clock()) {
                let column = &mut self.columns[index];
                let first = column.clock.get_or_insert(clock);
                column.samples.push(clock.since(first));
                continue;
            }
            let place = || self.place(row, Some(&self.label(index)));
            let unnumbered = column
                .unnumbered
                .is_none()
                .then(|| field::not_a_number(place(), text, layout.decimal));
            let unreadable = (read != Field::Missing)
                .then(|| field::not_a_sample(place(), text, layout.decimal));
            let column = &mut self.columns[index];
            column.samples.push(f64::NAN);
            column.unnumbered = column.unnumbered.take().or(unnumbered);
            column.unreadable = unreadable;
        }
        Ok(true)
    }
}

/// Allocates the columns with capacity for all rows.
fn columns(width: usize, room: TableMemory) -> Result<Vec<ColumnValues>, InputError> {
    let column = |_| {
        Ok(ColumnValues {
            samples: room.list(width)?,
            ..ColumnValues::default()
        })
    };
    (0..width).map(column).collect()
}

/// The error for a file without rows after the skipped lines.
fn empty(path: &Path, skipped: usize) -> InputError {
    let error = InputError::file(path, "the file is empty").expected(TABLE);
    match skipped {
        0 => error,
        lines => error.found(format!("nothing after {lines} skipped lines")),
    }
}

/// Refuses a row with more than [`MOST_COLUMNS`] fields.
fn check_width(path: &Path, line: usize, fields: usize) -> Result<(), InputError> {
    if fields <= MOST_COLUMNS {
        return Ok(());
    }
    Err(
        InputError::line(path, line, 1, "the table has too many columns")
            .found(format!("{fields} fields"))
            .expected(format!("at most {MOST_COLUMNS}")),
    )
}

/// Refuses repeated column names, and a row of names that are all numbers.
fn check_headers(
    path: &Path,
    line: usize,
    headers: &StringRecord,
    decimal: char,
) -> Result<(), InputError> {
    let error = |problem: String| InputError::line(path, line, 1, problem);
    let is_number = |name| matches!(field::read(name, decimal), Field::Number(_));
    if headers.iter().all(is_number) {
        return Err(error("the column names are missing".to_owned())
            .found(format!("the numbers {}", quote(&listed(headers))))
            .expected("one row of column names before the data")
            .hint("a line that begins with `#` is a comment: remove the `#` before the names"));
    }
    for (index, name) in headers.iter().enumerate() {
        let before = headers.iter().take(index).position(|other| other == name);
        if let (Some(first), false) = (before, name.is_empty()) {
            return Err(error(format!("two columns have the name {}", quote(name)))
                .found(format!("columns {} and {}", first + 1, index + 1))
                .expected("every column name once"));
        }
    }
    Ok(())
}

/// The error for a row with more or fewer fields than there are columns.
fn ragged(place: Location, fields: &StringRecord, expected: usize, named: bool) -> InputError {
    let plural = |n: usize| match n {
        1 => "1 field".to_owned(),
        n => format!("{n} fields"),
    };
    let problem = match named {
        true => "the row does not fit the column names",
        false => "the row does not fit the other rows",
    };
    let error = InputError::new(place, problem)
        .found(plural(fields.len()))
        .expected(format!("{}, one per column", plural(expected)));
    if fields.iter().any(|field| field.contains('\n')) {
        return error.hint("a quote that is opened in this row is not closed in it");
    }
    if fields.len() == 2 * expected {
        return error.hint("write numbers with a decimal point, not a comma");
    }
    error
}

/// True for the text of a model file: a line that begins with each of its first keys.
fn is_model(text: &str) -> bool {
    let has = |key: &str| text.lines().any(|line| line.starts_with(key));
    has("format:") && has("experiments:") && has("functions:")
}
