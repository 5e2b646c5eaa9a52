//! Selection of a column by name, with or without its unit, or by number.

use std::fmt;

use super::Table;
use crate::error::InputError;
use crate::headings::split_unit;
use crate::spelling::did_you_mean;
use crate::text_io::{one_of, quote};

/// A column, by its name or by its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// By name: the full header or, if unambiguous, the header without its unit in brackets or after a slash: `acc` for
    /// `acc [m/s²]` or `acc / m/s²`.
    Name(String),
    /// By number, from 1.
    Number(usize),
}

impl fmt::Display for ColumnName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

impl From<&str> for ColumnName {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

impl Table {
    /// The index, from 0, of a column.
    ///
    /// # Errors
    ///
    /// When there is no such column, or several have this name up to their units.
    pub fn find(&self, column: &ColumnName) -> Result<usize, InputError> {
        match column {
            ColumnName::Name(name) => self.find_name(name),
            ColumnName::Number(number) => match self.index_of(*number) {
                Some(index) if index < self.width() => Ok(index),
                _ => Err(self.no_such_number(*number)),
            },
        }
    }

    /// True if [`find`](Self::find) finds a column.
    pub(super) fn has(&self, column: &ColumnName) -> bool {
        match column {
            ColumnName::Name(name) => self.matches(name).len() == 1,
            ColumnName::Number(number) => self.index_of(*number).is_some_and(|i| i < self.width()),
        }
    }

    pub(super) fn no_such_number(&self, number: usize) -> InputError {
        if let Some(error) = self.of_other_times(&ColumnName::Number(number)) {
            return error;
        }
        InputError::file(self.path(), "no such column number")
            .found(number)
            .expected(match self.numbered() {
                1 => "1: there is one column".to_owned(),
                width => format!("1 to {width}"),
            })
    }

    /// Label of a column in messages: its name or, without one, its number from 1.
    pub fn label(&self, index: usize) -> String {
        match self.headers().get(index) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => (index + 1).to_string(),
        }
    }

    /// The unit of a column as spelt in the file, without brackets: from the row of units, or from the end of its name.
    ///
    /// ```
    /// use kmcfit::tables::Table;
    /// let table = Table::parse("a.csv", "t [s],acc (g),note\n0,1,\n".as_bytes())?;
    /// assert_eq!((table.unit(0), table.unit(1), table.unit(2)), (Some("s"), Some("g"), None));
    /// # Ok::<(), kmcfit::error::InputError>(())
    /// ```
    pub fn unit(&self, index: usize) -> Option<&str> {
        self.stated_unit(index).text()
    }

    fn find_name(&self, name: &str) -> Result<usize, InputError> {
        match self.matches(name).as_slice() {
            [only] => Ok(*only),
            [] => Err(self.no_such(name)),
            several => {
                let names = several.iter().map(|&i| self.headers()[i].as_str());
                Err(
                    InputError::file(self.path(), "several columns have this name")
                        .found(quote(name))
                        .expected(one_of(names)),
                )
            }
        }
    }

    /// The columns of this name: that with exactly it, else those with it up to their units.
    fn matches(&self, name: &str) -> Vec<usize> {
        let headers = self.headers();
        if let Some(index) = headers.iter().position(|header| header == name) {
            return vec![index];
        }
        let wanted = name.trim().trim_matches(['"', '\'']).trim();
        let is = |header: &String| {
            !wanted.is_empty() && (split_unit(header).0 == wanted || header == wanted)
        };
        (0..headers.len()).filter(|i| is(&headers[*i])).collect()
    }

    fn no_such(&self, name: &str) -> InputError {
        let own = ColumnName::from(name);
        if let Some(error) = self
            .of_other_times(&own)
            .or_else(|| self.unusable_error(name))
        {
            return error;
        }
        let error = InputError::file(self.path(), "there is no such column").found(quote(name));
        if self.headers().is_empty() {
            return error
                .expected(numbers(self.width()))
                .hint("the file has no column names: give the column by its number");
        }
        let names = || self.all_names();
        let bare = names().map(|header| split_unit(header).0);
        let hint = did_you_mean(name, names().chain(bare)).or_else(|| self.by_last_part(name));
        error.expected(one_of(names())).hint_if(hint)
    }
}

/// Valid column numbers, for messages.
fn numbers(width: usize) -> String {
    match width {
        1 => "the number 1: there is one column".to_owned(),
        width => format!("a number from 1 to {width}"),
    }
}
