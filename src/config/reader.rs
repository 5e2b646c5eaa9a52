//! Checks keys and types of a model file against its schema, with typed errors.
//!
//! The YAML crate reports errors as text with a position. A visitor therefore stores its typed [`Mistake`] in a
//! [`Report`], together with the path of the current key, and raises a placeholder error, to which the crate adds the
//! position. What passes is a JSON value of the types that the schema names: names such as 12 or 1.50 keep their spelling, numbers are
//! numbers, keys without a value are left out. Serde reads it into the model.

use super::key::{KeyDoc, ValueType};
use crate::spelling::{did_you_mean, integer_in, number_in};
use crate::text_io::{one_of, quote};
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::cell::RefCell;
use std::fmt;

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
            _ => scalar(self.kind, found).map_err(|mistake| self.report.raise(mistake)),
        }
    }

    /// The alternatives of its type.
    fn kinds(&self) -> &[ValueType] {
        match &self.kind {
            ValueType::AnyOf(kinds) => kinds,
            one => std::slice::from_ref(one),
        }
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
                return Err(report.raise(Mistake::RepeatedKey(key.name)));
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

/// The value of a scalar of a type, or the error; called for lists and maps as well if the type accepts none.
fn scalar(kind: ValueType, found: Scalar<'_>) -> Result<Value, Mistake> {
    let refused = |problem| Err(found.refused(problem, expected(kind)));
    match (kind, found) {
        (ValueType::Format, Scalar::Integer(1)) => Ok(1.into()),
        (ValueType::Format, Scalar::Integer(_)) => Err(found
            .refused("this format version is not supported", "1")
            .suggest(Some("a newer version of kmcfit may read it".to_owned()))),
        (ValueType::Format, _) => refused("not a format number"),
        (ValueType::Number, Scalar::Integer(value)) => Ok((value as f64).into()),
        (ValueType::Number, Scalar::Float(value)) if value.is_finite() => Ok(value.into()),
        (ValueType::Number, Scalar::Float(_)) => refused("not a finite number"),
        (ValueType::Number, Scalar::Text(text)) => Err(found
            .refused("not a number", expected(kind))
            .suggest(number_in(text))),
        (ValueType::Number, _) => refused("not a number"),
        (ValueType::Count, Scalar::Integer(value)) if value < 0 => {
            refused("a count cannot be negative")
        }
        (ValueType::Count, Scalar::Integer(value)) => match usize::try_from(value) {
            Ok(count) => Ok(count.into()),
            Err(_) => refused("the number is too large"),
        },
        (ValueType::Count, Scalar::Float(value))
            if value.fract() == 0.0 && (0.0..1e15).contains(&value) =>
        {
            Err(found
                .refused("not an integer", expected(kind))
                .suggest(Some(format!("write {value}"))))
        }
        (ValueType::Count, Scalar::Text(text)) => Err(found
            .refused("not an integer", expected(kind))
            .suggest(integer_in(text))),
        (ValueType::Count, _) => refused("not an integer"),
        (ValueType::Text | ValueType::Column, Scalar::Text("") | Scalar::Nothing) => {
            Err(Scalar::Nothing.refused("the text is empty", expected(kind)))
        }
        (ValueType::Text | ValueType::Column, Scalar::Text(text)) => Ok(text.into()),
        (ValueType::Text, _) => refused("not a text"),
        (ValueType::Column, Scalar::Integer(number)) => match usize::try_from(number) {
            Ok(number) if number > 0 => Ok(number.into()),
            _ => refused("columns are counted from 1"),
        },
        (ValueType::Column, _) => refused("not a column"),
        (ValueType::Bool, Scalar::Bool(value)) => Ok(value.into()),
        (ValueType::Word(word), Scalar::Text(text)) if text == word => Ok(word.into()),
        (ValueType::Word(word), Scalar::Text(text)) => Err(found
            .wrong_kind(expected(kind))
            .suggest(did_you_mean(text, [word]))),
        (ValueType::Choice(words), Scalar::Text(text)) => {
            let names = || words.iter().map(|(name, _)| *name);
            match names().any(|name| name == text) {
                true => Ok(text.into()),
                false => Err(Mistake::Value {
                    problem: "unknown choice",
                    found: quote(text),
                    expected: expected(kind),
                    hint: did_you_mean(text, names()),
                }),
            }
        }
        (ValueType::Choice(_), _) => refused("not one of the choices"),
        (ValueType::AnyOf(kinds), _) => any_of(kinds, found),
        _ => Err(found.wrong_kind(expected(kind))),
    }
}

/// The value of a scalar of one of several types, or an error: that of the first, for a word that of its choice, with what all of them expect.
/// Text that is written as a number is no name.
fn any_of(kinds: &'static [ValueType], found: Scalar<'_>) -> Result<Value, Mistake> {
    let is_number = |text: &str| number_in(text).is_some();
    let takes_numbers = matches!(kinds[0], ValueType::Number | ValueType::Count);
    let has_word = takes_numbers && kinds.iter().any(|kind| matches!(kind, ValueType::Word(_)));
    let mut first = None;
    for kind in kinds {
        let (is_word, is_name) = match (kind, found) {
            (ValueType::Choice(_), Scalar::Text(text)) => (!is_number(text), true),
            (ValueType::Text, Scalar::Text(text)) => (false, !takes_numbers || !is_number(text)),
            _ => (false, true),
        };
        match scalar(*kind, found) {
            Ok(value) if is_name => return Ok(value),
            Err(mistake) if is_word || first.is_none() => first = Some(mistake),
            _ => {}
        }
    }
    let mut mistake = first.unwrap_or(Mistake::MissingKey("a type"));
    if let Mistake::Value {
        problem,
        expected,
        hint,
        ..
    } = &mut mistake
    {
        *expected = self::expected(ValueType::AnyOf(kinds));
        if has_word && matches!(found, Scalar::Text(text) if !is_number(text) && !text.is_empty()) {
            *problem = "neither a number nor a known word";
        }
        if let Scalar::Text(text) = found {
            let words = kinds.iter().flat_map(|kind| match kind {
                ValueType::Word(word) => vec![*word],
                ValueType::Choice(words) => words.iter().map(|(name, _)| *name).collect(),
                _ => Vec::new(),
            });
            *hint = hint.take().or_else(|| did_you_mean(text, words));
        }
    }
    Err(mistake)
}

/// What is accepted, in words.
fn expected(kind: ValueType) -> String {
    match kind {
        ValueType::Format => "1".into(),
        ValueType::Number => "a finite number".into(),
        ValueType::Count => "an integer, 0 or more".into(),
        ValueType::Text => "text".into(),
        ValueType::Bool => "true or false".into(),
        ValueType::Column => "the name or the number of a column".into(),
        ValueType::Word(word) => format!("`{word}`"),
        ValueType::Choice(words) => one_of(words.iter().map(|(name, _)| *name)),
        ValueType::Map(group) => group.expecting.into(),
        ValueType::List(ValueType::Number) => "a list of numbers".into(),
        ValueType::List(_) => "a list: lines that begin with `- `, or [ … ]".into(),
        ValueType::AnyOf(kinds) => {
            let is_both = kinds.len() == 2 && matches!(kinds[1], ValueType::List(_));
            match is_both {
                true => format!("{}, or a list of them", expected(kinds[0])),
                false => {
                    let is_word = |kind: &&ValueType| matches!(kind, ValueType::Word(_));
                    let words = kinds.iter().filter(is_word);
                    let others = kinds.iter().filter(|kind| !is_word(kind));
                    let all: Vec<String> = others
                        .chain(words)
                        .map(|kind| match kind {
                            // Text beside a number is that of a standard deviation.
                            ValueType::Text => "the name of a column".to_owned(),
                            kind => expected(*kind),
                        })
                        .collect();
                    let last = all.len() - 1;
                    format!("{}, or {}", all[..last].join(", "), all[last])
                }
            }
        }
    }
}
