//! What a finding means.

use serde::{Deserialize, Serialize};

/// What a finding means for the use of the estimates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// What stands in the files alone.
    Detail,
    /// What is determined, or how.
    #[default]
    Note,
    /// What is to be known, and limits no estimate beyond its interval.
    Warning,
    /// It limits the estimates, or an engineer must decide whether it does: a reason of the verdict.
    Check,
    /// The estimates are not those of the system: a reason of the verdict.
    Inadequate,
}
