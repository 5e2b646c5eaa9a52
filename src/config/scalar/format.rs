//! The version of the file format.

use super::Scalar;
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// The version of the file format: 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format;

impl Format {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Integer(1) => Ok(Self),
            Scalar::Integer(_) => Err(Complaint::new(
                "this version of the program cannot read that format",
                scalar.describe(),
                "1",
            )
            .hint(Some("a newer version of the program may".to_owned()))),
            other => Err(Complaint::new("not a format number", other.describe(), "1")),
        }
    }
}

deserialize_scalar!(Format, Format::read, "the format number 1");

impl Value for Format {
    const KIND: Kind = Kind::Format;
}
