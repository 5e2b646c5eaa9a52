//! One of something, or a list of it.

use super::{FromScalar, Scalar};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Elements of a list, each with its own place in messages.
pub(super) fn elements<'de, T: Deserialize<'de>, A: SeqAccess<'de>>(
    mut list: A,
) -> Result<Vec<T>, A::Error> {
    let mut elements = Vec::new();
    while let Some(element) = list.next_element()? {
        elements.push(element);
    }
    Ok(elements)
}

/// One map, or a list of such maps.
#[derive(Debug, Clone, PartialEq)]
pub enum OneOrMany<T> {
    /// One map.
    One(T),
    /// A list of maps.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// Every map with its place behind the key: nothing, or an index such as `[1]`.
    pub fn iter(&self) -> impl Iterator<Item = (String, &T)> {
        let (list, indexed) = match self {
            Self::One(one) => (std::slice::from_ref(one), false),
            Self::Many(list) => (list.as_slice(), true),
        };
        list.iter().enumerate().map(move |(i, one)| {
            let place = if indexed {
                format!("[{i}]")
            } else {
                String::new()
            };
            (place, one)
        })
    }

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Err(Complaint::new(
            "this is the wrong kind of value",
            scalar.describe(),
            "a map, or a list of maps",
        ))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = OneOrMany<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map, or a list of maps")
            }
            scalar_visits!(OneOrMany<T>, OneOrMany::read, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMany<T>, A::Error> {
                elements(list).map(OneOrMany::Many)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<OneOrMany<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(OneOrMany::One)
            }
        }
        deserializer.deserialize_any(Reader(std::marker::PhantomData))
    }
}

/// One value, or a list of values.
#[derive(Debug, Clone, PartialEq)]
pub enum OneOrList<T> {
    /// One value.
    One(T),
    /// A list.
    List(Vec<T>),
}

impl<T> OneOrList<T> {
    /// The values.
    pub fn values(&self) -> &[T] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::List(list) => list,
        }
    }

    /// The key of value `i` below the key of them all: nothing, or an index such as `[1]`.
    pub fn place(&self, i: usize) -> String {
        match self {
            Self::One(_) => String::new(),
            Self::List(_) => format!("[{i}]"),
        }
    }
}

fn one_or_list<T: FromScalar>(scalar: Scalar<'_>) -> Result<OneOrList<T>, Complaint> {
    let value = T::from_scalar(scalar).map(OneOrList::One);
    value.map_err(|complaint| Complaint {
        expected: format!("{}, or a list of such", complaint.expected),
        ..complaint
    })
}

impl<'de, T: FromScalar + Deserialize<'de>> Deserialize<'de> for OneOrList<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T>(std::marker::PhantomData<T>);
        impl<'de, T: FromScalar + Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = OneOrList<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("one value, or a list of values")
            }
            scalar_visits!(OneOrList<T>, one_or_list, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrList<T>, A::Error> {
                elements(list).map(OneOrList::List)
            }
            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<OneOrList<T>, A::Error> {
                one_or_list(Scalar::Map).map_err(A::Error::custom)
            }
        }
        deserializer.deserialize_any(Reader(std::marker::PhantomData))
    }
}

impl<T: Value> Value for OneOrList<T> {
    const KIND: Kind = Kind::AnyOf(&[T::KIND, Kind::List(&T::KIND)]);
}

impl<T: Value> Value for OneOrMany<T> {
    const KIND: Kind = Kind::AnyOf(&[T::KIND, Kind::List(&T::KIND)]);
}
