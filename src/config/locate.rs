//! Line and column of a key and its value, for mistakes found after the file was read.
//!
//! The YAML crate adds line and column to errors only. So the text is read once more by a reader
//! that follows the path of the key, skips everything else, and fails on purpose at its goal: the
//! crate then says where that was.

use std::cell::Cell;
use std::fmt;

use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny, MapAccess,
    SeqAccess, Visitor,
};

/// A position in a text; both count from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

impl Position {
    /// The beginning of a text.
    pub const START: Self = Self { line: 1, column: 1 };

    /// The position of a byte in a text.
    pub(super) fn of(text: &str, index: usize) -> Self {
        let before = text.get(..index).unwrap_or(text);
        Self {
            line: 1 + before.matches('\n').count(),
            column: 1 + before.chars().rev().take_while(|&c| c != '\n').count(),
        }
    }
}

/// One step of a path into a YAML file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Segment {
    /// Into a map, by key.
    Key(String),
    /// Into a list, by position from 0.
    Index(usize),
}

/// Takes a path such as `experiments[0].initial.velocity` apart.
///
/// What is not a well-formed index is taken as part of a key.
pub fn key_path(path: &str) -> Vec<Segment> {
    let mut segments = Vec::new();
    for part in path.split('.').filter(|part| !part.is_empty()) {
        let (key, indices) = split_indices(part);
        if !key.is_empty() {
            segments.push(Segment::Key(key.to_owned()));
        }
        segments.extend(indices.into_iter().map(Segment::Index));
    }
    segments
}

/// `list[1][2]` as `list` and `[1, 2]`.
fn split_indices(part: &str) -> (&str, Vec<usize>) {
    let mut key = part;
    let mut indices = Vec::new();
    while let Some((before, index)) = key.strip_suffix(']').and_then(|rest| rest.rsplit_once('['))
        && let Ok(index) = index.parse()
    {
        indices.insert(0, index);
        key = before;
    }
    (key, indices)
}

/// Where a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Located {
    /// Begin of the value; that of an alias (`*name`) is where it is anchored (`&name`).
    pub value: Position,
    /// Begin of its key, unless it is the whole file or an element of a list.
    pub key: Option<Position>,
    /// How many segments of the path exist: all of them, or the value is an ancestor.
    pub depth: usize,
}

/// Finds the value at `path` in a YAML text, or its deepest existing ancestor.
///
/// Never fails: in a text that is not YAML everything is at the beginning.
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

/// The first place where a text is not YAML, if there is one.
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

/// What to find at the end of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Goal {
    Value,
    Key { occurrence: usize },
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

/// Follows the rest of a path.
#[derive(Clone, Copy)]
struct Walk<'a> {
    path: &'a [Segment],
    goal: Goal,
    hit: &'a Cell<bool>,
}

impl Walk<'_> {
    /// The error on purpose, at the goal.
    fn stop<E: Error>(&self) -> E {
        self.hit.set(true);
        E::custom("found")
    }
}

impl<'de> DeserializeSeed<'de> for Walk<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// What a walk does with a scalar: stop if it is the goal, go on if it is not.
macro_rules! at_scalar {
    ($($visit:ident($($value:ty)?)),+) => {$(
        fn $visit<E: Error>(self $(, _: $value)?) -> Result<(), E> {
            match self.path.is_empty() && self.goal == Goal::Value {
                true => Err(self.stop()),
                false => Ok(()),
            }
        }
    )+};
}

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("anything")
    }

    at_scalar!(
        visit_unit(),
        visit_none(),
        visit_bool(bool),
        visit_u64(u64),
        visit_i64(i64),
        visit_u128(u128),
        visit_i128(i128),
        visit_f64(f64),
        visit_str(&str)
    );

    fn visit_enum<A: EnumAccess<'de>>(self, _: A) -> Result<(), A::Error> {
        match self.path.is_empty() && self.goal == Goal::Value {
            true => Err(self.stop()),
            false => Err(A::Error::custom("no path leads through a tag")),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let wanted = match self.path.first() {
            None if self.goal == Goal::Value => return Err(self.stop()),
            Some(Segment::Index(index)) => Some(*index),
            _ => None,
        };
        for index in 0.. {
            let element = if wanted == Some(index) {
                let rest = Walk {
                    path: &self.path[1..],
                    ..self
                };
                list.next_element_seed(rest)?
            } else {
                list.next_element::<IgnoredAny>()?.map(|_| ())
            };
            if element.is_none() {
                break;
            }
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let (wanted, rest) = match self.path.split_first() {
            None if self.goal == Goal::Value => return Err(self.stop()),
            Some((Segment::Key(key), rest)) => (Some(key.as_str()), rest),
            _ => (None, self.path),
        };
        let mut occurrence = 0;
        while let Some(same) = map.next_key_seed(Key {
            wanted,
            stop: match self.goal {
                Goal::Key { occurrence: goal } if rest.is_empty() => goal == occurrence + 1,
                _ => false,
            },
            walk: self,
        })? {
            occurrence += usize::from(same);
            if same && occurrence == 1 && !rest.is_empty() || same && self.goal == Goal::Value {
                map.next_value_seed(Walk { path: rest, ..self })?;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(())
    }
}

/// Reads a key and says whether it is the wanted one, or stops at it.
struct Key<'a> {
    wanted: Option<&'a str>,
    stop: bool,
    walk: Walk<'a>,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = bool;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<bool, D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// Keys that are no text are never wanted.
macro_rules! other_key {
    ($($visit:ident($($value:ty)?)),+) => {$(
        fn $visit<E: Error>(self $(, _: $value)?) -> Result<bool, E> {
            Ok(false)
        }
    )+};
}

impl<'de> Visitor<'de> for Key<'_> {
    type Value = bool;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<bool, E> {
        let same = self.wanted == Some(key);
        match same && self.stop {
            true => Err(self.walk.stop()),
            false => Ok(same),
        }
    }

    other_key!(
        visit_unit(),
        visit_none(),
        visit_bool(bool),
        visit_u64(u64),
        visit_i64(i64),
        visit_u128(u128),
        visit_i128(i128),
        visit_f64(f64)
    );

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<bool, A::Error> {
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(false)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<bool, A::Error> {
        while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(false)
    }
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

    /// `line:column` of the value and of the key, and what is missing of the path.
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

    #[test]
    fn paths_are_taken_apart() {
        use Segment::{Index, Key};
        let key = |name: &str| Key(name.to_owned());
        assert_eq!(key_path(""), []);
        assert_eq!(key_path("a.b"), [key("a"), key("b")]);
        assert_eq!(
            key_path("a[0][12].b"),
            [key("a"), Index(0), Index(12), key("b")]
        );
        assert_eq!(key_path("[3]"), [Index(3)]);
        assert_eq!(key_path("a[x]"), [key("a[x]")]);
    }
}
