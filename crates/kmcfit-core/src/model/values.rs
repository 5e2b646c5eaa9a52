//! Values that may be written in several ways.

use crate::constraints::TimeHistory;
use crate::functions::WeightRule;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use std::fmt;

/// Enums of words of the model file.
macro_rules! words {
    (
        $(#[$about:meta])+
        pub enum $name:ident { $( $(#[$meaning:meta])+ $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$about])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
        pub enum $name { $( $(#[$meaning])+ #[serde(rename = $word)] $variant, )+ }

        impl $name {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The word.
            pub fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}
pub(crate) use words;

/// Types with one word each.
macro_rules! word {
    ($($(#[$about:meta])+ $name:ident = $word:literal;)+) => {$(
        $(#[$about])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, JsonSchema)]
        #[schemars(inline, extend("const" = $word))]
        pub struct $name;

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                match String::deserialize(from)?.as_str() {
                    $word => Ok(Self),
                    other => Err(D::Error::custom(format!("`{other}` in place of `{}`", $word))),
                }
            }
        }
    )+};
}

word! {
    /// An estimated value.
    EstimateWord = "estimate";
    /// A bound that is lifted.
    NoneWord = "none";
    /// A mass that is not known.
    UnknownWord = "unknown";
    /// An automatic choice.
    AutoWord = "auto";
}

/// The version of the file format: 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, JsonSchema)]
#[schemars(inline, extend("const" = 1))]
pub struct FormatVersion;

impl<'de> Deserialize<'de> for FormatVersion {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match u64::deserialize(from)? {
            1 => Ok(Self),
            other => Err(D::Error::custom(format!("format {other} in place of 1"))),
        }
    }
}

/// A single value, or a map with further settings.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum ScalarOr<S, M> {
    /// One value.
    Scalar(S),
    /// A map.
    Map(M),
}

/// One value, or a list of values.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
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

    /// The values, each with the suffix of its key as in [`suffix`](Self::suffix).
    pub fn iter(&self) -> impl Iterator<Item = (String, &T)> {
        (self.values().iter().enumerate()).map(|(i, value)| (self.suffix(i), value))
    }

    /// Suffix of the key of value `i`: empty for a single value, else an index such as `[1]`.
    pub fn suffix(&self, i: usize) -> String {
        match self {
            Self::One(_) => String::new(),
            Self::List(_) => format!("[{i}]"),
        }
    }
}

/// A column of a file, by its name or by its number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline, extend("column" = true))]
pub enum ColumnId {
    /// By number, from 1.
    Number(usize),
    /// By name.
    Name(String),
}

impl fmt::Display for ColumnId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Number(number) => write!(f, "column {number}"),
        }
    }
}

/// Standard deviation of the samples: a number, a column of the file, or the word `estimate`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum SigmaValue {
    /// The same for all samples.
    Number(f64),
    /// Estimated from the residuals of the fit.
    Estimate(EstimateWord),
    /// One for each sample.
    Column(String),
}

/// Number of nodes of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Nodes {
    /// Given.
    Count(usize),
    /// Chosen from the frequency content of the data.
    Auto(AutoWord),
}

/// Break points: their number, equally spaced over the record, or their times in s.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum KnotSpec {
    /// Number of equally spaced break points over the record, both ends included.
    Count(usize),
    /// Times, s.
    Times(Vec<f64>),
    /// About 40 intervals, with a smoothness that the data choose.
    Auto(AutoWord),
}

/// The weight of a penalty: a number, or the name of a rule.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum WeightChoice {
    /// Given.
    Number(f64),
    /// Chosen from the data by a rule.
    Rule(WeightRule),
}

/// A column of a file with times in `t_s`, interpolated linearly between its rows.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "column", extend("expecting" = "a column: {data: file.csv, column: name}"))]
pub struct ColumnSpec {
    /// The file, relative to the model file; the `functions.csv` of a finished run is one.
    #[schemars(extend("example" = "coefficients.csv"))]
    pub data: String,
    /// Name of the column.
    #[schemars(extend("example" = "mass_kg"))]
    pub column: String,
}

/// A number, or a column of a file with one value per line.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum NumberOrColumn {
    /// The same number at all times.
    Number(f64),
    /// Values over time, in a file.
    Column(ColumnSpec),
    /// Values at the nodes.
    #[serde(skip)]
    History(TimeHistory),
}

/// Known values: a number with its standard deviation, or a column of a file with times in `t_s`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    rename = "known_value",
    extend("expecting" = "{value: 4.5, sigma: 0.02}, a column: {data: file.csv, column: name}")
)]
pub struct KnownValueMap {
    /// Known value.
    #[schemars(extend("example" = "4.5", "unit" = "that of the function", "needs" = "`sigma`"))]
    pub value: Option<f64>,
    /// Standard deviation of the known value, which enters all confidence intervals.
    #[schemars(extend(
        "example" = "0.02",
        "unit" = "that of the function",
        "range" = "greater than 0",
        "needs" = "`value`; `sigma` in every experiment, and a method other than equation-error"
    ))]
    pub sigma: Option<f64>,
    /// The file, relative to the model file.
    #[schemars(extend("example" = "coefficients.csv", "needs" = "`column`"))]
    pub data: Option<String>,
    /// Name of the column.
    #[schemars(extend("example" = "mass_kg", "needs" = "`data`"))]
    pub column: Option<String>,
}

/// Known values of a function: a number, a number with its standard deviation, or a column of a file; or a mass that is not known.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum KnownValue {
    /// The same number at all times.
    Number(f64),
    /// Not known: all other coefficients are ratios to this mass.
    Unknown(UnknownWord),
    /// Number with its standard deviation, or values over time, in a file.
    Map(KnownValueMap),
    /// Values at the nodes.
    #[serde(skip)]
    History(TimeHistory),
}

/// A bound of a function: a number or a column, or the word `none`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Bound {
    /// Bound over time.
    At(NumberOrColumn),
    /// No bound, not even a default one.
    None(NoneWord),
}

/// Start value of a function: a number, a list of values, or a column of a file.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum StartSpec {
    /// The same number at all times.
    Number(f64),
    /// One value per parameter; their meaning depends on the basis.
    List(Vec<f64>),
    /// Values over time, in a file.
    Column(ColumnSpec),
    /// Values at the nodes, projected onto the basis.
    #[serde(skip)]
    Nodal(Vec<f64>),
}
