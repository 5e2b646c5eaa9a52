//! The error of a builder.

use std::fmt;

/// A part of a model that cannot be used: its key, what was found there and what was expected.
///
/// The key is that of the same part in a model file: `functions.mass.start`, `experiments[0].initial.velocity`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuildError {
    /// Dotted path of the part; lists count from 0.
    pub key: String,
    /// What is wrong, in one sentence without a full stop.
    pub problem: String,
    /// What was found there.
    pub found: Option<String>,
    /// What would be accepted.
    pub expected: Option<String>,
    /// What to try.
    pub hint: Option<String>,
    /// The constraints that contradict each other, where that is the problem.
    pub contradiction: Option<Contradiction>,
}

/// Constraints that no parameters satisfy together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction {
    /// Name of each constraint, and the key that states it.
    pub constraints: Vec<(String, Option<String>)>,
    /// Whether the others can be satisfied without any one of them.
    pub minimal: bool,
}

impl BuildError {
    pub(super) fn new(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            problem: problem.into(),
            found: None,
            expected: None,
            hint: None,
            contradiction: None,
        }
    }

    pub(super) fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    pub(super) fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    pub(super) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.problem)?;
        for (label, text) in [
            ("found", &self.found),
            ("expected", &self.expected),
            ("hint", &self.hint),
        ] {
            if let Some(text) = text {
                write!(f, "\n  {label}: {text}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for BuildError {}
