//! Values of a model file that may be written in two ways: as one value or a map, as one value or a list.

use super::key::ValueType;
use super::reader::{Mistake, Report, Scalar, Value};
use serde::de::{MapAccess, SeqAccess};

/// A single value, or a map with further settings.
#[derive(Debug, Clone, PartialEq)]
pub enum ScalarOr<S, M> {
    /// One value.
    Scalar(S),
    /// A map.
    Map(M),
}

impl<S: Value, M: Value> Value for ScalarOr<S, M> {
    const KIND: ValueType = ValueType::AnyOf(&[S::KIND, M::KIND]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        S::scalar(scalar).map(Self::Scalar)
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        M::map(map, report).map(Self::Map)
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

    /// The values, each with its key as in [`place`](Self::place).
    pub fn iter(&self) -> impl Iterator<Item = (String, &T)> {
        (self.values().iter().enumerate()).map(|(i, value)| (self.place(i), value))
    }

    /// Suffix of the key of value `i`: empty for a single value, else an index such as `[1]`.
    pub fn place(&self, i: usize) -> String {
        match self {
            Self::One(_) => String::new(),
            Self::List(_) => format!("[{i}]"),
        }
    }
}

impl<T: Value> Value for OneOrList<T> {
    const KIND: ValueType = ValueType::AnyOf(&[T::KIND, ValueType::List(&T::KIND)]);
    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        if let ValueType::Map(_) = T::KIND {
            return Err(scalar.wrong_kind("a map, or a list of maps"));
        }
        (T::scalar(scalar).map(Self::One))
            .map_err(|mistake| mistake.expecting(|one| format!("{one}, or a list of them")))
    }
    fn list<'de, A: SeqAccess<'de>>(list: A, report: &Report) -> Result<Self, A::Error> {
        report.elements(list).map(Self::List)
    }
    fn map<'de, A: MapAccess<'de>>(map: A, report: &Report) -> Result<Self, A::Error> {
        match T::KIND {
            ValueType::Map(_) => T::map(map, report).map(Self::One),
            _ => Self::scalar(Scalar::Map).map_err(|mistake| report.raise(mistake)),
        }
    }
}
