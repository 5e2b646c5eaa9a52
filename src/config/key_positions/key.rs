//! Reads one key of a YAML mapping, compares it with the key being located, and can stop parsing there by raising an error
//! whose position is that of the key.

use crate::config::{reader::scalar_visits, scalar::Scalar};
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::cell::Cell;
use std::fmt;

/// Returns true if the key equals `wanted`; `None` matches no key.
pub(super) struct KeySeed<'a> {
    pub wanted: Option<&'a str>,
    /// Flag to set before parsing stops at the wanted key; `None` to continue past it.
    pub stop_flag: Option<&'a Cell<bool>>,
}

/// Returns the error that ends parsing at the located key or value, and sets `hit` so that it is not taken for a syntax error.
pub(super) fn stop<E: Error>(hit: &Cell<bool>) -> E {
    hit.set(true);
    E::custom("found")
}

impl<'de> DeserializeSeed<'de> for KeySeed<'_> {
    type Value = bool;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<bool, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl KeySeed<'_> {
    /// Compares a scalar key; keys that are not strings never match.
    fn scalar<E: Error>(self, key: Scalar<'_>) -> Result<bool, E> {
        let same = matches!(key, Scalar::Text(key) if self.wanted == Some(key));
        match self.stop_flag.filter(|_| same) {
            Some(hit) => Err(stop(hit)),
            None => Ok(same),
        }
    }
}

impl<'de> Visitor<'de> for KeySeed<'_> {
    type Value = bool;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    scalar_visits!(bool);

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<bool, A::Error> {
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(false)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<bool, A::Error> {
        while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(false)
    }
}
