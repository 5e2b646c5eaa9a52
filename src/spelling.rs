//! Suggestions for unknown words, by edit distance to the known ones.

use kmcfit_core::number_format::significant;

/// Longest word that is compared; longer ones are no slip of the finger.
const LONGEST_WORD: usize = 64;

/// Shortest word that is taken for the beginning of a longer one.
const SHORTEST_STEM: usize = 3;

/// Words whose nearest spelling would be wrong, with the correct suggestion.
const MEANT: [(&str, &str); 4] = [
    ("decreasing", "nonincreasing"),
    ("falling", "nonincreasing"),
    ("increasing", "nondecreasing"),
    ("rising", "nondecreasing"),
];

/// The candidate that `word` is probably a misspelling of.
///
/// Capitals, `-`, `_` and spaces do not count. A candidate is near when at most one letter in
/// three was dropped, added, changed or swapped with its neighbour, when one word begins with
/// the other, or when the candidate is the word and a unit (`y_m` for `y`).
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = plain(word);
    if word.is_empty() || word.chars().count() > LONGEST_WORD {
        return None;
    }
    candidates
        .into_iter()
        .filter_map(|candidate| {
            let other = plain(candidate);
            if let Some((_, meant)) = MEANT.iter().find(|(other, _)| *other == word) {
                return (other == *meant).then_some((0, candidate));
            }
            let near = distance(&word, &other);
            // `y` for `y_m`: a name without its unit.
            let bare = candidate
                .split_once('_')
                .is_some_and(|(name, _)| plain(name) == word);
            let distance = near.or_else(|| bare.then_some(LONGEST_WORD))?;
            Some((distance, candidate))
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// `did you mean` with the nearest candidate, if there is one.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    nearest(word, candidates).map(|near| format!("did you mean `{near}`?"))
}

/// The word in lower case without separators.
fn plain(word: &str) -> String {
    word.chars()
        .filter(|c| !matches!(c, '-' | '_' | ' '))
        .flat_map(char::to_lowercase)
        .collect()
}

/// Edit distance of two plain words; `None` if it is too large for a suggestion.
fn distance(word: &str, candidate: &str) -> Option<usize> {
    let lengths = (word.chars().count(), candidate.chars().count());
    let (shorter, longer) = (lengths.0.min(lengths.1), lengths.0.max(lengths.1));
    if longer > LONGEST_WORD {
        return None;
    }
    let edits = strsim::osa_distance(word, candidate);
    if edits <= longer / 3 {
        return Some(edits);
    }
    let stem =
        shorter >= SHORTEST_STEM && (candidate.starts_with(word) || word.starts_with(candidate));
    stem.then_some(edits)
}

/// Correction of a text that is a misspelt integer.
pub(crate) fn integer_in(text: &str) -> Option<String> {
    let digits = text.trim().replace([',', '_', ' ', '\''], "");
    let is_grouped = text.contains(',') && digits.bytes().all(|b| b.is_ascii_digit());
    match is_grouped {
        // A comma separates decimals or thousands.
        true => Some("write the integer in digits alone, without a comma".to_owned()),
        false => number_in(text),
    }
}

/// Correction of a text that is a misspelt number.
pub(crate) fn number_in(text: &str) -> Option<String> {
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
    if let Some(percent) = text.strip_suffix('%').and_then(|text| finite(text.trim())) {
        let value = significant(percent / 100.0, 12);
        return Some(format!("percent is not accepted: write {value}"));
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
        .starts_with(|c: char| c.is_alphabetic() || c == '°')
        .then(|| format!("write {value} alone, without a unit"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelt_words_are_matched_and_other_words_are_not() {
        let keys = ["mass", "damping", "stiffness", "steepest-descent", "rk4"];
        for (word, near) in [
            ("mas", Some("mass")),
            ("Mass", Some("mass")),
            ("dampnig", Some("damping")),
            ("stiff", Some("stiffness")),
            ("steepest_descent", Some("steepest-descent")),
            ("rk45", Some("rk4")),
            ("friction", None),
            ("", None),
            ("k", None),
        ] {
            assert_eq!(nearest(word, keys), near, "{word}");
        }
        let shapes = ["non-increasing", "non-decreasing", "convex", "concave"];
        assert_eq!(nearest("decreasing", shapes), Some("non-increasing"));
        assert_eq!(nearest("increasing", shapes), Some("non-decreasing"));
        assert_eq!(nearest("non-decreasin", shapes), Some("non-decreasing"));
        assert_eq!(nearest(&"m".repeat(10_000), keys), None);
    }
}
