//! Types of the values of a model file: numbers, counts, texts and columns.
//!
//! Each type implements `Value` with its own error messages.

use super::choice::{choice, choose};
use super::key::ValueType;
use super::map::keys;
use super::reader::{Mistake, Report, Scalar, Value, ValueVisitor};
use crate::spelling::{did_you_mean, integer_in, number_in};
use crate::text_io::one_of;
use serde::de::{Deserializer, MapAccess, SeqAccess};
use std::fmt;
use std::ops::Deref;
use std::path::Path;

/// The word for a bound that is lifted.
const NO_BOUND: &str = "none";
/// The word for an estimated value.
const ESTIMATE: &str = "estimate";
/// The word for a mass that is not known.
const UNKNOWN: &str = "unknown";

/// The version of the file format: 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FormatVersion;

impl Value for FormatVersion {
    const KIND: ValueType = ValueType::Format;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Integer(1) => Ok(Self),
            Scalar::Integer(_) => Err(scalar
                .refused("this format version is not supported", "1")
                .suggest(Some("a newer version of kmcfit may read it".to_owned()))),
            other => Err(other.refused("not a format number", "1")),
        }
    }
}

/// A finite number, written as a float or an integer.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Number(pub f64);

impl Value for Number {
    const KIND: ValueType = ValueType::Number;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Integer(value) => Ok(Self(value as f64)),
            Scalar::Float(value) if value.is_finite() => Ok(Self(value)),
            Scalar::Float(_) => Err(scalar.refused("not a finite number", "a finite number")),
            Scalar::Text(text) => Err(scalar
                .refused("not a number", "a finite number")
                .suggest(number_in(text))),
            other => Err(other.refused("not a number", "a finite number")),
        }
    }
}

/// A count: an integer, 0 or more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(pub usize);

impl Value for Count {
    const KIND: ValueType = ValueType::Count;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let refused = |problem| scalar.refused(problem, "an integer");
        match scalar {
            Scalar::Integer(value) if value < 0 => {
                Err(scalar.refused("a count cannot be negative", "an integer, 0 or more"))
            }
            Scalar::Integer(value) => usize::try_from(value)
                .map(Self)
                .map_err(|_| refused("the number is too large")),
            Scalar::Float(value) if value.fract() == 0.0 && (0.0..1e15).contains(&value) => {
                Err(refused("not an integer").suggest(Some(format!("write {value}"))))
            }
            Scalar::Text(text) => Err(refused("not an integer").suggest(integer_in(text))),
            _ => Err(refused("not an integer")),
        }
    }
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

impl Value for Text {
    const KIND: ValueType = ValueType::Text;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Text("") | Scalar::Nothing => {
                Err(Scalar::Nothing.refused("the text is empty", "text"))
            }
            Scalar::Text(text) => Ok(Self(text.to_owned())),
            other => Err(other.refused("not a text", "text")),
        }
    }
    fn read<'de, D: Deserializer<'de>>(
        reader: ValueVisitor<'_, Self>,
        from: D,
    ) -> Result<Self, D::Error> {
        // Deserialised as text so that a name such as 12 or 1.50 keeps its spelling.
        from.deserialize_str(reader)
    }
}

/// A column of a file, by its name or by its number from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnId {
    /// By name.
    Name(String),
    /// By number, from 1.
    Number(usize),
}

impl fmt::Display for ColumnId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Number(number) => write!(f, "column {number}"),
        }
    }
}

impl Value for ColumnId {
    const KIND: ValueType = ValueType::Column;
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let refused = |scalar: Scalar<'_>, problem| {
            let expected = "the name of a column, its number from 1, or a map such as \
                            {data: other.csv, column: y_m, time: t_s}";
            Err(scalar.refused(problem, expected))
        };
        match scalar {
            Scalar::Text("") | Scalar::Nothing => refused(Scalar::Nothing, "the text is empty"),
            Scalar::Text(name) => Ok(Self::Name(name.to_owned())),
            Scalar::Integer(number) => match usize::try_from(number) {
                Ok(number) if number > 0 => Ok(Self::Number(number)),
                _ => refused(scalar, "columns are counted from 1"),
            },
            other => refused(other, "not a column"),
        }
    }
}

/// The word `estimate` in place of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EstimateWord;

impl Value for EstimateWord {
    const KIND: ValueType = ValueType::Word(ESTIMATE);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let hint = match scalar {
            Scalar::Text(ESTIMATE) => return Ok(Self),
            Scalar::Text(word) => did_you_mean(word, [ESTIMATE]),
            _ => None,
        };
        Err(scalar
            .wrong_kind("a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`")
            .suggest(hint))
    }
}

