//! Errors of the YAML crate in the program's own words.

use std::path::Path;

use super::complaint::Complaint;
use super::locate::place;
use super::locate::{self, Position, key_path, locate};
use super::scalar::Scalar;
use super::syntax;
use crate::error::InputError;
use crate::input::{one_of, quote};
use crate::near::did_you_mean;

/// Turns an error of the YAML crate about `text` into one that says where and what.
///
/// A mistake of syntax comes first: what the values before it seem to be may be its consequence.
pub(super) fn input_error(file: &Path, text: &str, error: &serde_yaml::Error) -> InputError {
    if let Some(broken) = locate::syntax_error(text) {
        return syntax::input_error(file, text, &broken);
    }
    let failure = Failure {
        file,
        text,
        at: locate::position(error),
    };
    let message = without_position(error);
    if let Some(complaint) = Complaint::decode(&message) {
        return failure.complaint(key_before_complaint(&message), complaint);
    }
    if let Some(at) = locate::second_document(text) {
        return failure.several_documents(at);
    }
    let (key, message) = split_key(&message);
    failure
        .about_keys(key, message)
        .or_else(|| failure.wrong_kind(key, message))
        .unwrap_or_else(|| syntax::input_error(file, text, error))
}

/// The message of an error without the line and column at its end.
fn without_position(error: &serde_yaml::Error) -> String {
    let message = error.to_string();
    match locate::position(error) {
        Some(Position { line, column }) => {
            let suffix = format!(" at line {line} column {column}");
            message
                .strip_suffix(&suffix)
                .map(str::to_owned)
                .unwrap_or(message)
        }
        None => message,
    }
}

/// The key that the YAML crate wrote before a complaint.
fn key_before_complaint(message: &str) -> &str {
    let before = message.split('\u{2}').next().unwrap_or_default();
    before.strip_suffix(": ").unwrap_or(before)
}

/// `experiments[0].initial: message` as its two parts; the key may be missing.
fn split_key(message: &str) -> (&str, &str) {
    let is_key = |key: &str| {
        key.chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-.[]?".contains(c))
    };
    match message.split_once(": ") {
        Some((key, rest)) if is_key(key) => (key, rest),
        _ => ("", message),
    }
}

/// An error in the making.
struct Failure<'a> {
    file: &'a Path,
    text: &'a str,
    at: Option<Position>,
}

impl Failure<'_> {
    /// An error at the position that the YAML crate gave.
    fn here(&self, key: &str, problem: impl Into<String>) -> InputError {
        self.at_position(self.at.unwrap_or(Position::START), key, problem)
    }

    /// An error at a position; `key` may be empty.
    fn at_position(&self, at: Position, key: &str, problem: impl Into<String>) -> InputError {
        let error = InputError::new(place(self.file, at), problem);
        match key {
            "" => error,
            key => error.key(key),
        }
    }

    /// A value's own complaint.
    fn complaint(&self, key: &str, complaint: Complaint) -> InputError {
        let mut error = self.here(key, complaint.problem);
        let said = |text: String| Some(text).filter(|text| !text.is_empty());
        error.found = said(complaint.found);
        error.expected = said(complaint.expected);
        error.hint = said(complaint.hint);
        error
    }

    /// More than one document in a file.
    fn several_documents(&self, at: Position) -> InputError {
        self.at_position(at, "", "a second document begins here")
            .found("two documents in one file")
            .expected("one model per file")
            .hint("remove the line `---` and what follows, or put it into a file of its own")
    }

    /// Unknown, missing and repeated keys.
    fn about_keys(&self, parent: &str, message: &str) -> Option<InputError> {
        if let Some(rest) = message.strip_prefix("unknown field `") {
            let (key, known) = rest.rsplit_once("`, expected ")?;
            return Some(self.unknown_key(parent, key, known));
        }
        let named = |prefix| {
            let rest: &str = message.strip_prefix(prefix)?;
            rest.strip_suffix('`')
        };
        if let Some(key) = named("missing field `") {
            return Some(self.missing_key(parent, key));
        }
        named("duplicate field `").map(|key| self.repeated_key(parent, key))
    }

    fn unknown_key(&self, parent: &str, key: &str, known: &str) -> InputError {
        // serde writes "one of `a`, `b`", "`a` or `b`" or "`a`": the names are between backticks.
        let known: Vec<&str> = known.split('`').skip(1).step_by(2).collect();
        let error = self
            .here(parent, "unknown key")
            .found(quote(key))
            .expected(one_of(known.iter().copied()));
        match key {
            "<<" => error.hint("merging maps by `<<` is not supported: write the keys out"),
            "story" if parent.is_empty() => {
                error.hint("a file with a `story` is for `kmcfit study`")
            }
            "dt" if parent == "grid" => {
                error.hint("the step follows from the others: dt = duration/(nodes - 1)")
            }
            key => match did_you_mean(key, known) {
                Some(hint) => error.hint(hint),
                None => error,
            },
        }
    }

    fn missing_key(&self, parent: &str, key: &str) -> InputError {
        let path = key_path(parent);
        let found = locate(self.text, &path);
        let at = found.key.unwrap_or(found.value);
        let error = self
            .at_position(at, parent, format!("the key `{key}` is missing"))
            .expected(match example(key) {
                Some(example) => format!("for instance {example}"),
                None => format!("the key `{key}`"),
            });
        match parent {
            "" => error.hint("it belongs at the top level of the file, without indentation"),
            _ => error,
        }
    }

    fn repeated_key(&self, parent: &str, key: &str) -> InputError {
        let full = match parent {
            "" => key.to_owned(),
            parent => format!("{parent}.{key}"),
        };
        let path = key_path(&full);
        let first = locate(self.text, &path);
        let second = locate::second_occurrence(self.text, &path)
            .or(self.at)
            .unwrap_or(Position::START);
        let line = first.key.unwrap_or(first.value).line;
        self.at_position(second, parent, format!("duplicate key `{key}`"))
            .found(format!("`{key}` again; it is first given in line {line}"))
            .expected("every key once")
    }

    /// A list where a map should be, and the like.
    fn wrong_kind(&self, key: &str, message: &str) -> Option<InputError> {
        let kinds = ["invalid type: ", "invalid value: ", "invalid length "];
        let rest = kinds.iter().find_map(|kind| message.strip_prefix(kind))?;
        let (found, expected) = rest.rsplit_once(", expected ")?;
        let expected = match expected {
            "a sequence" => "a list: lines that begin with `- `, or [ … ]",
            "a boolean" => "true or false",
            other => other,
        };
        Some(
            self.here(key, "this is the wrong kind of value")
                .found(kind(found))
                .expected(expected),
        )
    }
}

/// serde's description of a value in the words used elsewhere.
fn kind(found: &str) -> String {
    let between = |mark: char| {
        let (_, rest) = found.split_once(mark)?;
        rest.strip_suffix(mark)
    };
    match found {
        "sequence" => Scalar::List.describe(),
        "map" => Scalar::Map.describe(),
        "unit value" => Scalar::Nothing.describe(),
        "enum" => Scalar::Tag.describe(),
        _ if found.starts_with("string ") => match between('"') {
            Some(text) => Scalar::Text(text).describe(),
            None => "text".to_owned(),
        },
        _ => match between('`') {
            Some(value) if found.starts_with("boolean") => format!("the truth value {value}"),
            Some(value) => format!("the number {value}"),
            None => found.to_owned(),
        },
    }
}

/// How a required key is written.
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
