//! Tables that a run wrote, read back.

use crate::error::{InputError, Place};
use crate::input::{LONGEST_TABLE, check_lines, one_of, quote, read_text};
use crate::near::did_you_mean;
use std::path::{Path, PathBuf};

const TABLE: &str = "a CSV file with one row of column names and rows of numbers";

/// A table that a run wrote: unlike a user's, it may have no rows and empty fields, and every field
/// that is not empty is a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    path: PathBuf,
    headers: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Columns {
    /// Reads a table.
    ///
    /// # Errors
    /// If there is no such file, or a row has another number of fields than the header, or a field that
    /// is neither empty nor a number.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = read_text(path, TABLE, LONGEST_TABLE)?;
        check_lines(path, &text)?;
        let mut lines = text.lines();
        let header = lines.next().filter(|header| !header.is_empty());
        let header = header.ok_or_else(|| {
            InputError::file(path, "the table is empty").expected("a row of column names")
        })?;
        let headers: Vec<String> = header.split(',').map(|h| h.trim().to_owned()).collect();
        let mut columns = vec![Vec::new(); headers.len()];
        for (i, line) in lines.enumerate() {
            let damaged = |problem: &str, column: Option<&String>| {
                let place = Place::Row {
                    file: path.to_path_buf(),
                    row: i + 1,
                    line: i + 2,
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
            for ((field, column), name) in line.split(',').zip(&mut columns).zip(&headers) {
                column.push(match field.trim() {
                    "" => f64::NAN,
                    field => field.parse().map_err(|_| {
                        damaged("this is no number", Some(name))
                            .found(quote(field))
                            .expected("a number, or nothing")
                    })?,
                });
            }
        }
        Ok(Self {
            path: path.to_path_buf(),
            headers,
            columns,
        })
    }

    /// The same, if it has so many rows, one per `what`.
    ///
    /// # Errors
    /// If it has others: then it does not belong to the result beside it, or was cut off.
    pub fn with_rows(self, rows: usize, what: &str) -> Result<Self, InputError> {
        match self.rows() == rows {
            true => Ok(self),
            false => Err(
                InputError::file(&self.path, "the table does not belong to this result")
                    .found(format!("{} rows", self.rows()))
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
            let error = InputError::file(&self.path, format!("there is no column `{name}`"))
                .expected(one_of(names()));
            match did_you_mean(name, names()) {
                Some(hint) => error.hint(hint),
                None => error,
            }
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
                let place = Place::Row {
                    file: self.path.clone(),
                    row: i + 1,
                    line: i + 2,
                    column: Some(name.into()),
                };
                Err(InputError::new(place, "this is no finite number").expected("one"))
            }
        }
    }
}
