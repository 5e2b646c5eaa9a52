//! Headings: a name with its unit in any of the usual places.

use crate::quantity_names::quantity_of;
use crate::units::Unit;

/// Separators between a name and its unit.
const SEPARATORS: [&str; 7] = ["/", ",", ":", ";", "|", " - ", " in "];
/// Last words of names that state numbers of a converter.
const COUNTS: [&str; 6] = ["lsb", "counts", "count", "adc", "digits", "codes"];
/// First words of texts in brackets that are no units.
pub(crate) const REMARKS: &str = "left right front rear back top bottom upper lower mid middle x y z xx yy zz filtered smoothed smooth corrected \
    measured absolute relative abs rel total mean ch channel run trial test sensor node no input output";

/// A header's name and unit: `acc [g]`, `acc (g) Run 1`, `acc / g`, `acc, g`, `acc in g`, `X (16g)`. A text in brackets that is no unit is
/// returned as one, but for remarks such as `(left)`; so is a unit with a factor, as in `(N) x 0.1` and `10N`.
pub(crate) fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim_matches(['"', '\'']).trim();
    if header.contains('/') && Unit::any(header).is_some() {
        return ("", Some(header));
    }
    let groups = || bracketed(header);
    let unit = |text: &&str| Unit::any(range(text).1).is_some();
    let name = |at: usize, end: usize| match header[..at].trim() {
        "" => header[end..].trim(),
        name => name,
    };
    if let Some((at, text, end)) = groups().find(|(_, text, _)| unit(text)) {
        let behind = header[end..].trim();
        let is_scaled = is_factor(behind) || groups().any(|(.., text, _)| is_factor(text));
        let text = if is_scaled {
            header[at..].trim()
        } else {
            range(text).1
        };
        return (name(at, end), Some(text));
    }
    // The longest text that is a unit: `km/h` of `v in km/h`.
    let behind = SEPARATORS
        .iter()
        .flat_map(|sign| header.match_indices(sign));
    let behind = behind.filter(|(at, sign)| *at > 0 && unit(&&header[at + sign.len()..]));
    let behind = behind
        .min_by_key(|(at, _)| *at)
        .map(|(at, sign)| (header[..at].trim(), Some(header[at + sign.len()..].trim())));
    if let Some(found) = behind {
        return found;
    }
    // A number, or a word such as `left`.
    let is_remark = |at: usize, text: &str| {
        let mut words = text.split(|c: char| !c.is_alphabetic());
        let first = words.next().unwrap_or_default().to_lowercase();
        let is_number = text
            .chars()
            .all(|c| c.is_ascii_digit() || "#. ".contains(c));
        let is_word = REMARKS.split(' ').any(|word| word == first) && !is_factor(text);
        header[at..].starts_with('(') && (is_number || is_word)
    };
    if let Some((at, text, end)) =
        groups().find(|(at, text, _)| !text.is_empty() && !is_remark(*at, text))
    {
        let name = name(at, end);
        // `g (acceleration)`, and `[Unit: g]`.
        let is_exchanged = Unit::any(name).is_some() && quantity_of(text).is_some();
        let own = text
            .split_once([':', '='])
            .filter(|(key, _)| key.trim().eq_ignore_ascii_case("unit"));
        return match own {
            _ if is_exchanged => (text, Some(name)),
            Some((_, unit)) => (name, Some(unit.trim())),
            None => (name, Some(text)),
        };
    }
    let is_multiple = |word: &str| {
        let unit = word.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
        unit != word && !unit.is_empty() && Unit::any(unit).is_some()
    };
    match (header.split_once(" / "), header.rsplit_once(['_', ' '])) {
        (Some((name, text)), _) => (name.trim(), Some(text.trim())),
        (_, Some((name, text))) if COUNTS.contains(&&*text.to_lowercase()) => (name, Some(text)),
        (_, Some((name, text)))
            if !name.is_empty() && header[name.len()..].starts_with(' ') && is_multiple(text) =>
        {
            (name, Some(text))
        }
        _ if header.contains('^') => (header, Some(header)),
        _ => (header, None),
    }
}

/// True for a text such as `x10 N`, `/4`, `× 0.1`.
fn is_factor(text: &str) -> bool {
    let rest = text
        .trim_start_matches('(')
        .strip_prefix(['x', 'X', '×', '*', '/', '÷', '·']);
    rest.is_some_and(|rest| {
        rest.trim_start()
            .starts_with(|c: char| c.is_ascii_digit() || c == '.')
    })
}

/// The range that a heading states before its unit, in this unit: 16 of `acc (±16 g)`.
pub(crate) fn range_of(header: &str) -> Option<f64> {
    bracketed(header).find_map(|(_, text, _)| range(text).0)
}

/// The texts in brackets with their places: that of the opening bracket, and that behind the closing one. The last group comes first.
fn bracketed(header: &str) -> impl Iterator<Item = (usize, &str, usize)> {
    let pairs = [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')];
    let opening = header.char_indices().filter_map(move |(at, c)| {
        let (open, close) = pairs.into_iter().find(|pair| pair.0 == c)?;
        let mut depth = 0;
        let end = header[at..].char_indices().find(|(_, c)| {
            depth += i32::from(*c == open) - i32::from(*c == close);
            depth == 0
        });
        let end = at + end?.0;
        Some((at, header[at + 1..end].trim(), end + 1))
    });
    opening.collect::<Vec<_>>().into_iter().rev()
}

/// The range of a sensor before its unit, and the unit: 16 and `g` of `±16g`. A number before a blank is a factor unless it has a sign.
fn range(text: &str) -> (Option<f64>, &str) {
    let text = text.trim();
    let unsigned = text.trim_start_matches(['±', '+', '-', '/']);
    let rest = unsigned.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let unit = if text.starts_with('±') || text.starts_with("+/-") {
        rest.trim_start()
    } else {
        rest
    };
    match unit.starts_with(|c: char| c.is_alphabetic() || c == '%') && rest != unsigned {
        true => (unsigned[..unsigned.len() - rest.len()].parse().ok(), unit),
        false => (None, text),
    }
}
