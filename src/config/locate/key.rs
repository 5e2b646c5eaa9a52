//! The reader of one key of a map.

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::cell::Cell;
use std::fmt;

/// Reads a key and says whether it is the wanted one, or stops at it.
pub(super) struct Key<'a> {
    pub wanted: Option<&'a str>,
    /// Where to note that reading stops at the wanted key; `None` to read on.
    pub stop: Option<&'a Cell<bool>>,
}

/// The error on purpose, at the goal; `hit` tells it from others.
pub(super) fn stop<E: Error>(hit: &Cell<bool>) -> E {
    hit.set(true);
    E::custom("found")
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
        match self.stop.filter(|_| same) {
            Some(hit) => Err(stop(hit)),
            None => Ok(same),
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
