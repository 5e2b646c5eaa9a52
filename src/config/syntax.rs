//! Error messages for texts that are not YAML: the parser's message replaced by a description and a remedy.

use std::path::Path;

use super::key_positions::location;
use super::key_positions::{self, Position};
use super::scalar::Scalar;
use crate::error::InputError;
use crate::text_io::quote;

/// Message of the YAML parser, its meaning, and the remedy.
const MEANINGS: &[(&str, &str, &str)] = &[
    (
        "mapping values are not allowed in this context",
        "a `:` is not allowed here",
        "check the indentation of this line and the one before; put a text with `: ` in quotes",
    ),
    (
        "did not find expected key",
        "this line does not fit the ones before",
        "check the indentation, and that quotes and brackets before are closed",
    ),
    (
        "did not find expected <document start>",
        "this line does not fit the ones before",
        "check the indentation: keys of one map begin in the same column",
    ),
    (
        "did not find expected '-' indicator",
        "this line is not an element of the list before",
        "begin elements of a list with `- ` in the same column",
    ),
    (
        "block sequence entries are not allowed in this context",
        "a list element is not allowed here",
        "begin the list in a line of its own",
    ),
    (
        "did not find expected ',' or '}'",
        "a `{` is not closed, or a comma is missing",
        "separate the entries of { … } by commas and close the bracket",
    ),
    (
        "did not find expected ',' or ']'",
        "a `[` is not closed, or a comma is missing",
        "separate the elements of [ … ] by commas and close the bracket",
    ),
    (
        "did not find expected node content",
        "a value is missing here",
        "check the commas and brackets, and put special characters in quotes",
    ),
    (
        "could not find expected ':'",
        "a key without `:`",
        "write `key: value`, with a space after the colon",
    ),
    (
        "found unexpected end of stream",
        "a quote is opened and never closed",
        "close the quote",
    ),
    (
        "found unexpected document indicator",
        "a quote is opened and never closed",
        "close the quote",
    ),
    (
        "found unknown escape character",
        "an unknown escape sequence in double quotes",
        "in double quotes write `\\\\` for a backslash, or use single quotes",
    ),
    (
        "found unexpected ':'",
        "a space or a value is missing behind this `:`",
        "write `key: value`, with a space after the colon",
    ),
    (
        "found character that cannot start any token",
        "invalid first character of a value",
        "put the text in quotes",
    ),
    (
        "repetition limit exceeded",
        "the aliases (`*name`) repeat too much",
        "write the values out, and put long lists into CSV files",
    ),
    (
        "unknown anchor",
        "an alias (`*name`) without its anchor (`&name`) before it",
        "put a text that begins with `*` in quotes",
    ),
];

/// The error for a text with a syntax error.
pub(super) fn input_error(file: &Path, text: &str, error: &serde_yaml::Error) -> InputError {
    let message = error.to_string();
    let at = key_positions::position(error).unwrap_or(Position::START);
    if let Some(tab) = tab_before(text, at) {
        return InputError::new(location(file, tab), "a tab is used as indentation")
            .found("a tab")
            .expected("spaces: YAML allows no tabs there")
            .hint("replace every tab at the beginning of a line by spaces");
    }
    if message.contains("control characters are not allowed") {
        return control_character(file, text);
    }
    let mut problem = InputError::new(location(file, at), "the file is not valid YAML").found(
        match line_at(text, at) {
            "" => "the end of the file or an empty line".to_owned(),
            line => quote(line),
        },
    );
    match MEANINGS.iter().find(|(said, ..)| message.contains(said)) {
        Some((_, meaning, hint)) => {
            problem.problem = format!("{}: {meaning}", problem.problem);
            problem = problem.hint(*hint);
        }
        None => problem.problem = format!("{}: {message}", problem.problem),
    }
    match opened_at(&message).filter(|&line| line < at.line) {
        Some(line) => problem.expected(format!("the end of what begins in line {line}")),
        None => problem,
    }
}

/// A list or a map in place of a text, recognised from the message of the YAML crate.
pub(super) fn unexpected(error: &serde_yaml::Error) -> Option<Scalar<'static>> {
    let message = error.to_string();
    let kinds = [("sequence", Scalar::List), ("map", Scalar::Map)];
    let mut kinds = kinds.into_iter();
    kinds.find_map(|(kind, found)| {
        (message.contains(&format!("invalid type: {kind}, expected text"))).then_some(found)
    })
}

/// The error for a character that YAML does not allow. The parser gives no position, so the text is searched.
fn control_character(file: &Path, text: &str) -> InputError {
    let forbidden = |c: char| c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\u{85}');
    let (index, found) = match text.char_indices().find(|&(_, c)| forbidden(c)) {
        Some((index, c)) => (index, format!("the character U+{:04X}", u32::from(c))),
        None => (0, "a control character".to_owned()),
    };
    let at = Position::of(text, index);
    InputError::new(
        location(file, at),
        "a control character is not allowed in YAML",
    )
    .found(found)
    .expected("printable characters")
    .hint("remove the character")
}

/// The rest of the line at a position.
fn line_at(text: &str, at: Position) -> &str {
    let line = text.lines().nth(at.line - 1).unwrap_or_default().trim_end();
    match line.char_indices().nth(at.column - 1) {
        Some((begin, _)) => line[begin..].trim(),
        None => line.trim(),
    }
}

/// The first tab in the indentation of the line at a position, if there is one.
fn tab_before(text: &str, at: Position) -> Option<Position> {
    let line = text.lines().nth(at.line - 1)?;
    let column = line
        .chars()
        .take_while(|c| c.is_whitespace())
        .position(|c| c == '\t')?;
    Some(Position {
        line: at.line,
        column: column + 1,
    })
}

/// The line of the bracket or quote that the parser found unclosed: the last one in its message.
fn opened_at(message: &str) -> Option<usize> {
    if !message.contains("while parsing a flow") && !message.contains("quoted scalar") {
        return None;
    }
    let (_, rest) = message
        .rsplit_once(", while ")?
        .1
        .rsplit_once(" at line ")?;
    rest.split(' ').next()?.parse().ok()
}
