//! The registry of the keys of a model file: what each says, its kind, unit, default and an example.
//!
//! `kmcfit explain` and the JSON schema are made from this one table. It mirrors the structs of
//! [`spec`](super::spec), which read the keys; tests hold the two against each other, and every example
//! is read.

mod experiment;
mod explain;
mod fit;
mod function;
mod model;
mod schema;
mod study;

pub use explain::explain;
pub use model::{MODEL, STORY};
pub use schema::schema;

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

/// A number, or a column of a file with one value per line.
const NUMBER_OR_COLUMN: Kind = Kind::AnyOf(&[Kind::Number, Kind::Map(&function::COLUMN)]);
/// A number or a list of numbers.
const NUMBERS: Kind = Kind::AnyOf(&[Kind::Number, Kind::List(&Kind::Number)]);

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

impl Key {
    const fn new(
        name: &'static str,
        kind: Kind,
        text: &'static str,
        example: &'static str,
    ) -> Self {
        Self {
            name,
            kind,
            text,
            example,
            unit: None,
            default: None,
            required: false,
        }
    }

    const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = Some(unit);
        self
    }

    const fn default(mut self, default: &'static str) -> Self {
        self.default = Some(default);
        self
    }

    const fn required(mut self) -> Self {
        self.required = true;
        self
    }
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

/// A key and where it may stand.
#[derive(Debug, Clone)]
pub struct Found {
    /// The key.
    pub key: &'static Key,
    /// Its paths, as `functions.mass.start`, without positions in lists.
    pub paths: Vec<String>,
}

/// Every key of a model file with all its paths, each once, in the order of the table.
pub fn all() -> Vec<Found> {
    let mut found = Vec::new();
    collect(&MODEL, "", &mut found);
    collect(&STORY, "", &mut found);
    found
}

fn collect(group: &'static Group, above: &str, found: &mut Vec<Found>) {
    for key in group.keys {
        let path = match above {
            "" => key.name.to_owned(),
            above => format!("{above}.{}", key.name),
        };
        match found.iter_mut().find(|f| std::ptr::eq(f.key, key)) {
            Some(same) => same.paths.push(path.clone()),
            None => found.push(Found {
                key,
                paths: vec![path.clone()],
            }),
        }
        for inner in key.kind.groups() {
            collect(inner, &path, found);
        }
    }
}
