//! Limits on a YAML text that are checked before the YAML crate parses it: length, nesting, aliases and repeated
//! anchors. Beyond them the crate takes quadratic time, unbounded memory, or returns wrong values.

use std::collections::BTreeMap;
use std::path::Path;

use super::key_positions::Position;
use super::key_positions::location;
use crate::error::InputError;
use crate::text_io::{binary_size, quote};
use serde::de::DeserializeOwned;

/// Longest model file that is read, in bytes.
///
/// A model file is written by hand and takes a few kilobytes; samples belong in CSV files. The limit rejects a data
/// file given by mistake before it is parsed as YAML.
pub(super) const LONGEST_MODEL: u64 = 1 << 18;

/// Most brackets that may be open at once.
///
/// A model needs four. The YAML crate takes time quadratic in the number of open brackets, minutes
/// for a file full of them.
const MOST_OPEN_BRACKETS: usize = 200;

/// Most aliases (`*name`), and as many anchors (`&name`), in a file.
///
/// A model needs a dozen. Each alias repeats its anchored value, which the YAML crate limits to a hundred for each value of the
/// file.
const MOST_ALIASES: usize = 1000;

/// Longest file with aliases, bytes: each repeats a value of at most this length.
const LONGEST_WITH_ALIASES: usize = 1 << 14;

/// A text within the limits of [`check`]; only such texts are deserialised.
pub(super) struct Checked<'a>(&'a str);

impl<'a> Checked<'a> {
    /// Checks a text; messages name `file`.
    pub(super) fn new(file: &Path, text: &'a str) -> Result<Self, InputError> {
        check(file, text)?;
        Ok(Self(text))
    }

    /// The text.
    pub(super) fn text(&self) -> &'a str {
        self.0
    }

    /// The value of the text.
    #[allow(clippy::disallowed_methods, reason = "the text is checked")]
    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<T, serde_yaml::Error> {
        serde_yaml::from_str(self.0)
    }
}

/// Refuses a text that is too long, nested too deeply, repeats too much, or gives an anchor twice.
pub(super) fn check(file: &Path, text: &str) -> Result<(), InputError> {
    if text.len() as u64 > LONGEST_MODEL {
        return Err(InputError::file(file, "the model file is too large")
            .found(binary_size(text.len() as u64))
            .expected(format!("at most {}", binary_size(LONGEST_MODEL)))
            .hint("put samples into CSV files"));
    }
    check_brackets(file, text)?;
    check_anchors(file, text)
}

fn check_brackets(file: &Path, text: &str) -> Result<(), InputError> {
    let mut open = 0_usize;
    for (index, c) in text.char_indices() {
        match c {
            '[' | '{' => open += 1,
            ']' | '}' => open = open.saturating_sub(1),
            _ => {}
        }
        if open > MOST_OPEN_BRACKETS {
            let at = location(file, Position::of(text, index));
            return Err(InputError::new(at, "too many open brackets")
                .found(format!(
                    "more than {MOST_OPEN_BRACKETS} brackets not closed"
                ))
                .expected("every `[` and `{` closed"));
        }
    }
    Ok(())
}

/// Refuses an anchor (`&name`) that is given twice in a text with aliases (`*name`).
///
/// YAML allows it, but yaml_serde 0.10 then gives wrong values to aliases: after `&a`, `&a`, `&b` the alias `*a` has
/// the value of `&b`. Quoted texts such as `'x &a'` count as well.
fn check_anchors(file: &Path, text: &str) -> Result<(), InputError> {
    if names(text, '*').next().is_none() {
        return Ok(());
    }
    if text.len() > LONGEST_WITH_ALIASES {
        return Err(
            InputError::file(file, "the model file with aliases is too large")
                .found(binary_size(text.len() as u64))
                .expected(format!(
                    "at most {}",
                    binary_size(LONGEST_WITH_ALIASES as u64)
                ))
                .hint("write the values out, or put samples and long lists into CSV files"),
        );
    }
    for mark in ['*', '&'] {
        if let Some((index, _)) = names(text, mark).nth(MOST_ALIASES) {
            let at = location(file, Position::of(text, index));
            return Err(InputError::new(at, "too many aliases or anchors")
                .found(format!("more than {MOST_ALIASES} times `{mark}name`"))
                .expected(format!("at most {MOST_ALIASES}")));
        }
    }
    let mut seen = BTreeMap::new();
    for (index, name) in names(text, '&') {
        let here = Position::of(text, index);
        if let Some(first) = seen.insert(name, here) {
            return Err(InputError::new(location(file, here), "duplicate anchor")
                .found(format!(
                    "{} again; it is first given in line {}",
                    quote(&format!("&{name}")),
                    first.line
                ))
                .expected("every anchor once")
                .hint("rename one of them"));
        }
    }
    Ok(())
}

/// The words that begin with `mark` where a value can begin, outside comment lines.
fn names(text: &str, mark: char) -> impl Iterator<Item = (usize, &str)> {
    let mut line_begin = 0;
    // All characters that end a line, and so a comment, in YAML 1.1.
    let ends = ['\n', '\r', '\u{85}', '\u{2028}', '\u{2029}'];
    let lines = text.split_inclusive(ends).map(move |line| {
        let begin = line_begin;
        line_begin += line.len();
        (begin, line)
    });
    let lines = lines.filter(|(_, line)| !line.trim_start().starts_with('#'));
    lines.flat_map(move |(begin, line)| {
        line.match_indices(mark).filter_map(move |(index, _)| {
            let before = line[..index].chars().next_back();
            // Only marks at the begin of a value count; a search from every mark would take quadratic time.
            let begins = before.is_none_or(|c| c.is_whitespace() || "[{,:-?".contains(c));
            let rest = begins.then(|| &line[index + 1..])?;
            let name = rest
                .split(|c: char| c.is_whitespace() || "[]{},".contains(c))
                .next()?;
            (!name.is_empty()).then_some((begin + index, name))
        })
    })
}
