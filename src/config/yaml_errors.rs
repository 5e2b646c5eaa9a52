//! Conversion of errors of the YAML crate and of [`Mistake`]s into [`InputError`]s with file, line, column and key.

use std::path::Path;

use super::input_limits::Checked;
use super::key::{ValueType, model};
use super::key_positions::location;
use super::key_positions::{self, Position, key_path, locate};
use super::reader::{Report, Typed};
use super::retired::successor;
use super::scalar::Mistake;
use super::syntax;
use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::text_io::{one_of, quote};
use kmcfit_core::model::ModelSpec;
use serde::Deserialize;
use serde::de::DeserializeSeed;

/// Reads the keys of a file.
///
/// An error of syntax takes precedence, because it can cause apparent errors in the values before it.
pub(super) fn read(file: &Path, checked: &Checked) -> Result<ModelSpec, InputError> {
    let text = checked.text();
    let report = Report::default();
    let keys = Typed {
        kind: ValueType::Map(model()),
        is_optional: false,
        report: &report,
    };
    let document = serde_yaml::Deserializer::from_str(text);
    let value =
        (keys.deserialize(document)).map_err(|error| input_error(file, text, &error, report))?;
    ModelSpec::deserialize(value).map_err(|error| {
        InputError::file(file, "a model that the schema allows cannot be read").found(error)
    })
}

fn input_error(file: &Path, text: &str, error: &serde_yaml::Error, report: Report) -> InputError {
    if let Some(broken) = key_positions::syntax_error(text) {
        return syntax::input_error(file, text, &broken);
    }
    let at = key_positions::position(error);
    let (key, mistake) = report.into_parts();
    let failure = YamlError {
        file,
        text,
        at,
        key: &key,
    };
    if let Some(mistake) = mistake {
        return failure.mistake(mistake);
    }
    if let Some(at) = key_positions::second_document(text) {
        return failure.several_documents(at);
    }
    let found = syntax::unexpected(error);
    found.map_or_else(
        || syntax::input_error(file, text, error),
        |found| failure.mistake(found.wrong_kind("text")),
    )
}

/// File, text, position and key of an error.
struct YamlError<'a> {
    file: &'a Path,
    text: &'a str,
    at: Option<Position>,
    key: &'a str,
}

impl YamlError<'_> {
    /// An error at the position given by the YAML crate.
    fn here(&self, problem: impl Into<String>) -> InputError {
        self.at_position(self.at.unwrap_or(Position::START), problem)
    }

    /// An error at another position; the key may be empty.
    fn at_position(&self, at: Position, problem: impl Into<String>) -> InputError {
        let error = InputError::new(location(self.file, at), problem);
        match self.key {
            "" => error,
            key => error.key(key),
        }
    }

    fn mistake(&self, mistake: Mistake) -> InputError {
        match mistake {
            Mistake::UnknownKey { key, known } => self.unknown_key(&key, &known),
            Mistake::MissingKey(key) => self.missing_key(key),
            Mistake::RepeatedKey(key) => self.repeated_key(&key),
            Mistake::Value {
                problem,
                found,
                expected,
                hint,
            } => match successor(
                self.key,
                found.trim_start_matches("text ").trim_matches('`'),
            ) {
                Some(successor) => {
                    let error = self.here("this choice was removed").found(found);
                    error.expected(expected).hint(successor)
                }
                None => InputError {
                    hint,
                    ..self.here(problem).found(found).expected(expected)
                },
            },
        }
    }

    /// The error for a file with more than one document.
    fn several_documents(&self, at: Position) -> InputError {
        InputError::new(location(self.file, at), "second YAML document")
            .found("two documents in one file")
            .expected("one model per file")
            .hint("remove the line `---` and what follows, or put it into a file of its own")
    }

    fn unknown_key(&self, key: &str, known: &[&str]) -> InputError {
        if let Some(successor) = successor(&format!("{}.{key}", self.key), "") {
            let error = self.here("this key was removed").found(quote(key));
            return error.hint(successor);
        }
        let error = self
            .here("unknown key")
            .found(quote(key))
            .expected(one_of(known.iter().copied()));
        match key {
            "<<" => error.hint("merging maps by `<<` is not supported: write the keys out"),
            "dt" if self.key == "grid" => {
                error.hint("the step follows from the others: dt = duration/(nodes - 1)")
            }
            key if !key.is_empty() && key.bytes().all(|b| b.is_ascii_digit()) => {
                error.hint("write 1.0 with a decimal point; in { … } a comma separates entries")
            }
            key => match did_you_mean(key, known.iter().copied()) {
                Some(hint) => error.hint(hint),
                None => error,
            },
        }
    }

    fn missing_key(&self, key: &str) -> InputError {
        let path = key_path(self.key);
        let found = locate(self.text, &path);
        let at = found.key.unwrap_or(found.value);
        let error = self
            .at_position(at, format!("the key `{key}` is missing"))
            .expected(match example(key) {
                Some(example) => format!("for instance {example}"),
                None => format!("the key `{key}`"),
            });
        match self.key {
            "" => error.hint("it belongs at the top level of the file, without indentation"),
            _ => error,
        }
    }

    fn repeated_key(&self, key: &str) -> InputError {
        let full = match self.key {
            "" => key.to_owned(),
            parent => format!("{parent}.{key}"),
        };
        let path = key_path(&full);
        let first = locate(self.text, &path);
        let second = key_positions::second_occurrence(self.text, &path)
            .or(self.at)
            .unwrap_or(Position::START);
        let line = first.key.unwrap_or(first.value).line;
        self.at_position(second, format!("duplicate key `{key}`"))
            .found(format!("`{key}` again; it is first given in line {line}"))
            .expected("every key once")
    }
}

/// Example of a required key.
fn example(key: &str) -> Option<&'static str> {
    Some(match key {
        "format" => "`format: 1`",
        "experiments" => "`experiments: [{initial: {displacement: 3.3, velocity: 1.0}}]`",
        "initial" => "`initial: {displacement: 3.3, velocity: 1.0}`",
        "displacement" => "`displacement: 3.3`",
        "velocity" => "`velocity: 1.0`",
        "functions" => "`functions: {mass: …, damping: …, stiffness: …}`",
        "mass" => "`mass: {basis: nodal, start: 2.0}`",
        "damping" => "`damping: {basis: nodal, start: 1.0}`",
        "stiffness" => "`stiffness: {basis: constant, fixed: 1.0}`",
        "basis" => "`basis: nodal`",
        "data" => "`data: file.csv`",
        "column" => "`column: mass_kg`",
        _ => return None,
    })
}
