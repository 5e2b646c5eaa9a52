//! Values that may change over time: a number, a list, or a column of a file.

use super::list::elements;
use super::{Number, Scalar, Text};
use crate::config::complaint::Complaint;
use crate::config::key::keys;
use crate::config::key::{Kind, Value};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

keys! {
    /// A column of a file with times in `t_s`, read linearly between its rows.
    pub struct ColumnSpec = "column", expecting "a map such as {data: file.csv, column: mass_kg}" {
        /// The file, relative to the model file; the `functions.csv` of a finished run is one.
        data: Text, example "device.csv";
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

impl Value for NumberOrColumn {
    const KIND: Kind = Kind::AnyOf(&[Kind::Number, ColumnSpec::KIND]);
}

impl Value for Start {
    const KIND: Kind = Kind::AnyOf(&[Kind::Number, Kind::List(&Kind::Number), ColumnSpec::KIND]);
}
