//! Errors of a builder.

use std::fmt;

/// An invalid part of a model: key, problem, value found and value expected.
///
/// The key is that of a model file: `functions.mass.start`, `experiments[0].initial.velocity`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuildError {
    /// Dotted path of the part; lists count from 0.
    pub key: String,
    /// Problem, one sentence without a full stop.
    pub problem: String,
    /// Value found.
    pub found: Option<String>,
    /// Accepted values.
    pub expected: Option<String>,
    /// Advice.
    pub hint: Option<String>,
    /// Contradictory constraints, if they are the problem.
    pub contradiction: Option<Contradiction>,
}

/// Constraints without a common feasible point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction {
    /// Name and key of each constraint.
    pub constraints: Vec<(String, Option<String>)>,
    /// True if removing any one of them resolves the contradiction.
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
