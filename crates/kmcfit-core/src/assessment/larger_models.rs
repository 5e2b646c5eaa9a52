//! Tests of a fitted model against larger ones, with their results: further terms, errors of the records, finer bases.

use crate::functions::CoefficientKind;
use crate::number_format::number_or_nan;
use serde::{Deserialize, Serialize};

/// An extension of the model by one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Extension {
    /// A force term with a constant coefficient, in its SI unit.
    Term {
        /// Kind of its coefficient.
        term: CoefficientKind,
    },
    /// Delay of the response of an experiment behind its input, s.
    Delay {
        /// Name of the experiment.
        experiment: String,
    },
    /// Relative difference between the rates of the clocks of response and input.
    ClockRate {
        /// Name of the experiment.
        experiment: String,
    },
    /// Relative error of the gain of a channel.
    Gain {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
    },
}

/// Score test of an extension.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtensionTest {
    /// The extension.
    #[serde(flatten)]
    pub extension: Extension,
    /// Its parameter after one step of Gauss and Newton from the fit.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// The parameter over its standard error.
    #[serde(deserialize_with = "number_or_nan")]
    pub t: f64,
}

/// Test of the basis of a function against a finer one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BasisComparison {
    /// Name of the function.
    pub function: String,
    /// Number of its parameters in the given basis.
    pub parameters: usize,
    /// Number of its parameters in the finer basis; two halves of the record for a constant.
    pub finer: usize,
    /// Probability of so large an improvement by noise alone.
    pub p_value: f64,
}

/// All tests of a fit against larger models; empty where they do not apply.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelTests {
    /// Further terms and errors of the records, in the order of the tests.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extensions: Vec<ExtensionTest>,
    /// Smallest `|t|` from which an extension is refitted.
    pub t_limit: f64,
    /// Finer bases.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bases: Vec<BasisComparison>,
    /// p-value below which a finer basis fits significantly better.
    pub p_limit: f64,
}

impl ModelTests {
    /// True where no test applied.
    pub fn is_empty(&self) -> bool {
        self.extensions.is_empty() && self.bases.is_empty()
    }
}
