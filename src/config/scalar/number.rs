//! Finite numbers.

use super::Scalar;
use super::written::number_in;
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A finite number; an integer will do.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Number(pub f64);

impl Number {
    /// What a number is expected to be.
    const EXPECTED: &'static str = "a finite number";

    pub(super) fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Self::read_or(scalar, Self::EXPECTED)
    }

    /// As `read`, where something else would do as well.
    pub(super) fn read_or(scalar: Scalar<'_>, expected: &str) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Integer(value) => Ok(Self(value as f64)),
            Scalar::Float(value) if value.is_finite() => Ok(Self(value)),
            Scalar::Float(_) => Err(Complaint::new(
                "not a finite number",
                scalar.describe(),
                expected,
            )),
            Scalar::Text(text) => {
                Err(Complaint::new("not a number", scalar.describe(), expected)
                    .hint(number_in(text)))
            }
            other => Err(Complaint::new("not a number", other.describe(), expected)),
        }
    }
}

impl From<Number> for f64 {
    fn from(number: Number) -> f64 {
        number.0
    }
}

deserialize_scalar!(Number, Number::read, Number::EXPECTED);

impl Value for Number {
    const KIND: Kind = Kind::Number;
}
