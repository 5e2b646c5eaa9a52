//! `kmcfit explain`: documentation of a key as text.

use super::{Found, ValueType, all, model};
use crate::config::retired::successor_of_name;
use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::text_io::quote;
use std::collections::HashSet;
use std::fmt::Write;

/// Most further paths of a key that are listed.
const MOST_PATHS: usize = 4;

/// Documentation of the keys with a name or a path: `tolerance`, `fit.stop`, `experiments[0].sigma`. Without a name, a list
/// of the top-level keys.
///
/// # Errors
/// If no such key.
pub fn explain(name: Option<&str>) -> Result<String, InputError> {
    let Some(name) = name else {
        let mut text =
            String::from("Keys of a model file (`kmcfit explain KEY` explains one):\n\n");
        list(
            &mut text,
            model().keys.iter().map(|key| (key.name, key.text)),
        );
        return Ok(text);
    };
    let wanted = without_positions(name);
    let keys = all();
    let is_meant = |path: &String| *path == wanted || path.ends_with(&format!(".{wanted}"));
    let mut exact: Vec<&Found> = (keys.iter())
        .filter(|f| f.paths.contains(&wanted))
        .collect();
    if exact.is_empty() {
        exact = (keys.iter())
            .filter(|f| f.paths.iter().any(is_meant))
            .collect();
    }
    if exact.is_empty() {
        return Err(unknown(name, &wanted, &keys));
    }
    let texts: Vec<String> = exact.into_iter().map(|f| entry(f, &wanted)).collect();
    Ok(texts.join("\n"))
}

/// A path without positions in lists: `experiments[0].sigma` and `experiments.0.sigma` are
/// `experiments.sigma`.
fn without_positions(path: &str) -> String {
    let part = |part: &str| {
        let key = part.split('[').next().unwrap_or_default().trim();
        (!key.is_empty() && !key.bytes().all(|b| b.is_ascii_digit())).then(|| key.to_owned())
    };
    let parts: Vec<String> = path.split('.').filter_map(part).collect();
    parts.join(".")
}

fn unknown(name: &str, wanted: &str, keys: &[Found]) -> InputError {
    let error = InputError::argument("explain", "unknown key")
        .found(quote(name))
        .expected("a key of a model file, such as `sigma` or `functions.mass`; `kmcfit explain` lists the top-level keys");
    if let Some(successor) = successor_of_name(wanted) {
        return InputError::argument("explain", "this key was removed")
            .found(quote(name))
            .hint(successor);
    }
    let last = wanted.rsplit('.').next().unwrap_or_default();
    let paths = || keys.iter().flat_map(|f| f.paths.iter().map(String::as_str));
    let names = || keys.iter().map(|f| f.key.name);
    match did_you_mean(wanted, paths()).or_else(|| did_you_mean(last, names())) {
        Some(hint) => error.hint(hint),
        None => error,
    }
}

fn entry(found: &Found, wanted: &str) -> String {
    let key = found.key;
    let mut paths: Vec<&str> = found.paths.iter().map(String::as_str).collect();
    // The requested path first, then the shortest.
    paths.sort_by_key(|path| (*path != wanted, path.matches('.').count()));
    let mut known = HashSet::new();
    paths.retain(|path| known.insert(*path));
    let mut text = format!("{}\n  {}\n", paths[0], key.text);
    let mut row = |name: &str, value: &str| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  {name:<8} {value}");
    };
    row(
        "type",
        &match (key.kind, key.range) {
            (ValueType::Count, Some(range)) => format!("an integer, {range}"),
            (kind_of_value, _) => kind(kind_of_value),
        },
    );
    if let Some(unit) = key.unit {
        row("unit", unit);
    }
    match (key.required, key.default) {
        (true, _) => row("default", "none (required)"),
        (false, Some(default)) => row("default", default),
        (false, None) => {}
    }
    for (name, value) in [("range", key.range), ("needs", key.needs)] {
        if let Some(value) = value {
            row(name, value);
        }
    }
    row("example", &format!("{}: {}", key.name, key.example));
    let others = &paths[1..];
    if !others.is_empty() {
        let shown = &others[..others.len().min(MOST_PATHS)];
        let more = match others.len() - shown.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        row("also", &(shown.join(", ") + &more));
    }
    for words in choices(key.kind) {
        text.push('\n');
        list(&mut text, words.iter().copied());
    }
    let mut listed: Vec<&str> = Vec::new();
    for group in key.kind.groups() {
        // A map, or a list of them maps.
        if listed.contains(&group.name) {
            continue;
        }
        listed.push(group.name);
        let heading = match group.text == key.text {
            true => "Keys:",
            false => group.text,
        };
        let _ = write!(text, "\n  {heading}\n");
        list(&mut text, group.keys.iter().map(|key| (key.name, key.text)));
    }
    text
}

/// Names and their texts in two columns.
fn list<'a>(text: &mut String, entries: impl Iterator<Item = (&'a str, &'a str)> + Clone) {
    let width = entries.clone().map(|(name, _)| name.len()).max();
    let width = width.unwrap_or_default();
    for (name, meaning) in entries {
        let _ = writeln!(text, "  {name:<width$}  {meaning}");
    }
}

/// Choices of a type.
fn choices(kind: ValueType) -> Vec<&'static [(&'static str, &'static str)]> {
    match kind {
        ValueType::Choice(words) => vec![words],
        ValueType::AnyOf(kinds) => {
            let mut all: Vec<_> = kinds.iter().flat_map(|kind| choices(*kind)).collect();
            all.dedup();
            all
        }
        _ => Vec::new(),
    }
}

/// A type as text.
fn kind(kind: ValueType) -> String {
    match kind {
        ValueType::Format => "the number 1".into(),
        ValueType::Number => "a number".into(),
        ValueType::Count => "an integer, 0 or more".into(),
        ValueType::Text => "text".into(),
        ValueType::Bool => "true or false".into(),
        ValueType::Column => "a column, by name or by number from 1".into(),
        ValueType::Word(word) => format!("`{word}`"),
        ValueType::Choice(_) => "one of the values below".into(),
        ValueType::Map(_) => "a map with the keys below".into(),
        ValueType::Names(_) => "a map of names, each with the keys below".into(),
        ValueType::List(ValueType::Map(_)) => "a list of maps with the keys below".into(),
        ValueType::List(ValueType::Number) => "a list of numbers".into(),
        ValueType::List(ValueType::Text) => "a list of texts".into(),
        ValueType::List(_) => "a list of the values below".into(),
        ValueType::AnyOf(kinds) => {
            let kinds: Vec<String> = kinds.iter().map(|k| self::kind(*k)).collect();
            kinds.join(", or ")
        }
    }
}
