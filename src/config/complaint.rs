//! What a value's reader has to say about it, carried through the YAML crate's text-only errors.

use std::fmt;

/// Marks the beginning of a complaint in an error text; YAML has no such character in plain text.
const BEGIN: char = '\u{2}';

/// Separates the parts of a complaint.
const SEPARATOR: char = '\u{1f}';

/// What is wrong with one value. The YAML crate adds the place.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Complaint {
    /// What is wrong.
    pub problem: String,
    /// What was found, or empty.
    pub found: String,
    /// What would be accepted, or empty.
    pub expected: String,
    /// What to try, or empty.
    pub hint: String,
}

impl Complaint {
    /// A complaint that says what was found and what was expected.
    pub fn new(problem: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            problem: problem.to_owned(),
            found: found.into(),
            expected: expected.into(),
            hint: String::new(),
        }
    }

    /// Adds what to try.
    pub fn hint(mut self, hint: Option<String>) -> Self {
        self.hint = hint.unwrap_or_default();
        self
    }

    /// Reads back what `Display` wrote, from an error text that may say more before it.
    pub fn decode(text: &str) -> Option<Self> {
        let (_, body) = text.rsplit_once(BEGIN)?;
        let mut parts = body.split(SEPARATOR).map(str::to_owned);
        Some(Self {
            problem: parts.next()?,
            found: parts.next()?,
            expected: parts.next()?,
            hint: parts.next()?,
        })
    }
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [&self.problem, &self.found, &self.expected, &self.hint];
        for (mark, part) in [BEGIN, SEPARATOR, SEPARATOR, SEPARATOR].iter().zip(parts) {
            let clean = part.replace([BEGIN, SEPARATOR], " ");
            write!(f, "{mark}{clean}")?;
        }
        write!(f, "{SEPARATOR}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let complaint =
            Complaint::new("not a number", "text `a`", "a number").hint(Some("write 1".to_owned()));
        let text = format!("fit.stop: {complaint} at line 3 column 4");
        assert_eq!(Complaint::decode(&text), Some(complaint));
        assert_eq!(Complaint::decode("missing field `x`"), None);
    }
}
