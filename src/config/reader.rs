//! Checks keys and types of a model file against its schema, with typed errors.
//!
//! The YAML crate reports errors as text with a position. A visitor therefore stores its typed [`Mistake`] in a
//! [`Report`], together with the path of the current key, and raises a placeholder error, to which the crate adds the
//! position. What passes is a JSON value of the types that the schema names: names such as 12 or 1.50 keep their spelling, numbers are
//! numbers, keys without a value are left out. Serde reads it into the model.

use super::key::{KeyDoc, ValueType};
use super::scalar::{Mistake, Scalar, typed};
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::cell::RefCell;
use std::fmt;

/// Path of the key that is being read, and the error in its value.
#[derive(Debug, Default)]
pub(super) struct Report {
    path: RefCell<String>,
    mistake: RefCell<Option<Mistake>>,
}

impl Report {
    /// The key and the error.
    pub fn into_parts(self) -> (String, Option<Mistake>) {
        (self.path.into_inner(), self.mistake.into_inner())
    }

    /// Stores an error and raises a placeholder, to which the YAML crate adds the position.
    pub fn raise<E: Error>(&self, mistake: Mistake) -> E {
        *self.mistake.borrow_mut() = Some(mistake);
        E::custom("a value is refused")
    }

    /// Reads a value one segment further down: `.key` or `[0]`.
    fn below<T, E>(&self, segment: &str, read: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let above = self.path.borrow().len();
        *self.path.borrow_mut() += match above {
            0 => segment.trim_start_matches('.'),
            _ => segment,
        };
        let value = read()?;
        self.path.borrow_mut().truncate(above);
        Ok(value)
    }
}

/// Implements the scalar methods of a visitor by its method `scalar`.
macro_rules! scalar_visits {
    ($result:ty) => {
        fn visit_unit<E: Error>(self) -> Result<$result, E> {
            self.scalar(Scalar::Nothing)
        }
        fn visit_none<E: Error>(self) -> Result<$result, E> {
            self.scalar(Scalar::Nothing)
        }
        fn visit_bool<E: Error>(self, value: bool) -> Result<$result, E> {
            self.scalar(Scalar::Bool(value))
        }
        fn visit_u64<E: Error>(self, value: u64) -> Result<$result, E> {
            self.scalar(Scalar::Integer(value.into()))
        }
        fn visit_i64<E: Error>(self, value: i64) -> Result<$result, E> {
            self.scalar(Scalar::Integer(value.into()))
        }
        fn visit_i128<E: Error>(self, value: i128) -> Result<$result, E> {
            self.scalar(Scalar::Integer(value))
        }
        fn visit_u128<E: Error>(self, value: u128) -> Result<$result, E> {
            let integer = i128::try_from(value).map(Scalar::Integer);
            self.scalar(integer.unwrap_or(Scalar::Float(value as f64)))
        }
        fn visit_f64<E: Error>(self, value: f64) -> Result<$result, E> {
            self.scalar(Scalar::Float(value))
        }
        fn visit_str<E: Error>(self, value: &str) -> Result<$result, E> {
            self.scalar(Scalar::Text(value))
        }
    };
}
pub(super) use scalar_visits;

/// A value of a type, or nothing in its place.
#[derive(Clone, Copy)]
pub(super) struct Typed<'a> {
    pub kind: ValueType,
    pub is_optional: bool,
    pub report: &'a Report,
}

impl<'a> Typed<'a> {
    fn scalar<E: Error>(self, found: Scalar<'_>) -> Result<Value, E> {
        match (found, self.is_optional) {
            (Scalar::Nothing, true) => Ok(Value::Null),
            _ => typed(self.kind, found).map_err(|mistake| self.report.raise(mistake)),
        }
    }

    /// The alternatives of its type.
    fn kinds(&self) -> &[ValueType] {
        match &self.kind {
            ValueType::AnyOf(kinds) => kinds,
            one => std::slice::from_ref(one),
        }
    }