/// A number, or the word `estimate`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NumberOrEstimate {
    /// Given.
    Number(Number),
    /// Estimated with the functions.
    Estimate,
}

impl Value for NumberOrEstimate {
    const KIND: ValueType = ValueType::AnyOf(&[ValueType::Number, EstimateWord::KIND]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected = "a finite number, `estimate`, or a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}";
        match scalar {
            Scalar::Text(ESTIMATE) => Ok(Self::Estimate),
            Scalar::Text(word) if number_in(word).is_none() => Err(scalar
                .refused("neither a number nor `estimate`", expected)
                .suggest(did_you_mean(word, [ESTIMATE]))),
            other => number_or(other, expected).map(Self::Number),
        }
    }
}

/// Standard deviation of the samples: a number, a column of the file, or the word `estimate`.
#[derive(Debug, Clone, PartialEq)]
pub enum Sigma {
    /// The same for all samples.
    Number(Number),
    /// One for each sample.
    Column(String),
    /// Estimated from the residuals of the fit.
    Estimate,
}

impl Value for Sigma {
    const KIND: ValueType =
        ValueType::AnyOf(&[ValueType::Number, EstimateWord::KIND, ValueType::Text]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Text(ESTIMATE) => Ok(Self::Estimate),
            Scalar::Text(word) if number_in(word).is_none() && !word.is_empty() => {
                Ok(Self::Column(word.to_owned()))
            }
            other => number_or(
                other,
                "a finite number, the name of a column, or `estimate`",
            )
            .map(Self::Number),
        }
    }
}

/// Number of nodes of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nodes {
    /// Given.
    Count(Count),
    /// Chosen from the frequency content of the data.
    Auto,
}

impl Value for Nodes {
    const KIND: ValueType = ValueType::AnyOf(&[ValueType::Count, ValueType::Word("auto")]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        match scalar {
            Scalar::Text("auto") => Ok(Self::Auto),
            other => (Count::scalar(other).map(Self::Count))
                .map_err(|mistake| mistake.expecting(|count| format!("{count}, or `auto`"))),
        }
    }
}

/// Break points: their number, equally spaced over the record, or their times in s.
#[derive(Debug, Clone, PartialEq)]
pub enum KnotSpec {
    /// Number of equally spaced break points over the record, both ends included.
    Count(Count),
    /// Times, s.
    Times(Vec<Number>),
    /// About 40 intervals, with a smoothness that the data choose.
    Auto,
}

impl Value for KnotSpec {
    const KIND: ValueType = ValueType::AnyOf(&[
        ValueType::Count,
        ValueType::List(&ValueType::Number),
        ValueType::Word("auto"),
    ]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected = "the number of equally spaced knots, a list of times in s, or `auto`";
        match scalar {
            Scalar::Text("auto") => Ok(Self::Auto),
            other => (Count::scalar(other).map(Self::Count))
                .map_err(|mistake| mistake.expecting(|_| expected.to_owned())),
        }
    }
    fn list<'de, A: SeqAccess<'de>>(list: A, report: &Report) -> Result<Self, A::Error> {
        report.elements(list).map(Self::Times)
    }
}

choice! {
    /// Rule that chooses the weight of a penalty from the data.
    pub enum WeightRuleName {
        /// Discrepancy principle: the largest weight whose residuals agree with the noise.
        Discrepancy = "discrepancy",
        /// Restricted maximum likelihood of noise and smoothness; each penalty has its own weight.
        RestrictedLikelihood = "reml",
        /// Weight at which the function resolves changes within one dominant period of the response.
        Period = "period",
        /// For `tv`: Bayesian information criterion with the number of levels as degrees of freedom; then a fit without the
        /// penalty on the jumps found.
        Bic = "bic",
    }
}

/// The weight of a penalty: a number, or the name of a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    /// Given.
    Number(Number),
    /// Chosen from the data by a rule.
    Rule(WeightRuleName),
}

impl Value for Weight {
    const KIND: ValueType = ValueType::AnyOf(&[ValueType::Number, WeightRuleName::KIND]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let weight = match scalar {
            Scalar::Text(word) if number_in(word).is_none() => {
                choose(scalar, WeightRuleName::ALL).map(Self::Rule)
            }
            other => Number::scalar(other).map(Self::Number),
        };
        let rules = one_of(WeightRuleName::NAMES.iter().map(|(name, _)| *name));
        weight.map_err(|m| m.expecting(|_| format!("a finite number, or {rules}")))
    }
}

