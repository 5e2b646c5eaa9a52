//! Deserialisation of values from YAML with typed errors.
//!
//! The YAML crate reports errors as text with a position. A visitor therefore stores its typed [`Mistake`] in a
//! [`Report`], together with the path of the current key, and raises a placeholder error, to which the crate adds the
//! position.

use super::key::{KeyDoc, ValueType};
use crate::text_io::quote;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::cell::RefCell;
use std::fmt;
use std::marker::PhantomData;

/// A YAML node; lists, maps and tags without their contents.
#[derive(Debug, Clone, Copy)]
pub(super) enum Scalar<'a> {
    Nothing,
    Bool(bool),
    Integer(i128),
    Float(f64),
    Text(&'a str),
    List,
    Map,
    Tag,
}

impl Scalar<'_> {
    /// Its name in messages.
    pub fn describe(self) -> String {
        match self {
            Scalar::Nothing => "nothing".to_owned(),
            Scalar::Bool(value) => format!("the boolean {value}"),
            Scalar::Integer(value) => format!("the integer {value}"),
            Scalar::Float(value) if value.is_nan() => ".nan, which is not a number".to_owned(),
            Scalar::Float(value) if value.is_infinite() => "an infinite number".to_owned(),
            Scalar::Float(value) if value.abs() >= 1e15 => {
                format!("the floating-point number {value:e}")
            }
            Scalar::Float(value) => format!("the floating-point number {value}"),
            Scalar::Text(text) => format!("text {}", quote(text)),
            Scalar::List => "a list".to_owned(),
            Scalar::Map => "a map".to_owned(),
            Scalar::Tag => "a value with a YAML tag (`!…`)".to_owned(),
        }
    }

    /// The error for an invalid value.
    pub fn refused(self, problem: &'static str, expected: impl Into<String>) -> Mistake {
        Mistake::Value {
            problem,
            found: self.describe(),
            expected: expected.into(),
            hint: None,
        }
    }

    /// The error for a value of the wrong type.
    pub fn wrong_kind(self, expected: impl Into<String>) -> Mistake {
        Mistake::Value {
            problem: "wrong type of value",
            found: match self {
                Scalar::Integer(value) => format!("the number {value}"),
                Scalar::Float(value) if value.is_finite() => format!("the number {value}"),
                other => other.describe(),
            },
            expected: expected.into(),
            hint: None,
        }
    }
}

/// An error in well-formed YAML: an unknown, missing or repeated key, or an invalid value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mistake {
    Value {
        problem: &'static str,
        found: String,
        expected: String,
        hint: Option<String>,
    },
    UnknownKey {
        key: String,
        known: Vec<&'static str>,
    },
    MissingKey(&'static str),
    RepeatedKey(&'static str),
}

impl Mistake {
    /// Replaces the description of accepted values.
    pub fn expecting(mut self, change: impl FnOnce(&str) -> String) -> Self {
        if let Self::Value { expected, .. } = &mut self {
            *expected = change(expected);
        }
        self
    }

    /// Adds a suggestion.
    pub fn suggest(mut self, suggestion: Option<String>) -> Self {
        if let Self::Value { hint, .. } = &mut self {
            *hint = suggestion;
        }
        self
    }
}

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

    /// Reads the next key of a map.
    pub fn key<'de, A: MapAccess<'de>>(
        &self,
        map: &mut A,
        keys: &'static [KeyDoc],
    ) -> Result<Option<&'static str>, A::Error> {
        map.next_key_seed(NextKey { keys, report: self })
    }

    /// Reads the value of a key into its field.
    pub fn field<'de, T: Value, A: MapAccess<'de>>(
        &self,
        map: &mut A,
        key: &'static str,
        field: &mut Option<T>,
    ) -> Result<(), A::Error> {
        if field.is_some() {
            return Err(self.raise(Mistake::RepeatedKey(key)));
        }
        let value = || map.next_value_seed(ValueVisitor::new(self));
        *field = Some(self.below(&format!(".{key}"), value)?);
        Ok(())
    }

    /// The value of a field, or the value for an absent key.
    pub fn required<T: Value, E: Error>(
        &self,
        field: Option<T>,
        key: &'static str,
    ) -> Result<T, E> {
        let value = field.map_or_else(|| T::absent(key), Ok);
        value.map_err(|mistake| self.raise(mistake))
    }

    /// Reads the elements of a list.
    pub fn elements<'de, T: Value, A: SeqAccess<'de>>(
        &self,
        mut list: A,
    ) -> Result<Vec<T>, A::Error> {
        let mut elements = Vec::new();
        let mut next = |i| {
            self.below(&format!("[{i}]"), || {
                list.next_element_seed(ValueVisitor::new(self))
            })
        };
        while let Some(element) = next(elements.len())? {
            elements.push(element);
        }
        Ok(elements)
    }
}