    /// Values of its type by names: a list of pairs, which keeps their order.
    fn names<'de, A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut read: Vec<String> = Vec::new();
        let mut pairs = Vec::new();
        while let Some(name) = map.next_key::<String>()? {
            if read.contains(&name) {
                return Err(self.report.raise(Mistake::RepeatedKey(name)));
            }
            let value = || map.next_value_seed(self);
            let value = self.report.below(&format!(".{name}"), value)?;
            pairs.push(Value::Array(vec![Value::String(name.clone()), value]));
            read.push(name);
        }
        Ok(Value::Array(pairs))
    }

    fn of(self, kind: ValueType, is_optional: bool) -> Self {
        Self {
            kind,
            is_optional,
            ..self
        }
    }
}

impl<'de> DeserializeSeed<'de> for Typed<'_> {
    type Value = Value;
    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        match self.kind {
            _ if self.is_optional => from.deserialize_option(self),
            // As text, so that a name such as 12 or 1.50 keeps its spelling.
            ValueType::Text => from.deserialize_str(self),
            _ => from.deserialize_any(self),
        }
    }
}

impl<'de> Visitor<'de> for Typed<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("text")
    }

    scalar_visits!(Value);

    fn visit_some<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        self.of(self.kind, false).deserialize(from)
    }

    fn visit_enum<A: EnumAccess<'de>>(self, _: A) -> Result<Value, A::Error> {
        self.scalar(Scalar::Tag)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut kinds = self.kinds().iter();
        let inner = kinds.find_map(|kind| match kind {
            ValueType::List(inner) => Some(**inner),
            _ => None,
        });
        let Some(inner) = inner else {
            return self.scalar(Scalar::List);
        };
        let element = self.of(inner, false);
        let mut elements = Vec::new();
        let mut next = |i| {
            let next = || list.next_element_seed(element);
            self.report.below(&format!("[{i}]"), next)
        };
        while let Some(element) = next(elements.len())? {
            elements.push(element);
        }
        Ok(Value::Array(elements))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let named = self.kinds().iter().find_map(|kind| match kind {
            ValueType::Names(inner) => Some(**inner),
            _ => None,
        });
        if let Some(inner) = named {
            return self.of(inner, false).names(map);
        }
        let mut kinds = self.kinds().iter();
        let group = kinds.find_map(|kind| match kind {
            ValueType::Map(group) => Some(*group),
            _ => None,
        });
        let Some(group) = group else {
            return self.scalar(Scalar::Map);
        };
        let (keys, report) = (group.keys, self.report);
        let mut read = vec![false; keys.len()];
        let mut object = Map::new();
        while let Some(i) = map.next_key_seed(NextKey { keys, report })? {
            let key = &keys[i];
            if std::mem::replace(&mut read[i], true) {
                return Err(report.raise(Mistake::RepeatedKey(key.name.to_owned())));
            }
            let value = || map.next_value_seed(self.of(key.kind, key.nullable));
            let value = report.below(&format!(".{}", key.name), value)?;
            if !value.is_null() {
                object.insert(key.name.to_owned(), value);
            }
        }
        let missing = keys
            .iter()
            .zip(read)
            .find(|(key, read)| key.required && !read);
        match missing {
            Some((key, _)) => Err(report.raise(Mistake::MissingKey(key.name))),
            None => Ok(Value::Object(object)),
        }
    }
}

/// Visitor of a key of a map; gives its index.
struct NextKey<'a> {
    keys: &'static [KeyDoc],
    report: &'a Report,
}

impl<'de> DeserializeSeed<'de> for NextKey<'_> {
    type Value = usize;
    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<usize, D::Error> {
        from.deserialize_str(self)
    }
}

impl Visitor<'_> for NextKey<'_> {
    type Value = usize;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    // An error raised in this visit has the position of the key.
    fn visit_str<E: Error>(self, written: &str) -> Result<usize, E> {
        let mut names = self.keys.iter().map(|key| key.name);
        let position = names.clone().position(|name| name == written);
        position.ok_or_else(|| {
            self.report.raise(Mistake::UnknownKey {
                key: written.to_owned(),
                known: names.by_ref().collect(),
            })
        })
    }
}
