//! Line and column of a key and its value, for errors found after parsing.
//!
//! The YAML crate attaches line and column only to errors. The text is therefore parsed once more by a visitor that
//! follows the path of the key, skips all other values, and raises an error at the goal, whose position the crate
//! supplies.

mod key;
mod path;
mod position;
mod walk;

pub use path::{Segment, key_path};
pub use position::Position;
pub(super) use position::location;

use serde::de::{Deserialize, DeserializeSeed, IgnoredAny};
use std::cell::Cell;
use walk::{Goal, Walk};

/// Position of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Located {
    /// Begin of the value; that of an alias (`*name`) is where it is anchored (`&name`).
    pub value: Position,
    /// Begin of its key, unless it is the whole file or an element of a list.
    pub key: Option<Position>,
    /// Number of segments of the path that exist; if fewer than all, the value is an ancestor.
    pub depth: usize,
}

/// Finds the value at `path` in a YAML text, or its deepest existing ancestor.
///
/// Never fails: in a text that is not YAML every position is the beginning.
pub fn locate(text: &str, path: &[Segment]) -> Located {
    (0..=path.len())
        .rev()
        .find_map(|depth| {
            let path = &path[..depth];
            let value = find(text, path, Goal::Value)?;
            let key = find(text, path, Goal::Key { occurrence: 1 });
            Some(Located { value, key, depth })
        })
        .unwrap_or(Located {
            value: Position::START,
            key: None,
            depth: 0,
        })
}

/// Finds the second occurrence of the key that ends `path`.
pub(super) fn second_occurrence(text: &str, path: &[Segment]) -> Option<Position> {
    find(text, path, Goal::Key { occurrence: 2 })
}

/// The first syntax error of a text, if any.
pub(super) fn syntax_error(text: &str) -> Option<serde_yaml::Error> {
    serde_yaml::Deserializer::from_str(text)
        .find_map(|document| IgnoredAny::deserialize(document).err())
}

/// The begin of the second document of a well-formed text.
pub(super) fn second_document(text: &str) -> Option<Position> {
    let document = serde_yaml::Deserializer::from_str(text).nth(1)?;
    let hit = Cell::new(false);
    let walk = Walk {
        path: &[],
        goal: Goal::Value,
        hit: &hit,
    };
    position(&walk.deserialize(document).err()?)
}

/// Reads a text up to the goal; the error raised there has its position.
fn find(text: &str, path: &[Segment], goal: Goal) -> Option<Position> {
    let hit = Cell::new(false);
    let walk = Walk {
        path,
        goal,
        hit: &hit,
    };
    let error = walk
        .deserialize(serde_yaml::Deserializer::from_str(text))
        .err()?;
    hit.get().then(|| position(&error)).flatten()
}

/// The position the YAML crate gave to an error.
pub(super) fn position(error: &serde_yaml::Error) -> Option<Position> {
    error.location().map(|location| Position {
        line: location.line(),
        column: location.column(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# a comment first
format: 1   # and one behind
experiments:
  - name: a b
    initial: {displacement: 3.3, velocity: 1.0}
  -
    name: \"second\"
    'initial':
      displacement: -1
      \"velocity\": &v 2.5
list: [1, {a: [x, y]}, [3, 4]]
functions:
  # a comment inside
  mass:
    start: *v
    é: {ü: 1, plain: 2}
  blank:
? complex
: value
[1, 2]: pair
\"quoted: key\": q
7: seven
indentless:
- 1
- k: |
    some text
    more text
last: end
";

    /// `line:column` of the value and of the key, and the number of missing segments.
    fn at(path: &str) -> String {
        let path = key_path(path);
        let found = locate(TEXT, &path);
        let Position { line, column } = found.value;
        let key = match found.key {
            Some(Position { line, column }) => format!("key {line}:{column}"),
            None => "no key".to_owned(),
        };
        let missing = path.len() - found.depth;
        format!("{line}:{column}, {key}, {missing} missing")
    }

    #[test]
    fn values_and_keys_are_found() {
        for (path, expected) in [
            ("", "2:1, no key, 0 missing"),
            ("format", "2:9, key 2:1, 0 missing"),
            ("experiments", "4:3, key 3:1, 0 missing"),
            ("experiments[0]", "4:5, no key, 0 missing"),
            ("experiments[0].name", "4:11, key 4:5, 0 missing"),
            ("experiments[0].initial", "5:14, key 5:5, 0 missing"),
            (
                "experiments[0].initial.velocity",
                "5:44, key 5:34, 0 missing",
            ),
            ("experiments[1].name", "7:11, key 7:5, 0 missing"),
            ("experiments[1].initial", "9:7, key 8:5, 0 missing"),
            (
                "experiments[1].initial.velocity",
                "10:19, key 10:7, 0 missing",
            ),
            ("list[0]", "11:8, no key, 0 missing"),
            ("list[1].a", "11:15, key 11:12, 0 missing"),
            ("list[1].a[1]", "11:19, no key, 0 missing"),
            ("list[2][1]", "11:28, no key, 0 missing"),
            ("functions.mass", "15:5, key 14:3, 0 missing"),
            ("functions.mass.start", "10:19, key 15:5, 0 missing"),
            ("functions.mass.é.plain", "16:22, key 16:15, 0 missing"),
            ("functions.blank", "17:9, key 17:3, 0 missing"),
            ("complex", "19:3, key 18:3, 0 missing"),
            ("quoted: key", "21:16, key 21:1, 0 missing"),
            ("indentless[1].k", "25:6, key 25:3, 0 missing"),
            ("last", "28:7, key 28:1, 0 missing"),
        ] {
            assert_eq!(at(path), expected, "{path}");
        }
    }

    #[test]
    fn missing_paths_lead_to_their_deepest_ancestor() {
        for (path, expected) in [
            ("nothing", "2:1, no key, 1 missing"),
            ("functions.mass.start.data", "10:19, key 15:5, 1 missing"),
            ("functions.damping.start", "14:3, key 12:1, 2 missing"),
            ("experiments[7].name", "4:3, key 3:1, 2 missing"),
            ("experiments.name", "4:3, key 3:1, 1 missing"),
            ("format[0]", "2:9, key 2:1, 1 missing"),
            ("list[99999999999999999999]", "2:1, no key, 1 missing"),
        ] {
            assert_eq!(at(path), expected, "{path}");
        }
    }

    #[test]
    fn odd_texts_and_paths_lead_somewhere() {
        for text in [
            "",
            "#",
            "a: [",
            "\t",
            "- 1\n- 2",
            "!t {a: 1}",
            "&a [*a]",
            "a: 1\na: 2",
        ] {
            for path in [
                "",
                "a",
                "a.b[0]",
                "[0]",
                "[",
                "]]",
                "a[x]",
                "..",
                "[0][0][0]",
            ] {
                let found = locate(text, &key_path(path));
                assert!(found.value.line >= 1 && found.value.column >= 1);
            }
        }
    }

    #[test]
    fn a_second_occurrence_is_found() {
        let text = "a: {b: 1}\nc:\n  a: 1\n  a: 2\na: 3\n";
        let second = |path| second_occurrence(text, &key_path(path)).map(|at| (at.line, at.column));
        assert_eq!(second("a"), Some((5, 1)));
        assert_eq!(second("c.a"), Some((4, 3)));
        assert_eq!(second("a.b"), None);
        assert_eq!(second("c"), None);
    }
}
