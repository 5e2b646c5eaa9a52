//! Keys of a model file: meaning, kind of value, unit, default and an example of each.
//!
//! `keys!` declares the struct that reads a map together with this documentation, so that the reader, `kmcfit explain` and
//! the JSON schema cannot disagree.

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

/// Declares a map of a model file: a struct that serde reads, and the documentation of its keys. A field that is no
/// `Option` is a required key.
macro_rules! keys {
    (
        $(#[doc = $text:literal])+
        pub struct $name:ident $(($derive:ident))? = $group:literal, expecting $expecting:literal {$(
            $(#[doc = $about:literal])+
            $key:ident: $value:ty,
            example $example:literal
            $(, unit $unit:literal)?
            $(, default $default:literal)?;
        )+}
    ) => {
        $(#[doc = $text])+
        #[derive(Debug, Clone, $($derive,)? PartialEq)]
        pub struct $name {$(
            $(#[doc = $about])+
            pub $key: $value,
        )+}

        impl $name {
            /// The keys of the map.
            pub const GROUP: &'static $crate::config::key::Group = {
                static GROUP: $crate::config::key::Group = $crate::config::key::Group {
                    name: $group,
                    text: concat!($($text),+).trim_ascii_start(),
                    keys: &[$($crate::config::key::Key {
                        name: stringify!($key),
                        kind: <$value as $crate::config::value::Value>::KIND,
                        text: concat!($($about),+).trim_ascii_start(),
                        example: $example,
                        unit: $crate::config::key::given(&[$($unit)?]),
                        default: $crate::config::key::given(&[$($default)?]),
                        required: <$value as $crate::config::value::Value>::REQUIRED,
                    }),+],
                };
                &GROUP
            };
        }

        impl $crate::config::value::Value for $name {
            const KIND: $crate::config::key::Kind = $crate::config::key::Kind::Map($name::GROUP);

            fn scalar(
                scalar: $crate::config::value::Scalar<'_>,
            ) -> Result<Self, $crate::config::value::Mistake> {
                Err(scalar.wrong_kind($expecting))
            }

            fn map<'de, A: serde::de::MapAccess<'de>>(
                mut map: A,
                report: &$crate::config::value::Report,
            ) -> Result<Self, A::Error> {
                $(let mut $key: Option<$value> = None;)+
                while let Some(key) = report.key(&mut map, Self::GROUP.keys)? {
                    $(if key == stringify!($key) {
                        report.field(&mut map, stringify!($key), &mut $key)?;
                    })+
                }
                Ok(Self {$(
                    $key: report.required($key, stringify!($key))?,
                )+})
            }
        }
    };
}

/// The only text, if there is one.
pub const fn given(texts: &[&'static str]) -> Option<&'static str> {
    match texts {
        [] => None,
        [text, ..] => Some(text),
    }
}

pub(super) use keys;
