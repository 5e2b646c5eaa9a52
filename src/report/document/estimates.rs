//! The answer of a fit in the result document: a map from names to estimates in the order of importance.

use kmcfit_core::assessment::Estimate;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Estimates by name, the most important first: in JSON a map.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Estimates(pub Vec<(String, Estimate)>);

impl Estimates {
    /// The estimate `name`.
    pub fn get(&self, name: &str) -> Option<&Estimate> {
        let found = self.0.iter().find(|(known, _)| known == name);
        found.map(|(_, estimate)| estimate)
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl Serialize for Estimates {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, estimate)| (name, estimate)))
    }
}

impl<'de> Deserialize<'de> for Estimates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Estimates;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map of estimates")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Estimates, A::Error> {
                let mut all = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    all.push(entry);
                }
                Ok(Estimates(all))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}
