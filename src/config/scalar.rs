//! The values of a model file: numbers, counts, texts, and choices from a list.
//!
//! Each type reads itself, so that a mistake is reported at its line with words of its own.

use std::fmt;
use std::ops::Deref;
use std::path::Path;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};

use super::complaint::Complaint;
use super::spec::{ColumnSpec, WeightRule};
use crate::input::quote;

/// What YAML holds at one place, as far as a value's reader wants to know.
#[derive(Debug, Clone, Copy)]
pub(super) enum Scalar<'a> {
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
    pub(super) fn describe(self) -> String {
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
pub(super) trait FromScalar: Sized {
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

/// The version of the file format: 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format;

impl Format {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Integer(1) => Ok(Self),
            Scalar::Integer(_) => Err(Complaint::new(
                "this version of the program cannot read that format",
                scalar.describe(),
                "1",
            )
            .hint(Some("a newer version of the program may".to_owned()))),
            other => Err(Complaint::new("not a format number", other.describe(), "1")),
        }
    }
}

deserialize_scalar!(Format, Format::read, "the format number 1");

/// A finite number; an integer will do.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Number(pub f64);

impl Number {
    /// What a number is expected to be.
    const EXPECTED: &'static str = "a finite number";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Self::read_or(scalar, Self::EXPECTED)
    }

    /// As `read`, where something else would do as well.
    fn read_or(scalar: Scalar<'_>, expected: &str) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Integer(value) => Ok(Self(value as f64)),
            Scalar::Float(value) if value.is_finite() => Ok(Self(value)),
            Scalar::Float(_) => Err(Complaint::new(
                "not a finite number",
                scalar.describe(),
                expected,
            )),
            Scalar::Text(text) => {
                Err(Complaint::new("not a number", scalar.describe(), expected)
                    .hint(number_in(text)))
            }
            other => Err(Complaint::new("not a number", other.describe(), expected)),
        }
    }
}

impl From<Number> for f64 {
    fn from(number: Number) -> f64 {
        number.0
    }
}

deserialize_scalar!(Number, Number::read, Number::EXPECTED);

/// A number of things: an integer, 0 or more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(pub usize);

impl Count {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let complaint = |problem| Complaint::new(problem, scalar.describe(), "an integer");
        match scalar {
            Scalar::Integer(value) if value < 0 => Err(Complaint::new(
                "a count cannot be negative",
                scalar.describe(),
                "an integer, 0 or more",
            )),
            Scalar::Integer(value) => usize::try_from(value)
                .map(Self)
                .map_err(|_| complaint("the count is too large")),
            Scalar::Float(value) if value.fract() == 0.0 && (0.0..1e15).contains(&value) => {
                Err(complaint("not an integer").hint(Some(format!("write {value}"))))
            }
            Scalar::Text(text) => Err(complaint("not an integer").hint(number_in(text))),
            _ => Err(complaint("not an integer")),
        }
    }
}

impl From<Count> for usize {
    fn from(count: Count) -> usize {
        count.0
    }
}

deserialize_scalar!(Count, Count::read, "an integer, 0 or more");

/// What to write instead of a text that was probably meant as a number.
fn number_in(text: &str) -> Option<String> {
    let text = text.trim();
    let finite = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    if text.chars().count() > 64 || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Ok(value) = text.parse::<f64>() {
        return Some(if value.is_finite() {
            format!("write {value}, without quotes or leading zeros")
        } else {
            "the number is too large".to_owned()
        });
    }
    if let Some(value) = finite(&text.replace(['_', ' ', '\''], "")) {
        return Some(format!("write {value}"));
    }
    if text.matches(',').count() == 1
        && let Some(value) = finite(&text.replace(',', "."))
    {
        return Some(format!("write {value}, with a decimal point"));
    }
    let (value, rest) = text
        .char_indices()
        .rev()
        .find_map(|(end, _)| Some((finite(&text[..end])?, &text[end..])))?;
    rest.trim_start()
        .starts_with(|c: char| c.is_alphabetic() || "°%".contains(c))
        .then(|| format!("write {value} alone, without a unit"))
}

/// A text that is not empty: a title, a name, a column, the path of a file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Text(pub String);

