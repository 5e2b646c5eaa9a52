//! Texts that were probably meant as numbers.

/// What to write instead of a text that was probably meant as a number.
pub(super) fn number_in(text: &str) -> Option<String> {
    let text = text.trim();
    let finite = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    if text.chars().count() > 64 || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Ok(value) = text.parse::<f64>() {
        return Some(if value.is_finite() {
            format!("write {value}, without quotes or leading zeros")
        } else {
            "the number is too large".to_owned()
        });
    }
    if let Some(value) = finite(&text.replace(['_', ' ', '\''], "")) {
        return Some(format!("write {value}"));
    }
    if text.matches(',').count() == 1
        && let Some(value) = finite(&text.replace(',', "."))
    {
        return Some(format!("write {value}, with a decimal point"));
    }
    let (value, rest) = text
        .char_indices()
        .rev()
        .find_map(|(end, _)| Some((finite(&text[..end])?, &text[end..])))?;
    rest.trim_start()
        .starts_with(|c: char| c.is_alphabetic() || "°%".contains(c))
        .then(|| format!("write {value} alone, without a unit"))
}
