//! Positions in a text as line and column.

use crate::error::Location;
use std::path::Path;

/// A position in a text; both count from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

impl Position {
    /// The beginning of a text.
    pub const START: Self = Self { line: 1, column: 1 };

    /// The position of a byte in a text.
    pub(in crate::config) fn of(text: &str, index: usize) -> Self {
        let before = text.get(..index).unwrap_or(text);
        Self {
            line: 1 + before.matches('\n').count(),
            column: 1 + before.chars().rev().take_while(|&c| c != '\n').count(),
        }
    }
}

/// A position in a file as the location of an error.
pub(in crate::config) fn location(file: &Path, position: Position) -> Location {
    Location::Line {
        file: file.to_path_buf(),
        line: position.line,
        column: position.column,
    }
}
