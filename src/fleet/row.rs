//! Results of one record.

use crate::report::document::Estimates;
use kmcfit_core::internals::assessment::VerdictLevel;
use serde::{Deserialize, Serialize};

/// Result of the fit of one record: a line of a journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The record: its path as given.
    pub record: String,
    /// Estimates, as in the result document of a fit; empty where there is an error.
    pub estimates: Estimates,
    /// Verdict; none where there is an error.
    pub verdict: Option<VerdictLevel>,
    /// Reasons of the verdict, then warnings.
    pub warnings: Vec<String>,
    /// Time of reading and fit, s.
    pub seconds: f64,
    /// Why the record has no estimates.
    pub error: Option<String>,
}

impl Row {
    /// The row of a record without estimates.
    pub fn failed(record: &str, seconds: f64, error: impl Into<String>) -> Self {
        Self {
            record: record.to_owned(),
            estimates: Estimates(Vec::new()),
            verdict: None,
            warnings: Vec::new(),
            seconds,
            error: Some(error.into()),
        }
    }
}

/// A coefficient that varies over a record, with its 95 % confidence band where there is one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The record.
    pub record: String,
    /// Name of the coefficient, as in the model.
    pub function: String,
    /// Times, s.
    pub t: Vec<f64>,
    /// Values, SI.
    pub value: Vec<f64>,
    /// Pointwise limits of the band, SI; empty without a band.
    pub low: Vec<f64>,
    /// Upper limits.
    pub high: Vec<f64>,
}
