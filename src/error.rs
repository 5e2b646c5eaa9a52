//! Errors of input with their location. Invalid input is an error; the end of a fit, successful or not, is an outcome.
//!
//! An [`InputError`] has the location (file, line or row, key), the problem, the value found, the value expected, and a
//! hint. The program prints it and ends with exit code 2.

use crate::escape::harmless;
use std::fmt;
use std::path::{Path, PathBuf};

/// Location of an error in the input.
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
    /// A data row of a table.
    Row {
        /// The file.
        file: PathBuf,
        /// Line in the file, from 1.
        line: usize,
        /// Column name, for an error in one column.
        column: Option<String>,
    },
    /// A sample of a binary file.
    Sample {
        /// The file.
        file: PathBuf,
        /// Number of the sample, from 1.
        sample: usize,
        /// Path of the channel in the file, for an error in one channel.
        channel: Option<String>,
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
            Location::Row { file, line, column } => {
                write!(f, "{}:{line}", file.display())?;
                match column {
                    Some(column) => write!(f, ": column `{column}`"),
                    None => Ok(()),
                }
            }
            Location::Sample {
                file,
                sample,
                channel,
            } => {
                write!(f, "{}: sample {sample}", file.display())?;
                match channel {
                    Some(channel) => write!(f, " of `{channel}`"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// An error of input: location, problem, value found, value expected, hint.
///
/// ```
/// use kmcfit::error::{InputError, Location};
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
    /// Location.
    pub location: Location,
    /// Dotted path of the key, as in `functions.mass.start`.
    pub key: Option<String>,
    /// The problem, as a sentence without a full stop.
    pub problem: String,
    /// The value found.
    pub found: Option<String>,
    /// Accepted values.
    pub expected: Option<String>,
    /// Remedy, for instance a similar spelling.
    pub hint: Option<String>,
}

impl InputError {
    /// An error at `location` with its problem.
    pub fn new(location: Location, problem: impl Into<String>) -> Self {
        Self {
            location,
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

    /// An error in a text file at the character that follows `text`, the beginning of the file.
    pub fn after(file: impl AsRef<Path>, text: &str, problem: impl Into<String>) -> Self {
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

    /// Sets the value found.
    #[must_use]
    pub fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    /// Sets the accepted values.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// Adds a remedy.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        self.hint_if(Some(hint.into()))
    }

    /// Adds a remedy, if any.
    #[must_use]
    pub fn hint_if(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut message = format!("{}: ", self.location);
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
        // The message can contain text of input files and their names, so control characters are escaped.
        f.write_str(&harmless(&message))
    }
}

impl std::error::Error for InputError {}
