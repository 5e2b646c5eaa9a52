//! Keys of a model file: meaning, kind of value, unit, default and an example of each.
//!
//! `keys!` (`map.rs`) declares the struct that reads a map together with this documentation, so that the reader,
//! `kmcfit explain` and the JSON schema cannot disagree.

/// What may stand behind a key.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// The version of the file format: 1.
    Format,
    /// A finite number.
    Number,
    /// An integer, 0 or more.
    Count,
    /// A text that is not empty.
    Text,
    /// `true` or `false`.
    Bool,
    /// A column of a file, by its name or its number from 1.
    Column,
    /// One word.
    Word(&'static str),
    /// One of these words, each with what it means.
    Choice(&'static [(&'static str, &'static str)]),
    /// A map with these keys.
    Map(&'static Group),
    /// A list.
    List(&'static Kind),
    /// One of several kinds.
    AnyOf(&'static [Kind]),
}

/// Keys that stand together in one map.
#[derive(Debug)]
pub struct Group {
    /// Its name in the schema.
    pub name: &'static str,
    /// What the map says, in one sentence.
    pub text: &'static str,
    /// Its keys, in the order of the reader.
    pub keys: &'static [Key],
}

/// One key.
#[derive(Debug)]
pub struct Key {
    /// As it is written.
    pub name: &'static str,
    /// What may stand behind it.
    pub kind: Kind,
    /// What it says.
    pub text: &'static str,
    /// What may be written behind it.
    pub example: &'static str,
    /// The unit, where it has one.
    pub unit: Option<&'static str>,
    /// What holds without it, where something does.
    pub default: Option<&'static str>,
    /// Whether it must be there.
    pub required: bool,
}

impl Kind {
    /// The maps that may stand here, those in lists included.
    pub fn groups(self) -> Vec<&'static Group> {
        match self {
            Kind::Map(group) => vec![group],
            Kind::List(inner) => inner.groups(),
            Kind::AnyOf(kinds) => kinds.iter().flat_map(|kind| kind.groups()).collect(),
            _ => Vec::new(),
        }
    }
}
