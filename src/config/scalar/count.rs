//! Numbers of things.

use super::Scalar;
use super::written::number_in;
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A number of things: an integer, 0 or more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(pub usize);

impl Count {
    pub(super) fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let complaint = |problem| Complaint::new(problem, scalar.describe(), "an integer");
        match scalar {
            Scalar::Integer(value) if value < 0 => Err(Complaint::new(
                "a count cannot be negative",
                scalar.describe(),
                "an integer, 0 or more",
            )),
            Scalar::Integer(value) => usize::try_from(value)
                .map(Self)
                .map_err(|_| complaint("the count is too large")),
            Scalar::Float(value) if value.fract() == 0.0 && (0.0..1e15).contains(&value) => {
                Err(complaint("not an integer").hint(Some(format!("write {value}"))))
            }
            Scalar::Text(text) => Err(complaint("not an integer").hint(number_in(text))),
            _ => Err(complaint("not an integer")),
        }
    }
}

impl From<Count> for usize {
    fn from(count: Count) -> usize {
        count.0
    }
}

deserialize_scalar!(Count, Count::read, "an integer, 0 or more");

impl Value for Count {
    const KIND: Kind = Kind::Count;
}
