//! Reading of tables written by a run.

use crate::error::{InputError, Location};
use crate::memory;
use crate::spelling::did_you_mean;
use crate::text_io::{Lines, one_of, open, quote};
use std::path::{Path, PathBuf};

const TABLE: &str = "a CSV file with one row of column names and rows of numbers";

/// A table written by a run: every field is a number or empty, and the number of rows can be zero.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultTable {
    path: PathBuf,
    headers: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl ResultTable {
    /// Reads a table of any number of rows, as [`read_rows`](Self::read_rows) does.
    ///
    /// # Errors
    /// As there.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let mut lines = Lines::new(path, open(path, TABLE)?.0);
        let mut rows = 0_usize;
        while lines.next()?.is_some() {
            rows += 1;
        }
        Self::read_rows(path, rows.saturating_sub(1), "row")
    }

    /// Reads a table with `rows` rows, one per `what`.
    ///
    /// The file is read line by line, so the memory is that of the values, independent of the length of the file: a
    /// table can be read wherever the run itself fitted into memory.
    ///
    /// # Errors
    /// If there is no such file; if a row has a wrong number of fields, or a field that is neither
    /// empty nor a number; if the number of rows differs, so that the table is truncated or belongs to another result;
    /// if its values do not fit into memory.
    pub fn read_rows(path: &Path, rows: usize, what: &str) -> Result<Self, InputError> {
        let (file, length) = open(path, TABLE)?;
        let mut lines = Lines::new(path, file);
        let header = lines.next()?.filter(|header| !header.is_empty());
        let header = header.ok_or_else(|| {
            InputError::file(path, "the table is empty").expected("a row of column names")
        })?;
        let headers: Vec<String> = header.split(',').map(|h| h.trim().to_owned()).collect();
        let mut columns = reserved(path, headers.len(), rows, length)?;
        let mut count = 0;
        while let Some(line) = lines.next()? {
            // Further rows are only counted.
            if count < rows {
                take(path, count, line, &headers, &mut columns)?;
            }
            count += 1;
        }
        match count == rows {
            true => Ok(Self {
                path: path.to_path_buf(),
                headers,
                columns,
            }),
            false => Err(
                InputError::file(path, "the table does not belong to this result")
                    .found(format!("{count} row{}", if count == 1 { "" } else { "s" }))
                    .expected(format!("{rows} rows, one per {what}")),
            ),
        }
    }

    /// Names of the columns, in order.
    pub fn headers(&self) -> &[String] {
        &self.headers
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// A column, NaN for an empty field; `None` if there is no such column.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let index = self.headers.iter().position(|h| h == name)?;
        Some(self.columns[index].clone())
    }

    /// A required column.
    ///
    /// # Errors
    /// If it is missing.
    pub fn required(&self, name: &str) -> Result<Vec<f64>, InputError> {
        self.column(name).ok_or_else(|| {
            let names = || self.headers.iter().map(String::as_str);
            InputError::file(&self.path, format!("no column `{name}`"))
                .expected(one_of(names()))
                .hint_if(did_you_mean(name, names()))
        })
    }

    /// A required column with a finite number in every row.
    ///
    /// # Errors
    /// If it is missing, or has another value.
    pub fn finite(&self, name: &str) -> Result<Vec<f64>, InputError> {
        let values = self.required(name)?;
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(values),
            Some(i) => {
                let location = Location::Row {
                    file: self.path.clone(),
                    line: i + 2,
                    column: Some(name.into()),
                };
                Err(InputError::new(location, "not a finite number").expected("one"))
            }
        }
    }
}

/// Empty columns with capacity for `rows` rows, at most the number that a file of this length can have.
fn reserved(
    path: &Path,
    width: usize,
    rows: usize,
    length: u64,
) -> Result<Vec<Vec<f64>>, InputError> {
    // A row takes at least its delimiters and its line end.
    let most = usize::try_from(length).unwrap_or(usize::MAX) / width.max(1) + 1;
    let rows = rows.min(most);
    let bytes = rows.saturating_mul(width).saturating_mul(size_of::<f64>());
    memory::check_file(path, bytes as u64)?;
    let mut columns = vec![Vec::new(); width];
    for column in &mut columns {
        column.try_reserve_exact(rows).map_err(|_| {
            InputError::file(path, "the file does not fit into memory")
                .found(format!("{width} columns of {rows} numbers"))
                .expected("fewer, or more memory")
        })?;
    }
    Ok(columns)
}

/// Adds the fields of a line, row `row` from 0, to the columns.
fn take(
    path: &Path,
    row: usize,
    line: &str,
    headers: &[String],
    columns: &mut [Vec<f64>],
) -> Result<(), InputError> {
    let damaged = |problem: &str, column: Option<&String>| {
        let location = Location::Row {
            file: path.to_path_buf(),
            line: row + 2,
            column: column.cloned(),
        };
        InputError::new(location, problem)
    };
    let fields = line.split(',').count();
    if fields != headers.len() {
        return Err(damaged("wrong number of fields in this row", None)
            .found(fields)
            .expected(headers.len().to_string()));
    }
    for ((field, column), name) in line.split(',').zip(columns).zip(headers) {
        column.push(match field.trim() {
            "" => f64::NAN,
            field => field.parse().map_err(|_| {
                damaged("not a number", Some(name))
                    .found(quote(field))
                    .expected("a number, or an empty field")
            })?,
        });
    }
    Ok(())
}
