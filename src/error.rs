//! Errors that say where: misuse is an error, what happens during a fit is an outcome.
//!
//! An [`InputError`] names the place (file, line or row, key), what was found there, what was
//! expected, and, where one fits, a near spelling. The program prints it and ends with exit code 2.

use crate::escape::harmless;
use std::fmt;
use std::path::{Path, PathBuf};

/// Where in the input something is wrong.
#[derive(Debug, Clone, PartialEq)]
pub enum Location {
    /// A command-line option or argument, or a library argument, by name.
    Argument(String),
    /// A file as a whole.
    File(PathBuf),
    /// A position in a text file; line and column count from 1.
    Line {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A data row of a table; rows count from 1 without the header, `line` is the line in the file.
    Row {
        /// The file.
        file: PathBuf,
        /// Data row, from 1.
        row: usize,
        /// Line in the file, from 1.
        line: usize,
        /// Column name, where one column is meant.
        column: Option<String>,
    },
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Location::Argument(name) => write!(f, "{name}"),
            Location::File(file) => write!(f, "{}", file.display()),
            Location::Line { file, line, column } => {
                write!(f, "{}:{line}:{column}", file.display())
            }
            Location::Row {
                file,
                row,
                line,
                column,
            } => {
                write!(f, "{}:{line}: row {row}", file.display())?;
                match column {
                    Some(column) => write!(f, ", column `{column}`"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// An input that cannot be used: where, what was found, what was expected.
///
/// ```
/// use kmcfit::error::{InputError, Place};
/// let error = InputError::new(Location::Argument("--nodes".into()), "a grid needs at least 3 nodes")
///     .found("2")
///     .expected("3 or more");
/// assert_eq!(
///     error.to_string(),
///     "--nodes: a grid needs at least 3 nodes\n  found: 2\n  expected: 3 or more"
/// );
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct InputError {
    /// Where.
    pub place: Location,
    /// Dotted path of the key, as in `functions.mass.start`.
    pub key: Option<String>,
    /// What is wrong, in one sentence without a full stop.
    pub problem: String,
    /// What was found there.
    pub found: Option<String>,
    /// What would be accepted.
    pub expected: Option<String>,
    /// What to try, for instance a near spelling.
    pub hint: Option<String>,
}

impl InputError {
    /// An error at `place` that says what is wrong.
    pub fn new(place: Location, problem: impl Into<String>) -> Self {
        Self {
            place,
            key: None,
            problem: problem.into(),
            found: None,
            expected: None,
            hint: None,
        }
    }

    /// An error about an argument.
    pub fn argument(name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::new(Location::Argument(name.into()), problem)
    }

    /// An error at a line of a file and a column in it, both from 1.
    pub fn line(
        file: impl AsRef<Path>,
        line: usize,
        column: usize,
        problem: impl Into<String>,
    ) -> Self {
        let file = file.as_ref().to_path_buf();
        Self::new(Location::Line { file, line, column }, problem)
    }

    /// An error in a text file behind some text.
    pub fn behind(file: impl AsRef<Path>, text: &str, problem: impl Into<String>) -> Self {
        let line = 1 + text.matches('\n').count();
        let column = 1 + text.chars().rev().take_while(|&c| c != '\n').count();
        Self::line(file, line, column, problem)
    }

    /// An error about a file as a whole.
    pub fn file(file: impl AsRef<Path>, problem: impl Into<String>) -> Self {
        Self::new(Location::File(file.as_ref().to_path_buf()), problem)
    }

    /// Adds the dotted path of the key.
    #[must_use]
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }

    /// Adds what was found.
    #[must_use]
    pub fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    /// Adds what was expected.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// Adds what to try.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        self.hint_if(Some(hint.into()))
    }

    /// Adds what to try, where there is something.
    #[must_use]
    pub fn hint_if(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut message = format!("{}: ", self.place);
        if let Some(key) = &self.key {
            message += &format!("{key}: ");
        }
        message += &self.problem;
        for (label, text) in [
            ("found", &self.found),
            ("expected", &self.expected),
            ("hint", &self.hint),
        ] {
            if let Some(text) = text {
                message += &format!("\n  {label}: {text}");
            }
        }
        // It may repeat what somebody else wrote, file names included.
        f.write_str(&harmless(&message))
    }
}

impl std::error::Error for InputError {}