impl Deref for Text {
    type Target = str;
    fn deref(&self) -> &str {
        &self.0
    }
}

impl AsRef<Path> for Text {
    fn as_ref(&self) -> &Path {
        Path::new(&self.0)
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Text {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text("") | Scalar::Nothing => {
                Err(Complaint::new("the text is empty", "nothing", "text"))
            }
            Scalar::Text(text) => Ok(Self(text.to_owned())),
            other => Err(Complaint::new("not a text", other.describe(), "text")),
        }
    }
}

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Text;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("text")
            }
            scalar_visits!(Text, Text::read);
        }
        // Asked for as text, a name such as 12 or 1.50 keeps its spelling.
        deserializer.deserialize_str(Reader)
    }
}

/// A number, or a column of a file with one value per line.
#[derive(Debug, Clone, PartialEq)]
pub enum NumberOrColumn {
    /// The same number at all times.
    Number(Number),
    /// Values over time.
    Column(ColumnSpec),
}

impl NumberOrColumn {
    const EXPECTED: &'static str = "a finite number, or a column: {data: file.csv, column: name}";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Number::read_or(scalar, Self::EXPECTED).map(Self::Number)
    }
}

impl<'de> Deserialize<'de> for NumberOrColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = NumberOrColumn;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(NumberOrColumn::EXPECTED)
            }
            scalar_visits!(NumberOrColumn, NumberOrColumn::read);
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NumberOrColumn, A::Error> {
                ColumnSpec::deserialize(MapAccessDeserializer::new(map)).map(NumberOrColumn::Column)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

/// Elements of a list, each with its own place in messages.
fn elements<'de, T: Deserialize<'de>, A: SeqAccess<'de>>(mut list: A) -> Result<Vec<T>, A::Error> {
    let mut elements = Vec::new();
    while let Some(element) = list.next_element()? {
        elements.push(element);
    }
    Ok(elements)
}

/// Where a fit starts: a number, a list of values, or a column of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// The same number at all times.
    Number(Number),
    /// One value per parameter; what they are depends on the basis.
    List(Vec<Number>),
    /// Values over time.
    Column(ColumnSpec),
}

impl Start {
    const EXPECTED: &'static str =
        "a finite number, a list of numbers, or a column: {data: file.csv, column: name}";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Number::read_or(scalar, Self::EXPECTED).map(Self::Number)
    }
}

impl<'de> Deserialize<'de> for Start {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Start;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(Start::EXPECTED)
            }
            scalar_visits!(Start, Start::read, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Start, A::Error> {
                elements(list).map(Start::List)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Start, A::Error> {
                ColumnSpec::deserialize(MapAccessDeserializer::new(map)).map(Start::Column)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

/// Break points: how many, equally spaced over the record, or their times in s.
#[derive(Debug, Clone, PartialEq)]
pub enum Knots {
    /// So many over the record, both ends included.
    Count(Count),
    /// At these times, in s.
    Times(Vec<Number>),
}

impl Knots {
    const EXPECTED: &'static str = "an integer (so many, equally spaced), or a list of times in s";

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let count = Count::read(scalar).map(Self::Count);
        count.map_err(|complaint| Complaint {
            expected: Self::EXPECTED.to_owned(),
            ..complaint
        })
    }
}

impl<'de> Deserialize<'de> for Knots {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Knots;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(Knots::EXPECTED)
            }
            scalar_visits!(Knots, Knots::read, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Knots, A::Error> {
                elements(list).map(Knots::Times)
            }
            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<Knots, A::Error> {
                Knots::read(Scalar::Map).map_err(A::Error::custom)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

/// The weight of a penalty: a number, or the name of a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    /// Given.
    Number(Number),
    /// Chosen from the data.
    Rule(WeightRule),
}

impl Weight {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let names = || WeightRule::ALL.iter().map(|(name, _)| *name);
        let expected = format!("a finite number, or {}", crate::input::one_of(names()));
        let weight = match scalar {
            Scalar::Text(word) if number_in(word).is_none() => {
                choose(scalar, WeightRule::ALL).map(Self::Rule)
            }
            other => Number::read(other).map(Self::Number),
        };
        weight.map_err(|complaint| Complaint {
            expected,
            ..complaint
        })
    }
}

deserialize_scalar!(Weight, Weight::read, "a number or the name of a rule");

/// One map, or a list of such maps.
#[derive(Debug, Clone, PartialEq)]
pub enum OneOrMany<T> {
    /// One map.
    One(T),
    /// A list of maps.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// Every map with its place behind the key: nothing, or an index such as `[1]`.
    pub fn iter(&self) -> impl Iterator<Item = (String, &T)> {
        let (list, indexed) = match self {
            Self::One(one) => (std::slice::from_ref(one), false),
            Self::Many(list) => (list.as_slice(), true),
        };
        list.iter().enumerate().map(move |(i, one)| {
            let place = if indexed {
                format!("[{i}]")
            } else {
                String::new()
            };
            (place, one)
        })
    }

    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        Err(Complaint::new(
            "this is the wrong kind of value",
            scalar.describe(),
            "a map, or a list of maps",
        ))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = OneOrMany<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map, or a list of maps")
            }
            scalar_visits!(OneOrMany<T>, OneOrMany::read, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMany<T>, A::Error> {
                elements(list).map(OneOrMany::Many)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<OneOrMany<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(OneOrMany::One)
            }
        }
        deserializer.deserialize_any(Reader(std::marker::PhantomData))
    }
}