/// A type of values in a model file.
pub(super) trait Value: Sized {
    /// Type of the value in the schema.
    const KIND: ValueType;
    /// True for a required key.
    const REQUIRED: bool = true;

    /// The value for an absent key.
    fn absent(key: &'static str) -> Result<Self, Mistake> {
        Err(Mistake::MissingKey(key))
    }

    /// The value from a scalar, or the error; called for lists and maps as well if the type accepts none.
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake>;

    /// The value from a list.
    fn list<'de, A: SeqAccess<'de>>(_: A, report: &Report) -> Result<Self, A::Error> {
        Self::scalar(Scalar::List).map_err(|mistake| report.raise(mistake))
    }

    /// The value from a map.
    fn map<'de, A: MapAccess<'de>>(_: A, report: &Report) -> Result<Self, A::Error> {
        Self::scalar(Scalar::Map).map_err(|mistake| report.raise(mistake))
    }

    /// The value from a YAML node of any type.
    fn read<'de, D: Deserializer<'de>>(
        reader: ValueVisitor<'_, Self>,
        from: D,
    ) -> Result<Self, D::Error> {
        from.deserialize_any(reader)
    }
}

impl<T: Value> Value for Option<T> {
    const KIND: ValueType = T::KIND;
    const REQUIRED: bool = false;
    fn absent(_: &'static str) -> Result<Self, Mistake> {
        Ok(None)
    }
    fn scalar(_: Scalar<'_>) -> Result<Self, Mistake> {
        Ok(None)
    }
    fn read<'de, D: Deserializer<'de>>(
        reader: ValueVisitor<'_, Self>,
        from: D,
    ) -> Result<Self, D::Error> {
        from.deserialize_option(Optional(reader.report, PhantomData))
    }
}

impl<T: Value> Value for Vec<T> {
    const KIND: ValueType = ValueType::List(&T::KIND);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Nothing => Ok(Self::new()),
            other => Err(other.wrong_kind("a list: lines that begin with `- `, or [ … ]")),
        }
    }
    fn list<'de, A: SeqAccess<'de>>(list: A, report: &Report) -> Result<Self, A::Error> {
        report.elements(list)
    }
}

impl Value for bool {
    const KIND: ValueType = ValueType::Bool;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Bool(value) => Ok(value),
            other => Err(other.wrong_kind("true or false")),
        }
    }
}

/// Visitor of a value.
pub(super) struct ValueVisitor<'a, T> {
    report: &'a Report,
    value: PhantomData<T>,
}

impl<'a, T: Value> ValueVisitor<'a, T> {
    /// A visitor that stores its errors in `report`.
    pub fn new(report: &'a Report) -> Self {
        let value = PhantomData;
        Self { report, value }
    }

    fn scalar<E: Error>(self, scalar: Scalar<'_>) -> Result<T, E> {
        T::scalar(scalar).map_err(|mistake| self.report.raise(mistake))
    }
}

impl<'de, T: Value> DeserializeSeed<'de> for ValueVisitor<'_, T> {
    type Value = T;
    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<T, D::Error> {
        T::read(self, from)
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

impl<'de, T: Value> Visitor<'de> for ValueVisitor<'_, T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("text")
    }

    scalar_visits!(T);

    fn visit_enum<A: EnumAccess<'de>>(self, _: A) -> Result<T, A::Error> {
        self.scalar(Scalar::Tag)
    }
    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<T, A::Error> {
        T::list(list, self.report)
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::map(map, self.report)
    }
}

/// Visitor of a key of a map.
struct NextKey<'a> {
    keys: &'static [KeyDoc],
    report: &'a Report,
}

impl<'de> DeserializeSeed<'de> for NextKey<'_> {
    type Value = &'static str;
    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<&'static str, D::Error> {
        from.deserialize_str(self)
    }
}

impl Visitor<'_> for NextKey<'_> {
    type Value = &'static str;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    // An error raised in this visit has the position of the key.
    fn visit_str<E: Error>(self, written: &str) -> Result<&'static str, E> {
        let mut names = self.keys.iter().map(|key| key.name);
        names.clone().find(|name| *name == written).ok_or_else(|| {
            self.report.raise(Mistake::UnknownKey {
                key: written.to_owned(),
                known: names.by_ref().collect(),
            })
        })
    }
}

/// Visitor of an optional value.
struct Optional<'a, T>(&'a Report, PhantomData<T>);

impl<'de, T: Value> Visitor<'de> for Optional<'_, T> {
    type Value = Option<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_none<E: Error>(self) -> Result<Option<T>, E> {
        Ok(None)
    }

    fn visit_some<D: Deserializer<'de>>(self, from: D) -> Result<Option<T>, D::Error> {
        T::read(ValueVisitor::new(self.0), from).map(Some)
    }
}
