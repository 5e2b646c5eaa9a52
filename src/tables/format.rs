//! Format of a table: given properties, and detected ones.

use std::fmt;

use super::encoding::Encoding;
use crate::error::InputError;
use crate::text_io::quote;

/// Format of a table; properties that are `None` are detected.
///
/// ```
/// use kmcfit::tables::{Table, TableFormat};
/// let text = "Rig 7\nt;a\ns;m/s²\n0,0;1,5\n0,1;1,4\n";
/// let table = Table::parse_with("rig.csv", text.as_bytes(), &TableFormat::default())?;
/// assert_eq!(table.column("a")?, [1.5, 1.4]);
/// assert_eq!(table.unit(1), Some("m/s²"));
/// assert_eq!(
///     table.format_in_words(),
///     "UTF-8; separated by semicolons; decimal comma; column names in line 2; units in line 3"
/// );
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TableFormat {
    /// Delimiter of the fields: a character such as `,`, `;`, `|` or a tab; a blank denotes runs of blanks and tabs.
    pub delimiter: Option<char>,
    /// The decimal sign, `.` or `,`.
    pub decimal: Option<char>,
    /// Number of lines before the column names or, without names, before the data.
    pub skip: Option<usize>,
    /// True with a row of column names.
    pub header: Option<bool>,
    /// True if a row of units follows the names.
    pub units_row: Option<bool>,
}

impl TableFormat {
    /// The name of the first given property.
    pub(super) fn first_given(&self) -> Option<&'static str> {
        let given = [
            (self.delimiter.is_some(), "delimiter"),
            (self.decimal.is_some(), "decimal"),
            (self.skip.is_some(), "skip"),
            (self.header.is_some(), "header"),
            (self.units_row.is_some(), "units_row"),
        ];
        let given = given.into_iter().find(|(is_given, _)| *is_given);
        given.map(|(_, name)| name)
    }

    /// Refuses invalid delimiters and decimal signs.
    pub(super) fn check(&self) -> Result<(), InputError> {
        if let Some(sign) = self.decimal
            && !matches!(sign, '.' | ',')
        {
            return Err(InputError::argument("decimal", "invalid decimal separator")
                .found(quote(&sign.to_string()))
                .expected("`.` or `,`"));
        }
        let Some(delimiter) = self.delimiter else {
            return Ok(());
        };
        let separates = matches!(delimiter, '\t' | ' ')
            || delimiter.is_ascii_punctuation()
                && !matches!(delimiter, '.' | '+' | '-' | '"' | '#');
        if !separates {
            return Err(
                InputError::argument("delimiter", "invalid delimiter")
                    .found(quote(&delimiter.to_string()))
                    .expected("a comma, a semicolon, a tab, a space or another punctuation mark, except `.`, `+`, `-`, `#` and quotes"),
            );
        }
        match self.decimal == self.delimiter {
            true => Err(InputError::argument(
                "delimiter",
                "the delimiter is also the decimal sign",
            )
            .found(quote(&delimiter.to_string()))
            .expected("two different signs")),
            false => Ok(()),
        }
    }
}

/// Detected format of a table; `Display` gives it as text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Detected {
    /// Character encoding.
    pub encoding: Encoding,
    /// Delimiter of the fields; a blank denotes runs of blanks and tabs.
    pub delimiter: char,
    /// The decimal sign, `.` or `,`.
    pub decimal: char,
    /// Number of lines before the column names or, without names, before the data: preamble, comments and blank lines.
    pub skipped: usize,
    /// Line of the column names, from 1, if there are any.
    pub header: Option<usize>,
    /// Line of the units, from 1, if there is a row of them.
    pub units_row: Option<usize>,
}

impl fmt::Display for Detected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; separated by ", self.encoding)?;
        match self.delimiter {
            ',' => f.write_str("commas")?,
            ';' => f.write_str("semicolons")?,
            '\t' => f.write_str("tabs")?,
            ' ' => f.write_str("blanks")?,
            other => write!(f, "`{other}`")?,
        }
        f.write_str(match self.decimal {
            ',' => "; decimal comma",
            _ => "; decimal point",
        })?;
        match self.header {
            Some(line) => write!(f, "; column names in line {line}")?,
            None => write!(f, "; no column names, data from line {}", self.skipped + 1)?,
        }
        match self.units_row {
            Some(line) => write!(f, "; units in line {line}"),
            None => Ok(()),
        }
    }
}