/// One value, or a list of values.
#[derive(Debug, Clone, PartialEq)]
pub enum OneOrList<T> {
    /// One value.
    One(T),
    /// A list.
    List(Vec<T>),
}

impl<T> OneOrList<T> {
    /// The values.
    pub fn values(&self) -> &[T] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::List(list) => list,
        }
    }

    /// The key of value `i` below the key of them all: nothing, or an index such as `[1]`.
    pub fn place(&self, i: usize) -> String {
        match self {
            Self::One(_) => String::new(),
            Self::List(_) => format!("[{i}]"),
        }
    }
}

fn one_or_list<T: FromScalar>(scalar: Scalar<'_>) -> Result<OneOrList<T>, Complaint> {
    let value = T::from_scalar(scalar).map(OneOrList::One);
    value.map_err(|complaint| Complaint {
        expected: format!("{}, or a list of such", complaint.expected),
        ..complaint
    })
}

impl<'de, T: FromScalar + Deserialize<'de>> Deserialize<'de> for OneOrList<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T>(std::marker::PhantomData<T>);
        impl<'de, T: FromScalar + Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = OneOrList<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("one value, or a list of values")
            }
            scalar_visits!(OneOrList<T>, one_or_list, but lists);
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrList<T>, A::Error> {
                elements(list).map(OneOrList::List)
            }
            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<OneOrList<T>, A::Error> {
                one_or_list(Scalar::Map).map_err(A::Error::custom)
            }
        }
        deserializer.deserialize_any(Reader(std::marker::PhantomData))
    }
}

/// Reads one of a list of names.
pub(super) fn choose<T: Copy>(scalar: Scalar<'_>, choices: &[(&str, T)]) -> Result<T, Complaint> {
    let names = || choices.iter().map(|(name, _)| *name);
    let expected = crate::input::one_of(names());
    let Scalar::Text(word) = scalar else {
        return Err(Complaint::new(
            "not one of the choices",
            scalar.describe(),
            expected,
        ));
    };
    match choices.iter().find(|(name, _)| *name == word) {
        Some((_, choice)) => Ok(*choice),
        None => Err(Complaint::new("unknown choice", quote(word), expected)
            .hint(crate::near::did_you_mean(word, names()))),
    }
}

/// An enum whose variants are names in the YAML.
macro_rules! choice {
    (
        $(#[$doc:meta])*
        pub enum $name:ident { $( $(#[$variant_doc:meta])* $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $( $(#[$variant_doc])* $variant, )+ }

        impl $name {
            /// Every choice with its name in the YAML.
            pub const ALL: &'static [(&'static str, Self)] = &[$(($word, Self::$variant),)+];

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

        deserialize_scalar!($name, $name::read, "one of a list of names");
    };
}
pub(super) use {choice, deserialize_scalar, scalar_visits};
