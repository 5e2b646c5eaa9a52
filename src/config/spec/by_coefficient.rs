//! Maps with one key for each coefficient of the table.

use super::FunctionSpec;
use crate::config::choice::choose;
use crate::config::key::{KeyDoc, KeyGroup, ValueType};
use crate::config::reader::{Mistake, Report, Scalar, Value};
use crate::config::values::Text;
use kmcfit_core::internals::functions::CoefficientKind;
use serde::de::MapAccess;
use std::marker::PhantomData;

/// A kind of map.
pub trait CoefficientMap {
    /// Value of each key.
    type Item;
    /// Its keys.
    const GROUP: &'static KeyGroup;
    /// Number of coefficients, the first of the table, that it must have.
    const REQUIRED: usize;
    /// What is expected where it is no map.
    const EXPECTING: &'static str;
}

/// Values by coefficient, in the order of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct ByCoefficient<M: CoefficientMap> {
    list: Vec<(CoefficientKind, M::Item)>,
    map: PhantomData<M>,
}

impl<M: CoefficientMap> ByCoefficient<M> {
    /// The value of a coefficient.
    pub fn get(&self, kind: CoefficientKind) -> Option<&M::Item> {
        let mut list = self.list.iter();
        list.find(|(of, _)| *of == kind).map(|(_, value)| value)
    }

    /// Coefficients and values.
    pub fn iter(&self) -> impl Iterator<Item = (CoefficientKind, &M::Item)> {
        self.list.iter().map(|(kind, value)| (*kind, value))
    }
}

impl<M: CoefficientMap<Item: Value>> Value for ByCoefficient<M> {
    const KIND: ValueType = ValueType::Map(M::GROUP);

    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        Err(scalar.wrong_kind(M::EXPECTING))
    }

    fn map<'de, A: MapAccess<'de>>(mut map: A, report: &Report) -> Result<Self, A::Error> {
        let mut found = CoefficientKind::ALL.map(|kind| (kind, None));
        while let Some(key) = report.key(&mut map, M::GROUP.keys)? {
            let field = found.iter_mut().find(|(kind, _)| kind.name() == key);
            if let Some((_, field)) = field {
                report.field(&mut map, key, field)?;
            }
        }
        for (kind, value) in &mut found[..M::REQUIRED] {
            *value = Some(report.required(value.take(), kind.name())?);
        }
        let list = found.into_iter();
        Ok(Self {
            list: list
                .filter_map(|(kind, value)| Some((kind, value?)))
                .collect(),
            map: PhantomData,
        })
    }
}

/// The keys of a map, of which the first `required` are required and the others have a default; with an example for all, or that of the row.
const fn keys(
    value: ValueType,
    example: Option<&'static str>,
    required: usize,
    default: Option<&'static str>,
) -> [KeyDoc; CoefficientKind::COUNT] {
    let row = CoefficientKind::MASS.row();
    let mut all = [KeyDoc {
        name: row.name,
        kind: value,
        text: row.text,
        example: row.example,
        unit: None,
        default: None,
        range: None,
        needs: None,
        required: true,
    }; CoefficientKind::COUNT];
    let mut i = 0;
    while i < all.len() {
        let row = CoefficientKind::ALL[i].row();
        let key = &mut all[i];
        (key.name, key.text, key.unit) = (row.name, row.text, Some(row.units[0]));
        key.example = match example {
            Some(example) => example,
            None => row.example,
        };
        key.required = i < required;
        key.default = if key.required { None } else { default };
        i += 1;
    }
    all
}

/// Coefficient functions of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared;

impl CoefficientMap for Shared {
    type Item = FunctionSpec;
    const REQUIRED: usize = 3;
    const EXPECTING: &'static str = "a map with the keys mass, damping, stiffness";
    const GROUP: &'static KeyGroup = {
        const KIND: ValueType = <FunctionSpec as Value>::KIND;
        static KEYS: [KeyDoc; CoefficientKind::COUNT] =
            keys(KIND, None, Shared::REQUIRED, Some("none"));
        static GROUP: KeyGroup = KeyGroup {
            name: "functions",
            text: "Coefficient functions of the system; mass, damping and stiffness are required.",
            keys: &KEYS,
        };
        &GROUP
    };
}

/// Coefficient functions of one experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Own;

impl CoefficientMap for Own {
    type Item = FunctionSpec;
    const REQUIRED: usize = 0;
    const EXPECTING: &'static str = "a map such as {damping: {basis: constant, start: 1.0}}";
    const GROUP: &'static KeyGroup = {
        const KIND: ValueType = <FunctionSpec as Value>::KIND;
        static KEYS: [KeyDoc; CoefficientKind::COUNT] = keys(KIND, None, 0, None);
        static GROUP: KeyGroup = KeyGroup {
            name: "own_functions",
            text: "Coefficient functions of one experiment, in place of the shared ones.",
            keys: &KEYS,
        };
        &GROUP
    };
}

/// Columns of the true functions.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthColumns;

impl CoefficientMap for TruthColumns {
    type Item = Text;
    const REQUIRED: usize = 0;
    const EXPECTING: &'static str =
        "a map such as {mass: mass_kg, damping: damping_N_s_per_m, stiffness: stiffness_N_per_m}";
    const GROUP: &'static KeyGroup = {
        static KEYS: [KeyDoc; CoefficientKind::COUNT] = keys(
            ValueType::Text,
            Some("my_column"),
            0,
            Some("name and unit, as `mass_kg`"),
        );
        static GROUP: KeyGroup = KeyGroup {
            name: "truth_columns",
            text: "Names of the columns of the true functions.",
            keys: &KEYS,
        };
        &GROUP
    };
}

/// Names of coefficients, with their meaning.
const NAMES: [(&str, &str); CoefficientKind::COUNT] = {
    let mut names = [("", ""); CoefficientKind::COUNT];
    let mut i = 0;
    while i < names.len() {
        let row = CoefficientKind::ALL[i].row();
        names[i] = (row.name, row.text);
        i += 1;
    }
    names
};

impl Value for CoefficientKind {
    const KIND: ValueType = ValueType::Choice(&NAMES);

    fn scalar(scalar: Scalar<'_>) -> Result<Self, Mistake> {
        choose(scalar, &Self::ALL.map(|kind| (kind.name(), kind)))
    }
}
