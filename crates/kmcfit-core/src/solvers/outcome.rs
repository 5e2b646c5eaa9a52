//! How a fit ended.

use serde::{Deserialize, Serialize};

/// How a fit ended, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// A stopping test of the model was met.
    Converged,
    /// Exactly the iterations asked for were run, and no test was asked for.
    Completed,
    /// The iterations ran out before a stopping test was met.
    MaxIterations,
    /// The wall-clock limit was reached.
    TimeLimit,
    /// No step lowers the cost although no stopping test is met.
    Stalled,
    /// Ended from outside.
    Interrupted,
    /// No device satisfies the constraints and the motion.
    Infeasible,
    /// The start cannot be evaluated.
    Failed,
}

impl Status {
    /// The word in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::Completed => "completed",
            Status::MaxIterations => "max-iterations",
            Status::TimeLimit => "time-limit",
            Status::Stalled => "stalled",
            Status::Interrupted => "interrupted",
            Status::Infeasible => "infeasible",
            Status::Failed => "failed",
        }
    }
}

/// How a fit ended, and why in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// In one word.
    pub status: Status,
    /// In one sentence.
    pub reason: String,
}

impl Outcome {
    pub(crate) fn new(status: Status, reason: impl Into<String>) -> Self {
        Self {
            status,
            reason: reason.into(),
        }
    }
}
