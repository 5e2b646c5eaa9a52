//! Choices from a list of names.

use super::reader::{Mistake, Scalar};
use crate::spelling::did_you_mean;
use crate::text_io::{one_of, quote};

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

            /// Every name in the YAML with its meaning.
            pub const NAMES: &'static [(&'static str, &'static str)] =
                &[$(($word, concat!($($variant_doc),+).trim_ascii_start()),)+];

            /// The name in the YAML.
            pub fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl $crate::config::reader::Value for $name {
            const KIND: $crate::config::key::ValueType = $crate::config::key::ValueType::Choice(Self::NAMES);
            fn scalar(
                scalar: $crate::config::reader::Scalar<'_>,
            ) -> Result<Self, $crate::config::reader::Mistake> {
                $crate::config::choice::choose(scalar, Self::ALL)
            }
        }
    };
    // A re-exported enum of the core.
    (
        $(#[$doc:meta])*
        pub type $name:ident = $kind:ty { $( $(#[doc = $variant_doc:literal])+ $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$doc])*
        pub type $name = $kind;

        impl $crate::config::reader::Value for $kind {
            const KIND: $crate::config::key::ValueType = $crate::config::key::ValueType::Choice(&[
                $(($word, concat!($($variant_doc),+).trim_ascii_start()),)+
            ]);
            fn scalar(
                scalar: $crate::config::reader::Scalar<'_>,
            ) -> Result<Self, $crate::config::reader::Mistake> {
                $crate::config::choice::choose(scalar, &[$(($word, <$kind>::$variant),)+])
            }
        }
    };
}
pub(super) use choice;

/// Reads one of a list of names.
pub(super) fn choose<T: Copy>(scalar: Scalar<'_>, choices: &[(&str, T)]) -> Result<T, Mistake> {
    let names = || choices.iter().map(|(name, _)| *name);
    let expected = one_of(names());
    let Scalar::Text(word) = scalar else {
        return Err(scalar.refused("not one of the choices", expected));
    };
    let choice = choices.iter().find(|(name, _)| *name == word);
    choice.map(|(_, choice)| *choice).ok_or(Mistake::Value {
        problem: "unknown choice",
        found: quote(word),
        expected,
        hint: did_you_mean(word, names()),
    })
}
