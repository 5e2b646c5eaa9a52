//! Parsing of one field of a table: a number, a missing sample, or text.

use crate::error::{InputError, Location};
use crate::text_io::quote;

/// Markers of a missing sample, in lower case; an empty field is one as well. Instruments write the last ones for an overload.
const MISSING: &str = "nan|na|n/a|-|null|#n/a|--|---|----|none|missing|no data|nodata|*|**|***|#nv|#n/v\
    |err|error|ovld|ol|over|overload|overrange";

/// Longest field that is compared with the markers or read with a decimal comma, bytes.
const LONGEST: usize = 64;

/// Content of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Field {
    /// A finite number.
    Number(f64),
    /// Infinity, or a number beyond the largest.
    Infinite,
    /// A missing sample.
    Missing,
    /// Text.
    Text,
}

/// Parses a trimmed field.
pub fn read(field: &str, decimal: char) -> Field {
    match parse(field, decimal) {
        Some(value) if value.is_finite() => Field::Number(value),
        Some(value) if value.is_infinite() => Field::Infinite,
        Some(_) => Field::Missing,
        None if is_missing(field) => Field::Missing,
        None => Field::Text,
    }
}

/// Parses a number with this decimal sign, infinities and NaN included.
fn parse(field: &str, decimal: char) -> Option<f64> {
    let other = if decimal == '.' { ',' } else { '.' };
    let plain = match decimal {
        '.' => field.parse().ok(),
        _ => with_point(field),
    };
    let begins = field.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if plain.is_some() || !begins || field.len() > LONGEST || field.ends_with(',') {
        return plain;
    }
    let (whole, fraction) = field.split_once(decimal).unwrap_or((field, ""));
    if fraction.contains([decimal, other]) {
        return None;
    }
    let groups: Vec<&str> = whole.split([other, '\'', '\u{a0}', '\u{202f}']).collect();
    // One group without a fraction could be a decimal.
    let is_ambiguous = groups.len() == 2 && !field.contains(decimal);
    let is_group = |group: &&str| group.len() == 3 && group.bytes().all(|b| b.is_ascii_digit());
    if is_ambiguous || !groups.iter().skip(1).all(is_group) {
        return None;
    }
    let number = format!("{}.{fraction}", groups.concat());
    let number = match field.contains(decimal) {
        true => number,
        false => groups.concat(),
    };
    // Fortran writes double precision with a D.
    let number: String = number
        .chars()
        .map(|c| if matches!(c, 'D' | 'd') { 'e' } else { c })
        .collect();
    number.parse().ok()
}

/// Parses a number whose decimal sign is a comma.
fn with_point(field: &str) -> Option<f64> {
    let mut bytes = [0; LONGEST];
    let bytes = bytes.get_mut(..field.len())?;
    if field.contains('.') || field.ends_with(',') {
        return None;
    }
    bytes.copy_from_slice(field.as_bytes());
    if let Some(comma) = bytes.iter_mut().find(|b| **b == b',') {
        *comma = b'.';
    }
    std::str::from_utf8(bytes).ok()?.parse().ok()
}

fn is_missing(field: &str) -> bool {
    field.is_empty()
        || MISSING
            .split('|')
            .any(|word| field.eq_ignore_ascii_case(word))
}

/// The error for a field that is not a finite number, where one must be.
pub fn not_a_number(location: Location, field: &str, decimal: char) -> InputError {
    let problem = match parse(field, decimal) {
        Some(_) => "not a finite number",
        None if field.is_empty() => "a number is missing",
        None => "not a number",
    };
    wrong(location, problem, field, decimal).expected("a finite number")
}

/// The error for a field that is neither a finite number nor missing.
pub fn not_a_sample(location: Location, field: &str, decimal: char) -> InputError {
    let expected = "a finite number, or an empty field for a missing sample";
    match parse(field, decimal) {
        Some(_) => wrong(location, "not a finite number", field, decimal)
            .expected(expected)
            .hint("leave the field empty for a missing sample or an overload"),
        None => wrong(location, "not a number", field, decimal).expected(expected),
    }
}

fn wrong(location: Location, problem: &str, field: &str, decimal: char) -> InputError {
    let error = InputError::new(location, problem).found(match field {
        "" => "nothing".to_owned(),
        field => quote(field),
    });
    if field.contains('\n') {
        return error.hint("a quote that is opened in this row is not closed in it");
    }
    let other = if decimal == '.' { ',' } else { '.' };
    match parse(field, other) {
        Some(_) if field.contains(other) => error.hint(match decimal {
            '.' => "write numbers with a decimal point, not a comma",
            _ => "write numbers with a decimal comma, as elsewhere in this file",
        }),
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_classified_by_their_contents() {
        for (text, decimal, field) in [
            ("1.5", '.', Field::Number(1.5)),
            ("1,5", '.', Field::Text),
            ("1,5", ',', Field::Number(1.5)),
            ("-1,5e-3", ',', Field::Number(-1.5e-3)),
            ("1.5", ',', Field::Text),
            ("1,000,5", ',', Field::Text),
            ("7,", ',', Field::Text),
            ("12", ',', Field::Number(12.0)),
            ("1e999", '.', Field::Infinite),
            ("-inf", '.', Field::Infinite),
            ("", '.', Field::Missing),
            ("NaN", ',', Field::Missing),
            ("N/A", '.', Field::Missing),
            ("#N/A", '.', Field::Missing),
            ("null", '.', Field::Missing),
            ("-", '.', Field::Missing),
            ("off", '.', Field::Text),
            ("OVLD", '.', Field::Missing),
            ("---", ',', Field::Missing),
            ("1.5D-03", '.', Field::Number(1.5e-3)),
            ("-1,5d2", ',', Field::Number(-150.0)),
            ("1,234.5", '.', Field::Number(1234.5)),
            ("-1,234,567", '.', Field::Number(-1_234_567.0)),
            ("1.234,5", ',', Field::Number(1234.5)),
            ("1'234.5", '.', Field::Number(1234.5)),
            ("1,234", '.', Field::Text),
            ("12,34.5", '.', Field::Text),
            ("1.2.3", '.', Field::Text),
            ("1D", '.', Field::Text),
        ] {
            assert_eq!(read(text, decimal), field, "{text} {decimal}");
        }
        assert_eq!(
            read(&"1".repeat(70), '.'),
            Field::Number(1.1111111111111111e69)
        );
    }
}
