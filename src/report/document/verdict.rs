//! Verdict on a fit in the result document.

use kmcfit_core::assessment::VerdictLevel;
use kmcfit_core::finding::Finding;
use serde::{Deserialize, Serialize};

/// Verdict on a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Level: the worst of the reasons.
    pub level: VerdictLevel,
    /// Reasons, the most important first; for `adequate` none.
    pub reasons: Vec<Finding>,
    /// Tests that a fit without reasons passed, as one clause; empty with reasons.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub passed: String,
    /// Assumptions that the records cannot test; none where the verdict is `inadequate`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<Finding>,
}

impl Verdict {
    /// The verdict and its reasons, one on each line: `Check       no force is measured: ...`.
    pub fn lines(&self) -> String {
        let reasons = Finding::texts(&self.reasons);
        let lines = match reasons.is_empty() {
            true => vec![self.passed.clone()],
            false => reasons,
        };
        let level = level_in_words(self.level);
        let line = |(i, line): (usize, &String)| {
            let level = if i == 0 { level } else { "" };
            format!("{level:<11}{line}")
        };
        let lines: Vec<String> = lines.iter().enumerate().map(line).collect();
        lines.join("\n")
    }
}

/// A level as a word.
pub fn level_in_words(level: VerdictLevel) -> &'static str {
    match level {
        VerdictLevel::Adequate => "Adequate",
        VerdictLevel::Check => "Check",
        VerdictLevel::Inadequate => "Inadequate",
    }
}
