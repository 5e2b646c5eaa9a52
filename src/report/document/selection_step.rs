//! Steps of `fit --select`.

use kmcfit_core::identifiability::Quantity;
use serde::{Deserialize, Serialize};

/// One addition to the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SelectionStep {
    /// What was added, in words.
    pub added: String,
    /// What is as good, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub as_good: Vec<String>,
    /// Its gain.
    pub gain: f64,
    /// What the addition estimated when it was made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimates: Vec<Quantity>,
    /// Overrides of the model file that add it.
    pub set: Vec<String>,
    /// Natural frequency before and after, Hz; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub natural_frequency: Option<[f64; 2]>,
    /// Damping ratio before and after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<[f64; 2]>,
}
