//! Remarks on a specification that are no errors.

use serde::Serialize;
use std::fmt;

/// A remark on a specification that is no error.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BuildNotice {
    /// Every coefficient function is fixed.
    NothingToFit,
    /// A constraint holds for all parameters.
    AlwaysHolds {
        /// Its key.
        key: String,
    },
    /// A constraint that free records cannot feel: the scaling ambiguity can satisfy it.
    Unfelt {
        /// Its key.
        key: String,
        /// What it states.
        what: &'static str,
    },
    /// A penalty on a derivative that is zero for all parameters.
    NoRoughness {
        /// Its key.
        key: String,
        /// Name of the basis.
        basis: &'static str,
    },
    /// A remark on the states that the equation error takes from the samples.
    Measurement {
        /// The remark.
        remark: String,
    },
    /// The start of the search was moved into the constraints.
    StartMoved {
        /// The constraint that was violated most.
        constraint: String,
    },
}

impl fmt::Display for BuildNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingToFit => {
                f.write_str("every function is fixed, so there is nothing to fit")
            }
            Self::AlwaysHolds { key } => {
                write!(f, "{key} says nothing: it holds for all functions")
            }
            Self::Unfelt { key, what } => write!(
                f,
                "{key}: {what} says nothing about the system here. Without a force the response shows only k/m and c/m, and any \
                 s(t) may multiply all three functions; fix a function, bound the functions on both sides, or smooth them"
            ),
            Self::NoRoughness { key, basis } => write!(
                f,
                "{key} says nothing: this derivative of a {basis} function is zero"
            ),
            Self::Measurement { remark } => f.write_str(remark),
            Self::StartMoved { constraint } => {
                write!(
                    f,
                    "the start was moved into the constraints (`{constraint}`)"
                )
            }
        }
    }
}
