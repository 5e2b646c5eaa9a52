//! Numbers of nodes.

use super::{Count, Scalar};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// How many nodes a grid has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nodes {
    /// So many.
    Count(Count),
    /// As many as the frequency content of the data asks for.
    Auto,
}

impl Nodes {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text("auto") => Ok(Self::Auto),
            other => Count::read(other)
                .map(Self::Count)
                .map_err(|complaint| Complaint {
                    expected: format!("{}, or `auto`", complaint.expected),
                    ..complaint
                }),
        }
    }
}

deserialize_scalar!(Nodes, Nodes::read, "an integer or `auto`");

impl Value for Nodes {
    const KIND: Kind = Kind::AnyOf(&[Kind::Count, Kind::Word("auto")]);
}
