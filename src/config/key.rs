//! Keys of a model file: meaning, kind of value, unit, default and an example of each.
//!
//! `keys!` (`map.rs`) declares the struct that reads a map together with this documentation, from which `kmcfit explain` and
//! the JSON schema are generated.

/// Type of a value.
#[derive(Debug, Clone, Copy)]
pub enum ValueType {
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
    Map(&'static KeyGroup),
    /// A list.
    List(&'static ValueType),
    /// One of several kinds.
    AnyOf(&'static [ValueType]),
}

/// Keys of one map.
#[derive(Debug)]
pub struct KeyGroup {
    /// Its name in the schema.
    pub name: &'static str,
    /// Meaning of the map, as a sentence.
    pub text: &'static str,
    /// Its keys, in the order of declaration.
    pub keys: &'static [KeyDoc],
}

/// A key.
#[derive(Debug, Clone, Copy)]
pub struct KeyDoc {
    /// Name in the file.
    pub name: &'static str,
    /// Type of its value.
    pub kind: ValueType,
    /// Meaning.
    pub text: &'static str,
    /// Example of a value.
    pub example: &'static str,
    /// Unit, if it has one.
    pub unit: Option<&'static str>,
    /// Default, if it has one.
    pub default: Option<&'static str>,
    /// Range of its numbers, if it is limited.
    pub range: Option<&'static str>,
    /// Keys and values without which it is refused or unused, if any.
    pub needs: Option<&'static str>,
    /// True for a required key.
    pub required: bool,
}

impl ValueType {
    /// Maps among the values of this type, those in lists included.
    pub fn groups(self) -> Vec<&'static KeyGroup> {
        match self {
            ValueType::Map(group) => vec![group],
            ValueType::List(inner) => inner.groups(),
            ValueType::AnyOf(kinds) => kinds.iter().flat_map(|kind| kind.groups()).collect(),
            _ => Vec::new(),
        }
    }
}
