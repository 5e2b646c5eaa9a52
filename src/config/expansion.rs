//! Length of a YAML text after expansion of its aliases, bytes.
//!
//! An alias (`*name`) and a merge key (`<<: *name`) stand for all of the value behind the anchor (`&name`), and
//! anchored values may contain aliases themselves. A streaming reader adds up the lengths of all values, each alias
//! with the length of its anchored value, and stops as soon as a limit is exceeded.

use super::key_positions;
use super::key_positions::Position;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};
use std::cell::Cell;
use std::fmt;

/// Position of the value at which the expanded text exceeds `limit` bytes; `None` for a text within the limit, and for
/// one with a syntax error before it.
pub(super) fn beyond(text: &str, limit: usize) -> Option<Position> {
    // Every alias begins with this character.
    if !text.contains('*') {
        return None;
    }
    let counter = Counter {
        rest: &Cell::new(limit),
        passed: &Cell::new(false),
    };
    for document in serde_yaml::Deserializer::from_str(text) {
        let error = counter.deserialize(document).err();
        if counter.passed.get() {
            return Some(
                error
                    .as_ref()
                    .and_then(key_positions::position)
                    .unwrap_or(Position::START),
            );
        }
        if error.is_some() {
            return None;
        }
    }
    None
}

/// Sum of lengths: for a scalar its text and one separator, for a list or map two brackets.
#[derive(Clone, Copy)]
struct Counter<'a> {
    rest: &'a Cell<usize>,
    passed: &'a Cell<bool>,
}

impl Counter<'_> {
    fn add<E: Error>(self, bytes: usize) -> Result<(), E> {
        match self.rest.get().checked_sub(bytes) {
            Some(rest) => {
                self.rest.set(rest);
                Ok(())
            }
            None => {
                self.passed.set(true);
                Err(E::custom("the limit is passed"))
            }
        }
    }
}

impl<'de> DeserializeSeed<'de> for Counter<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// A number counts as one digit, its least length.
macro_rules! short {
    ($($visit:ident($($value:ty)?)),+) => {$(
        fn $visit<E: Error>(self $(, _: $value)?) -> Result<(), E> {
            self.add(2)
        }
    )+};
}

impl<'de> Visitor<'de> for Counter<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("anything")
    }

    short!(
        visit_unit(),
        visit_none(),
        visit_bool(bool),
        visit_u64(u64),
        visit_i64(i64),
        visit_u128(u128),
        visit_i128(i128),
        visit_f64(f64)
    );

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        self.add(text.len() + 1)
    }

    fn visit_some<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        self.deserialize(value)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        self.deserialize(value)
    }

    fn visit_enum<A: EnumAccess<'de>>(self, tagged: A) -> Result<(), A::Error> {
        let (tag, value) = tagged.variant_seed(Tag)?;
        self.add(tag)?;
        value.newtype_variant_seed(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        self.add(2)?;
        while list.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        self.add(2)?;
        while map.next_key_seed(self)?.is_some() {
            map.next_value_seed(self)?;
        }
        Ok(())
    }
}

/// The length of a tag (`!name`).
struct Tag;

impl<'de> DeserializeSeed<'de> for Tag {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<usize, D::Error> {
        let tag = String::deserialize(deserializer)?;
        Ok(tag.len() + 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aliases_count_with_the_values_they_stand_for() {
        let list = format!("a: &a [{}]\n", "1, ".repeat(100));
        let aliases = |count: usize| format!("{list}b: [{}]\n", "*a, ".repeat(count));
        // The map, its two keys, and lists of 100 numbers of two bytes and two brackets.
        let length = |count: usize| 2 + 2 * 2 + 2 + 202 * (1 + count);
        for count in [1, 7] {
            let text = aliases(count);
            assert_eq!(beyond(&text, length(count)), None);
            let at = beyond(&text, length(count) - 1).expect("too long");
            // The last list ends with the value that passes the limit.
            assert_eq!(at.line, 1, "the anchored value");
        }
    }

    #[test]
    fn aliases_of_aliases_merge_keys_and_texts() {
        let laughs: String = (1..20)
            .map(|i| format!("a{i}: &a{i} [{}]\n", format!("*a{}, ", i - 1).repeat(9)))
            .collect();
        assert!(beyond(&format!("a0: &a0 [1]\n{laughs}"), 10_000).is_some());
        let text = format!(
            "a: &a {{k: {}}}\nb: {{<<: *a}}\nc: {{<<: *a}}\n",
            "x".repeat(500)
        );
        assert!(beyond(&text, 1500).is_some());
        assert_eq!(beyond(&text, 1600), None);
        let tagged = format!("a: &a !t {}\nb: [*a, *a]\n", "x".repeat(500));
        assert!(beyond(&tagged, 1500).is_some());
        assert_eq!(beyond(&tagged, 1600), None);
    }

    #[test]
    fn texts_without_aliases_or_without_sense_pass() {
        for text in [
            "a: 1",
            "[1, 2, 3]",
            "*a",
            "a: &a [*a]",
            "a: [*",
            "",
            "'*'",
            "a: 1\n---\nb: '*'",
        ] {
            assert_eq!(beyond(text, 1000), None, "{text}");
        }
    }
}
