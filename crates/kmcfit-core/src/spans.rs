//! Intervals of time and their text.

/// Intervals of time, s, over consecutive nodes for which `holds` is true.
pub fn spans(times: &[f64], holds: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut open = false;
    for (i, &t) in times.iter().enumerate() {
        match (holds(i), open) {
            (true, true) => {
                if let Some(span) = spans.last_mut() {
                    span[1] = t;
                }
            }
            (true, false) => spans.push([t, t]),
            _ => {}
        }
        open = holds(i);
    }
    spans
}

/// Largest number of intervals in a sentence.
const MOST_SPANS: usize = 4;

/// Intervals as text.
pub fn span_words(spans: &[[f64; 2]]) -> String {
    let word = |&[from, to]: &[f64; 2]| match from == to {
        true => format!("t = {from:.3} s"),
        false => format!("[{from:.3}, {to:.3}] s"),
    };
    let words: Vec<String> = spans.iter().take(MOST_SPANS).map(word).collect();
    match spans.len().saturating_sub(MOST_SPANS) {
        0 => words.join(", "),
        1 => format!("{} and 1 further interval", words.join(", ")),
        more => format!("{} and {more} further intervals", words.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_join_neighbours() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0];
        let mask = [true, true, false, true, false];
        assert_eq!(spans(&times, |i| mask[i]), [[0.0, 1.0], [3.0, 3.0]]);
    }
}
