//! Break points.

use super::list::elements;
use super::{Count, Number, Scalar};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Break points: how many, equally spaced over the record, or their times in s.
#[derive(Debug, Clone, PartialEq)]
pub enum Knots {
    /// So many over the record, both ends included.
    Count(Count),
    /// At these times, in s.
    Times(Vec<Number>),
}

impl Knots {
    const EXPECTED: &'static str = "an integer (so many, equally spaced), or a list of times in s";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let count = Count::read(scalar).map(Self::Count);
        count.map_err(|complaint| Complaint {
            expected: Self::EXPECTED.to_owned(),
            ..complaint
        })
    }
}

impl<'de> Deserialize<'de> for Knots {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Knots;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(Knots::EXPECTED)
            }
            scalar_visits!(Knots, Knots::read, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Knots, A::Error> {
                elements(list).map(Knots::Times)
            }
            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<Knots, A::Error> {
                Knots::read(Scalar::Map).map_err(A::Error::custom)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

impl Value for Knots {
    const KIND: Kind = Kind::AnyOf(&[Kind::Count, Kind::List(&Kind::Number)]);
}
