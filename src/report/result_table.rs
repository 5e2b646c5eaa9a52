//! Tables that a run wrote, read back.

use crate::error::{InputError, Location};
use crate::memory;
use crate::spelling::did_you_mean;
use crate::text_io::{Lines, one_of, open, quote};
use std::path::{Path, PathBuf};

const TABLE: &str = "a CSV file with one row of column names and rows of numbers";

/// A table that a run wrote: unlike a user's, it may have no rows and empty fields, and every field
/// that is not empty is a number.
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

    /// Reads a table of so many rows, one per `what`.
    ///
    /// Line by line: the memory that it takes is that of its values, whatever the length of the file is.
    /// So every table that a run wrote can be read where the run itself fitted into memory.
    ///
    /// # Errors
    /// If no such file, or a row has another number of fields than the header, or a field that
    /// is neither empty nor a number; if it has another number of rows, so that it does not belong to the
    /// result beside it, or was cut off; if its values do not fit into memory.
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
            // The rest is only counted.
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
                    .found(format!("{count} rows"))
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

    /// A column, not a number where a field is empty; `None` where there is no such column.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let index = self.headers.iter().position(|h| h == name)?;
        Some(self.columns[index].clone())
    }

    /// A column that must be there.
    ///
    /// # Errors
    /// If it is not.
    pub fn required(&self, name: &str) -> Result<Vec<f64>, InputError> {
        self.column(name).ok_or_else(|| {
            let names = || self.headers.iter().map(String::as_str);
            InputError::file(&self.path, format!("no column `{name}`"))
                .expected(one_of(names()))
                .hint_if(did_you_mean(name, names()))
        })
    }

    /// A column that must be there, with a finite number in every row.
    ///
    /// # Errors
    /// If it is not, or has another value.
    pub fn finite(&self, name: &str) -> Result<Vec<f64>, InputError> {
        let values = self.required(name)?;
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(values),
            Some(i) => {
                let place = Location::Row {
                    file: self.path.clone(),
                    row: i + 1,
                    line: i + 2,
                    column: Some(name.into()),
                };
                Err(InputError::new(place, "not a finite number").expected("one"))
            }
        }
    }
}

/// Empty columns with room for so many rows, of which a file of this length has no more than bytes.
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

/// Adds the fields of a line, the row of this number from 0, to the columns.
fn take(
    path: &Path,
    row: usize,
    line: &str,
    headers: &[String],
    columns: &mut [Vec<f64>],
) -> Result<(), InputError> {
    let damaged = |problem: &str, column: Option<&String>| {
        let place = Location::Row {
            file: path.to_path_buf(),
            row: row + 1,
            line: row + 2,
            column: column.cloned(),
        };
        InputError::new(place, problem)
    };
    let fields = line.split(',').count();
    if fields != headers.len() {
        return Err(damaged("the row has another number of fields", None)
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
