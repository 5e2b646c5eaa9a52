//! Numbers that may be estimated.

use super::written::number_in;
use super::{Number, Scalar};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use crate::near::did_you_mean;
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// The word that asks for an estimate.
const ESTIMATE: &str = "estimate";

/// A number, or the word `estimate`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NumberOrEstimate {
    /// Known.
    Number(Number),
    /// To be found with the functions.
    Estimate,
}

impl NumberOrEstimate {
    const EXPECTED: &'static str = "a finite number, `estimate`, or a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text(ESTIMATE) => Ok(Self::Estimate),
            Scalar::Text(word) if number_in(word).is_none() => Err(Complaint::new(
                "neither a number nor `estimate`",
                scalar.describe(),
                Self::EXPECTED,
            )
            .hint(did_you_mean(word, [ESTIMATE]))),
            other => Number::read_or(other, Self::EXPECTED).map(Self::Number),
        }
    }
}

deserialize_scalar!(
    NumberOrEstimate,
    NumberOrEstimate::read,
    "a number or `estimate`"
);

/// The standard deviation of readings: a number, a column of the file, or the word `estimate`.
#[derive(Debug, Clone, PartialEq)]
pub enum Sigma {
    /// The same for all readings.
    Number(Number),
    /// One for each reading.
    Column(String),
    /// From the residuals of the fit.
    Estimate,
}

impl Sigma {
    const EXPECTED: &'static str = "a finite number, the name of a column, or `estimate`";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text(ESTIMATE) => Ok(Self::Estimate),
            Scalar::Text(word) if number_in(word).is_none() && !word.is_empty() => {
                Ok(Self::Column(word.to_owned()))
            }
            other => Number::read_or(other, Self::EXPECTED).map(Self::Number),
        }
    }
}

deserialize_scalar!(Sigma, Sigma::read, Sigma::EXPECTED);

/// The word `estimate` where a map would stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Estimate;

impl Estimate {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text(ESTIMATE) => Ok(Self),
            other => {
                let hint = match other {
                    Scalar::Text(word) => did_you_mean(word, [ESTIMATE]),
                    _ => None,
                };
                Err(Complaint::new(
                    "this is the wrong kind of value",
                    other.describe(),
                    "a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`",
                )
                .hint(hint))
            }
        }
    }
}

deserialize_scalar!(Estimate, Estimate::read, "`estimate`");

impl Value for Estimate {
    const KIND: Kind = Kind::Word("estimate");
}

impl Value for NumberOrEstimate {
    const KIND: Kind = Kind::AnyOf(&[Kind::Number, Estimate::KIND]);
}

impl Value for Sigma {
    const KIND: Kind = Kind::AnyOf(&[Kind::Number, Estimate::KIND, Kind::Text]);
}
