//! Keys of a model file: meaning, kind of value, unit, default and an example of each.
//!
//! `keys!` (`map.rs`) declares the struct that reads a map together with this documentation, from which `kmcfit explain` and
//! the JSON schema are generated.

/// Type of a value.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// The version of the file format: 1.
    Format,
    /// A finite number.
    Number,
    /// An integer, 0 or more.
    Count,
    /// A non-empty text.
    Text,
    /// `true` or `false`.
    Bool,
    /// A column of a file, by its name or its number from 1.
    Column,
    /// One fixed word.
    Word(&'static str),
    /// One of these words, each with its meaning.
    Choice(&'static [(&'static str, &'static str)]),
    /// A map with these keys.
    Map(&'static Group),
    /// A list.
    List(&'static Kind),
    /// One of several kinds.
    AnyOf(&'static [Kind]),
}

/// Keys of one map.
#[derive(Debug)]
pub struct Group {
    /// Its name in the schema.
    pub name: &'static str,
    /// Meaning of the map, as a sentence.
    pub text: &'static str,
    /// Its keys, in the order of the reader.
    pub keys: &'static [Key],
}

/// A key.
#[derive(Debug)]
pub struct Key {
    /// Name in the file.
    pub name: &'static str,
    /// Type of its value.
    pub kind: Kind,
    /// Meaning.
    pub text: &'static str,
    /// Example of a value.
    pub example: &'static str,
    /// Unit, if it has one.
    pub unit: Option<&'static str>,
    /// Default, if it has one.
    pub default: Option<&'static str>,
    /// True for a required key.
    pub required: bool,
}

impl Kind {
    /// Maps among the values of this type, those in lists included.
    pub fn groups(self) -> Vec<&'static Group> {
        match self {
            Kind::Map(group) => vec![group],
            Kind::List(inner) => inner.groups(),
            Kind::AnyOf(kinds) => kinds.iter().flat_map(|kind| kind.groups()).collect(),
            _ => Vec::new(),
        }
    }
}
