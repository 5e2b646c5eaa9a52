//! Text helpers: estimated widths, superscripts, tick labels, and escaping for XML.

/// Estimated width of `text` in pixels at a font size; an upper estimate for common sans-serif fonts.
pub(super) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(|c| size * em(c)).sum()
}

/// Estimated advance of one character in units of the font size.
fn em(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' => 0.33,
        '(' | ')' | '[' | ']' | '/' | 'f' | 't' | 'r' | '-' => 0.42,
        '⁰'..='⁹' | '²' | '³' | '¹' | '⁻' => 0.42,
        'm' | 'w' | 'M' | 'W' | '×' | '−' => 0.9,
        'A'..='Z' => 0.7,
        _ => 0.63,
    }
}

/// An integer in superscript characters: -4 gives `⁻⁴`.
pub(super) fn superscript(exponent: i64) -> String {
    let raise = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        '4'..='9' => char::from_u32('⁴' as u32 + c as u32 - '4' as u32).unwrap_or(c),
        other => other,
    };
    exponent.to_string().chars().map(raise).collect()
}

/// A power of ten: `10⁻⁴`.
pub(super) fn decade(exponent: i64) -> String {
    format!("10{}", superscript(exponent))
}

/// Label of a tick, with the digits that steps of `step` need. `largest` is the largest magnitude on the axis and
/// determines the notation of all labels: with or without a power of ten.
pub(super) fn tick(value: f64, step: f64, largest: f64) -> String {
    let order = magnitude(largest);
    let positions = magnitude(step);
    // Removes the sign of zero.
    let value = value + 0.0;
    if (-3..5).contains(&order) {
        return minus(&format!("{value:.*}", digits(-positions)));
    }
    if value == 0.0 {
        return "0".to_string();
    }
    let mantissa = value / 10f64.powi(order as i32);
    let mantissa = minus(&format!("{mantissa:.*}", digits(order - positions)));
    format!("{mantissa}×{}", decade(order))
}

/// The decimal order of magnitude; the small shift keeps powers of ten from falling below.
fn magnitude(value: f64) -> i64 {
    (value.abs().log10() + 1e-9).floor() as i64
}

fn digits(positions: i64) -> usize {
    positions.clamp(0, 15) as usize
}

/// Writes a true minus sign.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}

/// The font size, at most `size` and at least half of it, at which `text` fits into a width in pixels.
pub(super) fn fit(text: &str, size: f64, room: f64) -> f64 {
    let share = room / width(text, size).max(1.0);
    size * share.clamp(0.5, 1.0)
}

/// Removes the characters that XML forbids.
pub(super) fn clean(text: &str) -> String {
    let allowed = |c: &char| {
        (!c.is_control() || *c == '\n' || *c == '\t') && !matches!(c, '\u{fffe}' | '\u{ffff}')
    };
    text.chars().filter(allowed).collect()
}

/// Escapes text for XML content and attributes.
pub(crate) fn escape(text: &str) -> String {
    clean(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&apos;")
}

/// [`escape`] for a sentence in a page; text between backquotes becomes code.
pub(crate) fn prose(text: &str) -> String {
    let escaped = escape(text);
    let parts: Vec<&str> = escaped.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return escaped;
    }
    let parts = parts.iter().enumerate().map(|(i, part)| match i % 2 {
        0 => (*part).to_owned(),
        _ => format!("<code>{part}</code>"),
    });
    parts.collect()
}

/// Rows in columns of equal width, with two blanks between them.
pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    aligned_to(rows, |_| false)
}

/// Rows of text with the cells of each column below one another, those of some columns at its right end.
pub(super) fn aligned_to(rows: &[Vec<String>], is_right: impl Fn(usize) -> bool) -> String {
    let width = |j: usize| {
        let cells = rows.iter().filter_map(|row| row.get(j));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate();
        let cells = cells.map(|(j, cell)| match (is_right(j), widths[j]) {
            (true, width) => format!("{cell:>width$}"),
            (false, width) => format!("{cell:<width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_raised() {
        assert_eq!(decade(-4), "10⁻⁴");
        assert_eq!(decade(0), "10⁰");
        assert_eq!(decade(12), "10¹²");
        assert_eq!(superscript(1234567890), "¹²³⁴⁵⁶⁷⁸⁹⁰");
    }

    #[test]
    fn ticks_have_the_digits_of_their_step() {
        assert_eq!(tick(-0.5, 0.5, 2.0), "−0.5");
        assert_eq!(tick(2.0, 0.5, 2.0), "2.0");
        assert_eq!(tick(15.0, 5.0, 25.0), "15");
        assert_eq!(tick(-0.0, 0.1, 1.0), "0.0");
        assert_eq!(tick(0.0, 1e6, 5e6), "0");
        assert_eq!(tick(1.5e6, 5e5, 2e6), "1.5×10⁶");
        assert_eq!(tick(-2e-5, 1e-5, 3e-5), "−2×10⁻⁵");
    }

    #[test]
    fn what_is_quoted_is_code() {
        assert_eq!(
            prose("add a `penalty`; a<b"),
            "add a <code>penalty</code>; a&lt;b"
        );
        assert_eq!(prose("a ` by itself"), "a ` by itself");
    }

    #[test]
    fn text_is_fit_for_xml() {
        assert_eq!(
            escape("a<b & \"c\"\u{0}\u{1b}"),
            "a&lt;b &amp; &quot;c&quot;"
        );
    }
}
