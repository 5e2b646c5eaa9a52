//! The values of a model file: numbers, counts, texts, and choices from a list.
//!
//! Each type reads itself, so that a mistake is reported at its line with words of its own. Here is
//! what they share: what YAML holds at one place, and the macros that make a reader of it.

use super::complaint::Complaint;
use crate::input::quote;

/// What YAML holds at one place, as far as a value's reader wants to know.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) enum Scalar<'a> {
    Nothing,
    Bool(bool),
    Integer(i128),
    Float(f64),
    Text(&'a str),
    List,
    Map,
    Tag,
}

impl Scalar<'_> {
    /// How a message calls it.
    pub(in crate::config) fn describe(self) -> String {
        match self {
            Scalar::Nothing => "nothing".to_owned(),
            Scalar::Bool(value) => format!("the truth value {value}"),
            Scalar::Integer(value) => format!("the integer {value}"),
            Scalar::Float(value) if value.is_nan() => ".nan, which is not a number".to_owned(),
            Scalar::Float(value) if value.is_infinite() => "an infinite number".to_owned(),
            Scalar::Float(value) if value.abs() >= 1e15 => {
                format!("the floating-point number {value:e}")
            }
            Scalar::Float(value) => format!("the floating-point number {value}"),
            Scalar::Text(text) => format!("text {}", quote(text)),
            Scalar::List => "a list".to_owned(),
            Scalar::Map => "a map".to_owned(),
            Scalar::Tag => "a value with a YAML tag (`!…`)".to_owned(),
        }
    }
}

/// The visits that hand a scalar to `$convert`; lists and maps can only be refused there. With
/// `but lists` the visitor reads those itself.
macro_rules! scalar_visits {
    ($value:ty, $convert:path) => {
        scalar_visits!($value, $convert, but lists);
        fn visit_seq<A: SeqAccess<'de>>(self, _: A) -> Result<$value, A::Error> {
            $convert(Scalar::List).map_err(A::Error::custom)
        }
    };
    ($value:ty, $convert:path, but lists) => {
        fn visit_unit<E: Error>(self) -> Result<$value, E> {
            $convert(Scalar::Nothing).map_err(E::custom)
        }
        fn visit_none<E: Error>(self) -> Result<$value, E> {
            $convert(Scalar::Nothing).map_err(E::custom)
        }
        fn visit_bool<E: Error>(self, value: bool) -> Result<$value, E> {
            $convert(Scalar::Bool(value)).map_err(E::custom)
        }
        fn visit_u64<E: Error>(self, value: u64) -> Result<$value, E> {
            $convert(Scalar::Integer(value.into())).map_err(E::custom)
        }
        fn visit_i64<E: Error>(self, value: i64) -> Result<$value, E> {
            $convert(Scalar::Integer(value.into())).map_err(E::custom)
        }
        fn visit_i128<E: Error>(self, value: i128) -> Result<$value, E> {
            $convert(Scalar::Integer(value)).map_err(E::custom)
        }
        fn visit_u128<E: Error>(self, value: u128) -> Result<$value, E> {
            let integer = i128::try_from(value).map(Scalar::Integer);
            $convert(integer.unwrap_or(Scalar::Float(value as f64))).map_err(E::custom)
        }
        fn visit_f64<E: Error>(self, value: f64) -> Result<$value, E> {
            $convert(Scalar::Float(value)).map_err(E::custom)
        }
        fn visit_str<E: Error>(self, value: &str) -> Result<$value, E> {
            $convert(Scalar::Text(value)).map_err(E::custom)
        }
        fn visit_enum<A: EnumAccess<'de>>(self, _: A) -> Result<$value, A::Error> {
            $convert(Scalar::Tag).map_err(A::Error::custom)
        }
    };
}

/// A value that is read from one scalar.
pub(in crate::config) trait FromScalar: Sized {
    /// The value, or what is wrong with it.
    fn from_scalar(scalar: Scalar<'_>) -> Result<Self, Complaint>;
}

/// `Deserialize` by a function from [`Scalar`] to the value or a complaint.
macro_rules! deserialize_scalar {
    ($value:ty, $convert:path, $expecting:expr) => {
        impl $crate::config::scalar::FromScalar for $value {
            fn from_scalar(
                scalar: $crate::config::scalar::Scalar<'_>,
            ) -> Result<Self, $crate::config::complaint::Complaint> {
                $convert(scalar)
            }
        }

        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Reader;
                impl<'de> Visitor<'de> for Reader {
                    type Value = $value;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        write!(f, "{}", $expecting)
                    }
                    scalar_visits!($value, $convert);
                    fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<$value, A::Error> {
                        $convert(Scalar::Map).map_err(A::Error::custom)
                    }
                }
                deserializer.deserialize_any(Reader)
            }
        }
    };
}

/// An enum whose variants are names in the YAML.
macro_rules! choice {
    (
        $(#[$doc:meta])*
        pub enum $name:ident { $( $(#[doc = $variant_doc:literal])+ $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $( $(#[doc = $variant_doc])+ $variant, )+ }

        impl $name {
            /// Every choice with its name in the YAML.
            pub const ALL: &'static [(&'static str, Self)] = &[$(($word, Self::$variant),)+];

            /// Every name in the YAML with what it means.
            pub const NAMES: &'static [(&'static str, &'static str)] =
                &[$(($word, concat!($($variant_doc),+).trim_ascii_start()),)+];

            /// The name in the YAML.
            pub fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }

            fn read(
                scalar: $crate::config::scalar::Scalar<'_>,
            ) -> Result<Self, $crate::config::complaint::Complaint> {
                $crate::config::scalar::choose(scalar, Self::ALL)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl $crate::config::key::Value for $name {
            const KIND: $crate::config::key::Kind = $crate::config::key::Kind::Choice(Self::NAMES);
        }

        deserialize_scalar!($name, $name::read, "one of a list of names");
    };
}

pub(super) use {choice, deserialize_scalar, scalar_visits};

// After the macros, which they use.
mod column;
mod count;
mod either;
mod estimate;
mod format;
mod knots;
mod list;
mod names;
mod nodes;
mod number;
mod over_time;
mod text;
mod weight;
mod written;

pub use column::ColumnId;
pub use count::Count;
pub use either::ScalarOr;
pub use estimate::{Estimate, NumberOrEstimate, Sigma};
pub use format::Format;
pub use knots::Knots;
pub use list::{OneOrList, OneOrMany};
pub(super) use names::choose;
pub use nodes::Nodes;
pub use number::Number;
pub use over_time::{ColumnSpec, NumberOrColumn, Start};
pub use text::Text;
pub use weight::{Weight, WeightRule};
