//! A node of a model file, its value by the type that the schema names, and the error where it has none.

use super::key::ValueType;
use crate::spelling::{did_you_mean, integer_in, number_in};
use crate::text_io::{one_of, quote};
use serde_json::Value;

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
    RepeatedKey(String),
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

/// The value of a scalar of a type, or the error; called for lists and maps as well if the type accepts none.
pub(super) fn typed(kind: ValueType, found: Scalar<'_>) -> Result<Value, Mistake> {
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
        match typed(*kind, found) {
            Ok(value) if is_name => return Ok(value),
            Err(mistake) if is_word || first.is_none() => first = Some(mistake),
            _ => {}
        }
    }
    let mut mistake = first.unwrap_or_else(|| found.wrong_kind(""));
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
        ValueType::Names(_) => "a map of names with a value each".into(),
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
