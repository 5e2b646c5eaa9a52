//! Literals of Python in the headers of NumPy files: texts, integers, booleans, tuples, lists and dictionaries.

/// Deepest nesting; a header has three levels.
const DEEPEST: usize = 8;

/// A literal.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Literal {
    Text(String),
    Integer(u64),
    Bool(bool),
    /// A tuple or list.
    List(Vec<Literal>),
    /// A dictionary with texts as keys.
    Map(Vec<(String, Literal)>),
}

impl Literal {
    /// `None` unless the text is one literal, possibly followed by blanks.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parser = Parser(text);
        let literal = parser.literal(0)?;
        parser.0.trim().is_empty().then_some(literal)
    }

    /// The value of a key of a dictionary.
    pub fn get(&self, key: &str) -> Option<&Literal> {
        match self {
            Self::Map(pairs) => pairs.iter().find(|(k, _)| k == key).map(|(_, value)| value),
            _ => None,
        }
    }
}

struct Parser<'a>(&'a str);

impl Parser<'_> {
    fn literal(&mut self, depth: usize) -> Option<Literal> {
        if depth > DEEPEST {
            return None;
        }
        self.0 = self.0.trim_start();
        let first = self.0.chars().next()?;
        match first {
            '\'' | '"' => self.text(first).map(Literal::Text),
            '(' => self.list(')', depth),
            '[' => self.list(']', depth),
            '{' => self.map(depth),
            '0'..='9' => {
                let end = self.0.find(|c: char| !c.is_ascii_digit());
                let (digits, rest) = self.0.split_at(end.unwrap_or(self.0.len()));
                // Python 2 wrote `10L`.
                self.0 = rest.strip_prefix('L').unwrap_or(rest);
                digits.parse().ok().map(Literal::Integer)
            }
            _ => {
                let known = [("True", true), ("False", false)];
                known.into_iter().find_map(|(word, value)| {
                    self.0 = self.0.strip_prefix(word)?;
                    Some(Literal::Bool(value))
                })
            }
        }
    }

    fn text(&mut self, quote: char) -> Option<String> {
        let (text, rest) = self.0.get(1..)?.split_once(quote)?;
        self.0 = rest;
        (!text.contains('\\')).then(|| text.to_owned())
    }

    /// True, and the sign skipped, if the next sign is this one.
    fn accepts(&mut self, sign: char) -> bool {
        self.0 = self.0.trim_start();
        match self.0.strip_prefix(sign) {
            Some(rest) => {
                self.0 = rest;
                true
            }
            None => false,
        }
    }

    fn list(&mut self, close: char, depth: usize) -> Option<Literal> {
        self.0 = self.0.get(1..)?;
        let mut found = Vec::new();
        while !self.accepts(close) {
            found.push(self.literal(depth + 1)?);
            if !self.accepts(',') {
                return self.accepts(close).then_some(Literal::List(found));
            }
        }
        Some(Literal::List(found))
    }

    fn map(&mut self, depth: usize) -> Option<Literal> {
        self.0 = self.0.get(1..)?;
        let mut found = Vec::new();
        while !self.accepts('}') {
            let Literal::Text(key) = self.literal(depth + 1)? else {
                return None;
            };
            if !self.accepts(':') {
                return None;
            }
            found.push((key, self.literal(depth + 1)?));
            if !self.accepts(',') {
                return self.accepts('}').then_some(Literal::Map(found));
            }
        }
        Some(Literal::Map(found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_numpy() {
        let text = "{'descr': [('t', '<f8'), ('y', '<i2', (3,))], 'fortran_order': False, 'shape': (7,), }  \n";
        let header = Literal::parse(text).expect("a dictionary");
        let list = |items: &[Literal]| Literal::List(items.to_vec());
        let word = |text: &str| Literal::Text(text.to_owned());
        assert_eq!(header.get("shape"), Some(&list(&[Literal::Integer(7)])));
        assert_eq!(header.get("fortran_order"), Some(&Literal::Bool(false)));
        let fields = [
            list(&[word("t"), word("<f8")]),
            list(&[word("y"), word("<i2"), list(&[Literal::Integer(3)])]),
        ];
        assert_eq!(header.get("descr"), Some(&list(&fields)));
        assert_eq!(Literal::parse("()"), Some(list(&[])));
        assert_eq!(
            Literal::parse("(1, 2L)"),
            Some(list(&[Literal::Integer(1), Literal::Integer(2)]))
        );
    }

    #[test]
    fn other_texts_are_refused() {
        for text in [
            "",
            "{",
            "(1",
            "(1 2)",
            "{'a' 1}",
            "{1: 2}",
            "'a",
            "x",
            "1 2",
            "(((((((((((1)))))))))))",
            "'\\x41'",
            "99999999999999999999",
        ] {
            assert_eq!(Literal::parse(text), None, "{text}");
        }
    }
}
