//! The error of a builder.

use thiserror::Error;

/// Something that cannot be meant: which part of the problem, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{part}: {problem}")]
pub struct BuildError {
    /// The part: a function, a record, a demand or the grid.
    pub part: String,
    /// What is wrong with it, and what was expected.
    pub problem: String,
}

impl BuildError {
    pub(super) fn new(part: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            part: part.into(),
            problem: problem.into(),
        }
    }
}
