//! Declaration of the maps of a model file.

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
            $(, default $default:literal)?
            $(, range $range:literal)?
            $(, needs $needs:literal)?;
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
            pub const GROUP: &'static $crate::config::key::KeyGroup = {
                static GROUP: $crate::config::key::KeyGroup = $crate::config::key::KeyGroup {
                    name: $group,
                    text: concat!($($text),+).trim_ascii_start(),
                    keys: &[$($crate::config::key::KeyDoc {
                        name: stringify!($key),
                        kind: <$value as $crate::config::reader::Value>::KIND,
                        text: concat!($($about),+).trim_ascii_start(),
                        example: $example,
                        unit: $crate::config::map::given(&[$($unit)?]),
                        default: $crate::config::map::given(&[$($default)?]),
                        range: $crate::config::map::given(&[$($range)?]),
                        needs: $crate::config::map::given(&[$($needs)?]),
                        required: <$value as $crate::config::reader::Value>::REQUIRED,
                    }),+],
                };
                &GROUP
            };
        }

        impl $crate::config::reader::Value for $name {
            const KIND: $crate::config::key::ValueType = $crate::config::key::ValueType::Map($name::GROUP);

            fn scalar(
                scalar: $crate::config::reader::Scalar<'_>,
            ) -> Result<Self, $crate::config::reader::Mistake> {
                Err(scalar.wrong_kind($expecting))
            }

            fn map<'de, A: serde::de::MapAccess<'de>>(
                mut map: A,
                report: &$crate::config::reader::Report,
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
