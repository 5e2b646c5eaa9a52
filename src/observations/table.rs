//! A CSV file: one row of column names, then rows of numbers.

use std::io::Read;
use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::{InputError, Place};
use crate::input::{listed, one_of, quote, read_text, read_text_from};
use crate::near::did_you_mean;

/// Longest table that is read, in bytes: some ten million rows, which fit into memory.
const LONGEST_TABLE: u64 = 1 << 30;

/// What a table should be, in messages.
const TABLE: &str = "a CSV file with one row of column names and rows of numbers";

/// A CSV file of named columns of equal length.
///
/// Comma-separated, one row of column names first. Lines that begin with `#` and blank lines do not
/// count; spaces around a field, a byte order mark and Windows line ends do no harm. A column that
/// is never asked for may hold text.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    path: PathBuf,
    headers: Vec<String>,
    columns: Vec<Result<Vec<f64>, InputError>>,
    lines: Vec<usize>,
}

impl Table {
    /// Reads a table from a file.
    ///
    /// # Errors
    ///
    /// When there is no such file, it is not text, or [`parse`](Self::parse) finds a mistake.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::from_text(path, &read_text(path, TABLE, LONGEST_TABLE)?)
    }

    /// Reads a table from a reader; `path` is what messages call it.
    ///
    /// ```
    /// use kmcfit::observations::Table;
    /// let table = Table::parse("free.csv", "t_s,y_m,note\n0.0,3.3,start\n0.1,3.2,\n".as_bytes())?;
    /// assert_eq!(table.column("y_m")?, [3.3, 3.2]);
    /// assert!(table.column("note").is_err());
    /// # Ok::<(), kmcfit::error::InputError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// When it is not UTF-8 text, has no rows, rows of different length, or two columns of one name.
    pub fn parse(path: impl AsRef<Path>, reader: impl Read) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::from_text(path, &read_text_from(path, reader, LONGEST_TABLE)?)
    }

    /// The file, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the columns, in order.
    pub fn headers(&self) -> &[String] {
        &self.headers
    }

    /// Line in the file of each data row, from 1.
    pub fn lines(&self) -> &[usize] {
        &self.lines
    }

    /// Number of data rows; at least one.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// The values of a column.
    ///
    /// # Errors
    ///
    /// When there is no such column, or one of its fields is not a finite number.
    pub fn column(&self, name: &str) -> Result<&[f64], InputError> {
        let names = || self.headers.iter().map(String::as_str);
        match names().position(|header| header == name) {
            Some(index) => match &self.columns[index] {
                Ok(values) => Ok(values),
                Err(error) => Err(error.clone()),
            },
            None => {
                let error = InputError::file(&self.path, "there is no such column")
                    .found(quote(name))
                    .expected(one_of(names()));
                Err(match did_you_mean(name, names()) {
                    Some(hint) => error.hint(hint),
                    None => error,
                })
            }
        }
    }

    /// The place of a data row, counted from 0, for errors about it.
    pub fn place(&self, row: usize, column: Option<&str>) -> Place {
        Place::Row {
            file: self.path.clone(),
            row: row + 1,
            line: self.lines.get(row).copied().unwrap_or_default(),
            column: column.map(str::to_owned),
        }
    }

    fn from_text(path: &Path, text: &str) -> Result<Self, InputError> {
        // To the csv crate a comment ends at `\n` only: one would swallow the rest of such a file.
        let only_returns = text.contains('\r') && !text.contains('\n');
        let text = match only_returns {
            true => &text.replace('\r', "\n"),
            false => text,
        };
        let mut rows = Rows::new(path, text);
        let Some((header_line, headers)) = rows.next().transpose()? else {
            return Err(InputError::file(path, "the file is empty").expected(TABLE));
        };
        check_headers(path, header_line, &headers)?;
        let mut table = Self {
            path: path.to_path_buf(),
            columns: vec![Ok(Vec::new()); headers.len()],
            headers: headers.iter().map(str::to_owned).collect(),
            lines: Vec::new(),
        };
        for row in rows {
            let (line, fields) = row?;
            table.push(line, &fields)?;
        }
        if table.lines.is_empty() {
            return Err(InputError::file(path, "the file has no data")
                .found("a row of column names only")
                .expected(TABLE));
        }
        Ok(table)
    }

    /// Adds a data row; a field that is no number spoils its column, for whoever asks for it.
    fn push(&mut self, line: usize, fields: &StringRecord) -> Result<(), InputError> {
        let row = self.lines.len();
        self.lines.push(line);
        if fields.len() != self.headers.len() {
            return Err(ragged(self.place(row, None), fields, self.headers.len()));
        }
        for (index, field) in fields.iter().enumerate() {
            let value = match &self.columns[index] {
                Ok(_) => number(field),
                Err(_) => continue,
            };
            match (value, &mut self.columns[index]) {
                (Ok(value), Ok(values)) => values.push(value),
                (Ok(_), Err(_)) => {}
                (Err(problem), column) => {
                    let place = Place::Row {
                        file: self.path.clone(),
                        row: row + 1,
                        line,
                        column: Some(self.headers[index].clone()),
                    };
                    *column = Err(not_a_number(place, problem, field));
                }
            }
        }
        Ok(())
    }
}

