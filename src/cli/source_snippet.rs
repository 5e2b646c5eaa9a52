//! The line of a file that an error is about, with a mark below the part that is wrong.

use crate::error::{InputError, Location};
use console::measure_text_width;
use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Most characters of a line that are shown, so that it fits into a terminal.
const MOST_SHOWN: usize = 90;
/// Most characters before the mark where a line is cut.
const MOST_BEFORE: usize = 50;
/// Longest line that is looked at, bytes.
const LONGEST_LINE: u64 = 1 << 16;

/// A line of a file with the marked part.
///
/// ```text
///    |
/// 11 | grid: {nodes: 2e3, method: midpoint}
///    |               ^^^
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// Number of the line, from 1.
    pub line: usize,
    /// The line, or the part of it around the mark.
    pub text: String,
    /// Columns of a terminal before the mark.
    pub before: usize,
    /// Columns of the mark; at least one.
    pub width: usize,
}

impl Excerpt {
    /// The line of an error, read from its file; `None` for an error without a line, or a file that is not text.
    pub fn of(error: &InputError) -> Option<Self> {
        match &error.location {
            Location::Line { file, line, column } => {
                let text = line_of(file, *line)?;
                let start = (*column - 1).min(text.len());
                let end = token_end(&text, start).max(start + 1);
                Some(Self::new(*line, &text, start, end))
            }
            Location::Row { file, line, .. } => {
                let text = line_of(file, *line)?;
                let [start, end] = field(&text, error.found.as_deref().unwrap_or_default());
                Some(Self::new(*line, &text, start, end))
            }
            Location::Argument(_) | Location::File(_) | Location::Sample { .. } => None,
        }
    }

    fn new(line: usize, text: &[char], start: usize, end: usize) -> Self {
        let first = match text.len() > MOST_SHOWN {
            true => start.saturating_sub(MOST_BEFORE),
            false => 0,
        };
        let last = text.len().min(first + MOST_SHOWN);
        let mut shown: String = text[first..last].iter().collect();
        let mut before: String = text[first..start.clamp(first, last)].iter().collect();
        let marked: String = (text.get(start..end.min(last)).unwrap_or_default())
            .iter()
            .collect();
        if first > 0 {
            shown.insert(0, '…');
            before.insert(0, '…');
        }
        if last < text.len() {
            shown.push('…');
        }
        Self {
            line,
            text: shown,
            before: measure_text_width(&before),
            width: measure_text_width(&marked).max(1),
        }
    }

    /// The three lines: a blank one, the line of the file, the mark.
    pub fn lines(&self) -> [String; 3] {
        let number = self.line.to_string();
        let blank = " ".repeat(number.len());
        let mark = " ".repeat(self.before) + &"^".repeat(self.width);
        [
            format!("{blank} |"),
            format!("{number} | {}", self.text).trim_end().to_owned(),
            format!("{blank} | {mark}"),
        ]
    }
}

impl fmt::Display for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

/// A line of a text file, its tabs as blanks and without characters that a terminal would obey.
fn line_of(file: &Path, line: usize) -> Option<Vec<char>> {
    // Only regular files can be read twice.
    file.metadata().ok()?.is_file().then_some(())?;
    let mut reader = BufReader::new(File::open(file).ok()?);
    for _ in 1..line {
        (reader.skip_until(b'\n').ok()? > 0).then_some(())?;
    }
    let mut bytes = Vec::new();
    let mut rest = reader.take(LONGEST_LINE);
    (rest.read_until(b'\n', &mut bytes).ok()? > 0).then_some(())?;
    let is_binary = bytes.contains(&0);
    let text = String::from_utf8_lossy(&bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let clean = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() => '\u{fffd}',
        c => c,
    };
    let text = text.trim_end_matches(['\n', '\r']);
    (!is_binary).then(|| text.chars().map(clean).collect())
}

/// End of the word of a model file that begins at `start`.
fn token_end(text: &[char], start: usize) -> usize {
    let at = |i: usize| text.get(i).copied();
    let Some(first) = at(start) else {
        return start;
    };
    let close = |quote: char| (start + 1..text.len()).find(|&i| text[i] == quote);
    let end = match first {
        '"' | '\'' => close(first).map_or(text.len(), |i| i + 1),
        '[' | '{' => bracket_end(text, start),
        _ => {
            let depth = text[..start].iter().fold(0i32, |depth, c| match c {
                '[' | '{' => depth + 1,
                ']' | '}' => depth - 1,
                _ => depth,
            });
            let ends = |i: &usize| match text[*i] {
                ',' | ']' | '}' => depth > 0,
                ':' => at(*i + 1).is_none_or(|c| c == ' '),
                '#' => *i > start && text[*i - 1] == ' ',
                _ => false,
            };
            (start..text.len()).find(ends).unwrap_or(text.len())
        }
    };
    let blank = text[start..end].iter().rev().take_while(|c| **c == ' ');
    end - blank.count()
}