keys! {
    /// A column of a file with times in `t_s`, interpolated linearly between its rows.
    pub struct ColumnSpec = "column", expecting "a map such as {data: file.csv, column: mass_kg}" {
        /// The file, relative to the model file; the `functions.csv` of a finished run is one.
        data: Text, example "coefficients.csv";
        /// Name of the column.
        column: Text, example "mass_kg";
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

impl Value for NumberOrColumn {
    const KIND: ValueType = ValueType::AnyOf(&[ValueType::Number, ColumnSpec::KIND]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected = "a finite number, or a column: {data: file.csv, column: name}";
        number_or(scalar, expected).map(Self::Number)
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        ColumnSpec::map(map, report).map(Self::Column)
    }
}

keys! {
    /// Known values: a number with its standard deviation, or a column of a file with times in `t_s`.
    pub struct KnownValueMap = "known_value", expecting "{value: 4.5, sigma: 0.02}, or {data: file.csv, column: name}" {
        /// Known value.
        value: Option<Number>, example "4.5", unit "that of the function", needs "`sigma`";
        /// Standard deviation of the known value, which enters all confidence intervals.
        sigma: Option<Number>,
            example "0.02",
            unit "that of the function",
            range "greater than 0",
            needs "`value`; `sigma` in every experiment, and a method other than equation-error";
        /// The file, relative to the model file.
        data: Option<Text>, example "coefficients.csv", needs "`column`";
        /// Name of the column.
        column: Option<Text>, example "mass_kg", needs "`data`";
    }
}

/// Known values of a function: a number, a number with its standard deviation, or a column of a file; or a mass that is not known.
#[derive(Debug, Clone, PartialEq)]
pub enum KnownValue {
    /// The same number at all times.
    Number(Number),
    /// Number with its standard deviation, or values over time.
    Map(KnownValueMap),
    /// Not known: all other coefficients are ratios to this mass.
    Unknown,
}

impl Value for KnownValue {
    const KIND: ValueType = ValueType::AnyOf(&[
        ValueType::Number,
        ValueType::Word(UNKNOWN),
        KnownValueMap::KIND,
    ]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected = "a finite number, {value: 4.5, sigma: 0.02}, a column: {data: file.csv, column: name}, or for a mass `unknown`";
        match scalar {
            Scalar::Text(UNKNOWN) => Ok(Self::Unknown),
            Scalar::Text(word) if number_in(word).is_none() => Err(scalar
                .refused("neither a number nor `unknown`", expected)
                .suggest(did_you_mean(word, [UNKNOWN]))),
            other => number_or(other, expected).map(Self::Number),
        }
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        KnownValueMap::map(map, report).map(Self::Map)
    }
}

/// A bound of a function: a number or a column, or the word `none`.
#[derive(Debug, Clone, PartialEq)]
pub enum Bound {
    /// No bound, not even a default one.
    None,
    /// Bound over time.
    At(NumberOrColumn),
}

impl Value for Bound {
    const KIND: ValueType = ValueType::AnyOf(&[
        ValueType::Number,
        ValueType::Word(NO_BOUND),
        ColumnSpec::KIND,
    ]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected = "a finite number, `none`, or a column: {data: file.csv, column: name}";
        match scalar {
            Scalar::Text(NO_BOUND) => Ok(Self::None),
            Scalar::Text(word) if number_in(word).is_none() => Err(scalar
                .refused("neither a number nor `none`", expected)
                .suggest(did_you_mean(word, [NO_BOUND]))),
            other => number_or(other, expected).map(|n| Self::At(NumberOrColumn::Number(n))),
        }
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        let column = ColumnSpec::map(map, report)?;
        Ok(Self::At(NumberOrColumn::Column(column)))
    }
}

/// Start value of a function: a number, a list of values, or a column of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum StartSpec {
    /// The same number at all times.
    Number(Number),
    /// One value per parameter; their meaning depends on the basis.
    List(Vec<Number>),
    /// Values over time.
    Column(ColumnSpec),
}

impl Value for StartSpec {
    const KIND: ValueType = ValueType::AnyOf(&[
        ValueType::Number,
        ValueType::List(&ValueType::Number),
        ColumnSpec::KIND,
    ]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        let expected =
            "a finite number, a list of numbers, or a column: {data: file.csv, column: name}";
        number_or(scalar, expected).map(Self::Number)
    }
    fn list<'de, A: SeqAccess<'de>>(list: A, report: &Report) -> Result<Self, A::Error> {
        report.elements(list).map(Self::List)
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        ColumnSpec::map(map, report).map(Self::Column)
    }
}

/// A number where another type is accepted as well.
fn number_or(scalar: Scalar<'_>, expected: &str) -> Result<Number, Mistake> {
    Number::scalar(scalar).map_err(|mistake| mistake.expecting(|_| expected.to_owned()))
}