/// The rows of a text with their lines, the row of names first.
struct Rows<'a> {
    path: &'a Path,
    text: &'a str,
    records: csv::StringRecordsIntoIter<&'a [u8]>,
    counted: usize,
    line: usize,
}

impl<'a> Rows<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        let records = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(Trim::All)
            .from_reader(text.as_bytes())
            .into_records();
        Self {
            path,
            text,
            records,
            counted: 0,
            line: 1,
        }
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

impl Iterator for Rows<'_> {
    type Item = Result<(usize, StringRecord), InputError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let record = match self.records.next()? {
                Ok(record) => record,
                Err(error) => {
                    let problem = format!("the file cannot be read: {error}");
                    return Some(Err(InputError::file(self.path, problem)));
                }
            };
            let byte = record.position().map_or(0, csv::Position::byte);
            let line = self.line_from(usize::try_from(byte).unwrap_or(usize::MAX));
            let first = record.get(0).unwrap_or_default();
            let blank = record.len() == 1 && first.is_empty();
            if !blank && !first.starts_with('#') {
                return Some(Ok((line, record)));
            }
        }
    }
}

/// Column names: each once, no numbers, separated by commas.
fn check_headers(path: &Path, line: usize, headers: &StringRecord) -> Result<(), InputError> {
    let error = |problem: String| {
        let place = Place::Line {
            file: path.to_path_buf(),
            line,
            column: 1,
        };
        InputError::new(place, problem)
    };
    if let (1, Some(only)) = (headers.len(), headers.get(0))
        && let Some(separator) = [';', '\t'].into_iter().find(|&c| only.contains(c))
    {
        let name = if separator == ';' {
            "semicolons"
        } else {
            "tabs"
        };
        return Err(error(format!("the fields are separated by {name}"))
            .found(quote(only))
            .expected("fields separated by commas, and decimal points"));
    }
    if headers.iter().all(|name| name.parse::<f64>().is_ok()) {
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

/// A row with more or fewer fields than there are columns.
fn ragged(place: Place, fields: &StringRecord, expected: usize) -> InputError {
    let plural = |n: usize| match n {
        1 => "1 field".to_owned(),
        n => format!("{n} fields"),
    };
    let error = InputError::new(place, "the row does not fit the column names")
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

/// A finite number, or what is wrong with the field.
fn number(field: &str) -> Result<f64, &'static str> {
    match field.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("not a finite number"),
        Err(_) if field.is_empty() => Err("a number is missing"),
        Err(_) => Err("not a number"),
    }
}

/// The error for a field that is not a finite number.
fn not_a_number(place: Place, problem: &str, field: &str) -> InputError {
    let error = InputError::new(place, problem)
        .found(match field {
            "" => "nothing".to_owned(),
            field => quote(field),
        })
        .expected("a finite number");
    if field.contains('\n') {
        return error.hint("a quote that is opened in this row is not closed in it");
    }
    match field.replace(',', ".").parse::<f64>() {
        Ok(_) if field.contains(',') => {
            error.hint("write numbers with a decimal point, not a comma")
        }
        _ => error,
    }
}