/// Behind the bracket that closes the one at `start`, or the end of the line.
fn bracket_end(text: &[char], start: usize) -> usize {
    let mut open = 0;
    for (i, c) in text.iter().enumerate().skip(start) {
        match c {
            '[' | '{' => open += 1,
            ']' | '}' => open -= 1,
            _ => {}
        }
        if open == 0 {
            return i + 1;
        }
    }
    text.len()
}

/// The field of a row that was `found`, if one and only one has this text or is this number; else the whole row.
fn field(text: &[char], found: &str) -> [usize; 2] {
    let quoted = found
        .split_once('`')
        .and_then(|(_, rest)| rest.split_once('`'));
    let mut positions: Vec<[usize; 2]> = match quoted {
        Some((wanted, _)) => positions_of(text, wanted),
        None => {
            let number: Option<f64> = found.split(' ').next().and_then(|n| n.parse().ok());
            let is_found = |[start, end]: &[usize; 2]| {
                let field: String = text[*start..*end].iter().collect();
                number.is_some() && field.parse().ok() == number
            };
            fields(text).into_iter().filter(is_found).collect()
        }
    };
    match (positions.pop(), positions.is_empty()) {
        (Some(only), true) => only,
        _ => [0, text.len()],
    }
}

/// True for a character between two fields, and at the ends of a row.
fn is_edge(c: Option<&char>) -> bool {
    c.is_none_or(|c| ",;\" ".contains(*c))
}

/// Start and end of every place in a row that has the text of one or several fields.
fn positions_of(text: &[char], wanted: &str) -> Vec<[usize; 2]> {
    let wanted: Vec<char> = wanted.chars().collect();
    let is_here = |&i: &usize| {
        !wanted.is_empty()
            && text[i..].starts_with(&wanted)
            && is_edge(i.checked_sub(1).and_then(|b| text.get(b)))
            && is_edge(text.get(i + wanted.len()))
    };
    let starts = (0..text.len()).filter(is_here);
    starts.map(|i| [i, i + wanted.len()]).collect()
}

/// Start and end of the fields of a row.
fn fields(text: &[char]) -> Vec<[usize; 2]> {
    let edges: Vec<usize> = (0..=text.len()).filter(|i| is_edge(text.get(*i))).collect();
    let starts = std::iter::once(0).chain(edges.iter().map(|edge| edge + 1));
    starts.zip(edges.iter()).map(|(a, b)| [a, *b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use insta::assert_snapshot;

    fn shown(text: &str, location: impl Fn(std::path::PathBuf) -> Location, found: &str) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, text).expect("a file");
        let error = InputError::new(location(path), "wrong").found(found);
        Excerpt::of(&error).map_or("nothing".into(), |e| e.to_string())
    }

    fn at(text: &str, line: usize, column: usize) -> String {
        let location = |file| Location::Line { file, line, column };
        shown(text, location, "")
    }

    fn row(text: &str, line: usize, found: &str) -> String {
        let location = |file| Location::Row {
            file,
            line,
            column: None,
        };
        shown(text, location, found)
    }

    #[test]
    fn words_of_a_model_are_marked() {
        assert_snapshot!(at("a: 1\ngrid: {nodes: 2e3, method: rk4}\n", 2, 15), @"
          |
        2 | grid: {nodes: 2e3, method: rk4}
          |               ^^^
        ");
        assert_snapshot!(at("grid: {nodes: 2e3}  # why", 1, 7), @"
          |
        1 | grid: {nodes: 2e3}  # why
          |       ^^^^^^^^^^^^
        ");
        assert_snapshot!(at("  tit,el: Small  # a", 1, 3), @"
          |
        1 |   tit,el: Small  # a
          |   ^^^^^^
        ");
        assert_snapshot!(at("title: 'Größe ω, 大きさ' # a", 1, 8), @"
          |
        1 | title: 'Größe ω, 大きさ' # a
          |        ^^^^^^^^^^^^^^^^^
        ");
        assert_snapshot!(at("x", 1, 9), @"
          |
        1 | x
          |  ^
        ");
    }

    #[test]
    fn fields_of_a_row_are_marked() {
        assert_snapshot!(row("t,y\n0,1\n1,abc\n", 3, "`abc`"), @"
          |
        3 | 1,abc
          |   ^^^
        ");
        assert_snapshot!(row("x,x\n", 1, "`x`"), @"
          |
        1 | x,x
          | ^^^
        ");
    }

    #[test]
    fn long_lines_are_cut_and_control_characters_escaped() {
        let long = format!("{} bad {}", "a".repeat(300), "b".repeat(300));
        let text = at(&long, 1, 302);
        assert!(text.contains("…a") && text.contains("b…"), "{text}");
        assert!(
            text.lines().all(|line| line.chars().count() < 100),
            "{text}"
        );
        assert!(text.contains("^^^"), "{text}");
        assert_eq!(at("a\u{1b}[2Jb\n", 1, 1).matches('\u{1b}').count(), 0);
    }

    #[test]
    fn lines_that_are_not_text_are_not_shown() {
        assert_eq!(at("a\n", 7, 1), "nothing");
        assert_eq!(at("f\0o\0", 1, 1), "nothing");
        let error = InputError::file("no such file", "missing");
        assert_eq!(Excerpt::of(&error), None);
    }
}
