//! Parsing of one field of a table: a number, a missing sample, or text.

use crate::error::{InputError, Location};
use crate::text_io::quote;

/// Markers of a missing sample, in lower case; an empty field is one as well.
const MISSING: [&str; 7] = ["nan", "na", "n/a", "-", "null", "#n/a", "--"];

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
    if decimal == '.' {
        return field.parse().ok();
    }
    // With a decimal comma a point would be a thousands separator, which is not supported.
    if field.len() > LONGEST || field.contains('.') || field.ends_with(',') {
        return None;
    }
    if !field.contains(',') {
        return field.parse().ok();
    }
    let mut bytes = [0; LONGEST];
    let bytes = &mut bytes[..field.len()];
    bytes.copy_from_slice(field.as_bytes());
    if let Some(comma) = bytes.iter().position(|&b| b == b',') {
        bytes[comma] = b'.';
    }
    std::str::from_utf8(bytes).ok()?.parse().ok()
}

fn is_missing(field: &str) -> bool {
    field.is_empty() || MISSING.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// The error for a field that is not a finite number, where one must be.
pub fn not_a_number(place: Location, field: &str, decimal: char) -> InputError {
    let problem = match parse(field, decimal) {
        Some(_) => "not a finite number",
        None if field.is_empty() => "a number is missing",
        None => "not a number",
    };
    wrong(place, problem, field, decimal).expected("a finite number")
}

/// The error for a field that is neither a finite number nor missing.
pub fn not_a_sample(place: Location, field: &str, decimal: char) -> InputError {
    let expected = "a finite number, or an empty field for a missing sample";
    match parse(field, decimal) {
        Some(_) => wrong(place, "not a finite number", field, decimal)
            .expected(expected)
            .hint("leave the field empty for a missing sample or an overload"),
        None => wrong(place, "not a number", field, decimal).expected(expected),
    }
}

fn wrong(place: Location, problem: &str, field: &str, decimal: char) -> InputError {
    let error = InputError::new(place, problem).found(match field {
        "" => "nothing".to_owned(),
        field => quote(field),
    });
    if field.contains('\n') {
        return error.hint("a quote that is opened in this row is not closed in it");
    }
    if is_clock(field) {
        return error.hint("write times in seconds: dates and times of day are not read");
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

/// True for a date or a time of day such as `12:00:01.5`, `2026-03-01T12:00` or `1.3.2026`.
fn is_clock(field: &str) -> bool {
    let belongs = |c: char| c.is_ascii_digit() || ":-/., TZ+".contains(c);
    let signs = |sign: char| field.chars().filter(|c| *c == sign).count();
    field.len() <= LONGEST
        && field.starts_with(|c: char| c.is_ascii_digit())
        && field.chars().all(belongs)
        && (field.contains(':') || ['-', '/', '.'].into_iter().any(|sign| signs(sign) == 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_times_of_day() {
        for field in [
            "12:00:01.5",
            "9:30",
            "2026-03-01T12:00:00Z",
            "2026-03-01",
            "1/3/2026",
        ] {
            assert!(is_clock(field), "{field}");
        }
        for field in ["12.5", "1e-3-2-", "-1", "a:b", "", ":", "1-2", "3/4"] {
            assert!(!is_clock(field), "{field}");
        }
    }

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
        ] {
            assert_eq!(read(text, decimal), field, "{text} {decimal}");
        }
        assert_eq!(
            read(&"1".repeat(70), '.'),
            Field::Number(1.1111111111111111e69)
        );
    }
}
