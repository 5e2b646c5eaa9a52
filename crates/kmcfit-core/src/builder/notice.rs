//! Notices on a specification: valid parts without effect, and changes of the start.

use serde::Serialize;
use std::fmt;

/// A notice on a specification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BuildNotice {
    /// All coefficient functions are fixed.
    NothingToFit,
    /// A constraint satisfied by all parameters.
    AlwaysHolds {
        /// Key.
        key: String,
    },
    /// A constraint without information in free records, which the scaling ambiguity can satisfy.
    Uninformative {
        /// Key.
        key: String,
        /// Description of the constraint.
        what: &'static str,
    },
    /// A penalty on a derivative that is zero for all parameters.
    NoRoughness {
        /// Key.
        key: String,
        /// Name of the basis.
        basis: &'static str,
    },
    /// A note on states estimated for the equation error.
    Measurement {
        /// Note.
        remark: String,
    },
    /// A lower limit of the mass at which the mass can be zero.
    MassMayVanish {
        /// Key.
        key: String,
    },
    /// The start was projected onto the constraints.
    StartMoved {
        /// Constraint with the largest violation.
        constraint: String,
    },
}

impl fmt::Display for BuildNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingToFit => {
                f.write_str("every function is fixed: there are no parameters to estimate")
            }
            Self::AlwaysHolds { key } => {
                write!(f, "{key} has no effect: it holds for all functions")
            }
            Self::Uninformative { key, what } => write!(
                f,
                "{key}: {what} carries no information here. Without a force the response determines only k/m and c/m: a factor \
                 s(t) of all three functions is undetermined; fix a function, bound the functions on both sides, or add a penalty"
            ),
            Self::NoRoughness { key, basis } => write!(
                f,
                "{key} has no effect: this derivative of a {basis} function is zero"
            ),
            Self::Measurement { remark } => f.write_str(remark),
            Self::MassMayVanish { key } => write!(
                f,
                "{key} allows a mass of zero, for which the equation of motion has no solution: use a limit above zero"
            ),
            Self::StartMoved { constraint } => {
                write!(
                    f,
                    "the start values violate `{constraint}` and were projected onto the constraints"
                )
            }
        }
    }
}
