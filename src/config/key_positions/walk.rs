//! Visitor that follows a path and stops at its goal.

use super::Segment;
use super::key::{KeySeed, stop};
use crate::config::{reader::scalar_visits, scalar::Scalar};
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny, MapAccess, SeqAccess, Visitor,
};
use std::cell::Cell;
use std::fmt;

/// Goal at the end of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Goal {
    Value,
    Key { occurrence: usize },
}

/// Follows the rest of a path.
#[derive(Clone, Copy)]
pub(super) struct Walk<'a> {
    pub path: &'a [Segment],
    pub goal: Goal,
    pub hit: &'a Cell<bool>,
}

impl Walk<'_> {
    /// The error that stops reading at the goal.
    pub fn stop<E: Error>(&self) -> E {
        stop(self.hit)
    }

    /// Stops at a scalar that is the goal, else continues.
    fn scalar<E: Error>(self, _: Scalar<'_>) -> Result<(), E> {
        match self.path.is_empty() && self.goal == Goal::Value {
            true => Err(self.stop()),
            false => Ok(()),
        }
    }
}

impl<'de> DeserializeSeed<'de> for Walk<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("anything")
    }

    scalar_visits!(());

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
        while let Some(same) = map.next_key_seed(KeySeed {
            wanted,
            stop_flag: match self.goal {
                Goal::Key { occurrence: goal } if rest.is_empty() && goal == occurrence + 1 => {
                    Some(self.hit)
                }
                _ => None,
            },
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
