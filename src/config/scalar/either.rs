//! One value, or a map that says more.

use super::{FromScalar, Scalar};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// One value, or a map that says more.
#[derive(Debug, Clone, PartialEq)]
pub enum ScalarOr<S, M> {
    /// One value.
    Scalar(S),
    /// A map.
    Map(M),
}

fn read<S: FromScalar, M>(scalar: Scalar<'_>) -> Result<ScalarOr<S, M>, Complaint> {
    S::from_scalar(scalar).map(ScalarOr::Scalar)
}

impl<'de, S: FromScalar, M: Deserialize<'de>> Deserialize<'de> for ScalarOr<S, M> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<S, M>(std::marker::PhantomData<(S, M)>);
        impl<'de, S: FromScalar, M: Deserialize<'de>> Visitor<'de> for Reader<S, M> {
            type Value = ScalarOr<S, M>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("one value, or a map")
            }
            scalar_visits!(ScalarOr<S, M>, read);
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ScalarOr<S, M>, A::Error> {
                M::deserialize(MapAccessDeserializer::new(map)).map(ScalarOr::Map)
            }
        }
        deserializer.deserialize_any(Reader(std::marker::PhantomData))
    }
}

impl<A: Value, B: Value> Value for ScalarOr<A, B> {
    const KIND: Kind = Kind::AnyOf(&[A::KIND, B::KIND]);
}
