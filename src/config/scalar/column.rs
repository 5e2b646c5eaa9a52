//! Columns of files.

use super::Scalar;
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A column of a file, by its name or by its number from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnId {
    /// By name.
    Name(String),
    /// By number, from 1.
    Number(usize),
}

impl ColumnId {
    const EXPECTED: &'static str = "the name of a column, its number from 1, or a map such as \
                                    {data: other.csv, column: y_m, time: t_s}";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text("") | Scalar::Nothing => Err(Complaint::new(
                "the text is empty",
                "nothing",
                Self::EXPECTED,
            )),
            Scalar::Text(name) => Ok(Self::Name(name.to_owned())),
            Scalar::Integer(number) => match usize::try_from(number) {
                Ok(number) if number > 0 => Ok(Self::Number(number)),
                _ => Err(Complaint::new(
                    "columns are counted from 1",
                    scalar.describe(),
                    Self::EXPECTED,
                )),
            },
            other => Err(Complaint::new(
                "not a column",
                other.describe(),
                Self::EXPECTED,
            )),
        }
    }
}

impl fmt::Display for ColumnId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Number(number) => write!(f, "column {number}"),
        }
    }
}

deserialize_scalar!(ColumnId, ColumnId::read, "a column");

impl Value for ColumnId {
    const KIND: Kind = Kind::Column;
}
