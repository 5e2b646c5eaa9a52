//! Maps with one key for each coefficient of the table.

use super::CoefficientSpec;
use crate::functions::CoefficientKind;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// A kind of map.
pub trait CoefficientMap {
    /// Value of each key.
    type Item;
    /// Name in the schema.
    const NAME: &'static str;
    /// Meaning.
    const TEXT: &'static str;
    /// Number of coefficients, the first of the table, that it must have.
    const REQUIRED: usize;
    /// Example of a value, in place of that of the row.
    const EXAMPLE: Option<&'static str>;
    /// What stands for a key that is left out.
    const DEFAULT: Option<&'static str>;
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

impl<'de, M: CoefficientMap<Item: Deserialize<'de>>> Deserialize<'de> for ByCoefficient<M> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(Entries(PhantomData))
    }
}

/// Reads the entries of a map.
struct Entries<M>(PhantomData<M>);

impl<'de, M: CoefficientMap<Item: Deserialize<'de>>> Visitor<'de> for Entries<M> {
    type Value = ByCoefficient<M>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(M::EXPECTING)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut list = Vec::new();
        while let Some((kind, value)) = map.next_entry::<CoefficientKind, Option<M::Item>>()? {
            list.extend(value.map(|value| (kind, value)));
        }
        list.sort_by_key(|(kind, _)| *kind);
        let map = PhantomData;
        Ok(ByCoefficient { list, map })
    }
}

impl<M: CoefficientMap<Item: JsonSchema>> JsonSchema for ByCoefficient<M> {
    fn schema_name() -> Cow<'static, str> {
        M::NAME.into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut properties = serde_json::Map::new();
        for (i, kind) in CoefficientKind::ALL.into_iter().enumerate() {
            let row = kind.row();
            let mut schema = generator.subschema_for::<M::Item>();
            let default = M::DEFAULT.filter(|_| i >= M::REQUIRED);
            let facts = [
                ("description", Some(row.text)),
                ("example", M::EXAMPLE.or(Some(row.example))),
                ("unit", Some(row.units[0])),
                ("default", default),
            ];
            for (name, fact) in facts {
                if let Some(fact) = fact {
                    schema.insert(name.to_owned(), fact.into());
                }
            }
            properties.insert(kind.name().to_owned(), schema.to_value());
        }
        let required = &CoefficientKind::ALL.map(CoefficientKind::name)[..M::REQUIRED];
        json_schema!({
            "type": "object",
            "description": M::TEXT,
            "expecting": M::EXPECTING,
            "properties": properties,
            "required": required,
            "additionalProperties": false,
        })
    }
}

impl JsonSchema for CoefficientKind {
    fn schema_name() -> Cow<'static, str> {
        "coefficient".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let of =
            |kind: Self| serde_json::json!({"const": kind.name(), "description": kind.row().text});
        json_schema!({"oneOf": Self::ALL.map(of)})
    }
}

/// Coefficient functions of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared;

impl CoefficientMap for Shared {
    type Item = CoefficientSpec;
    const NAME: &'static str = "functions";
    const TEXT: &'static str =
        "Coefficient functions of the system; mass, damping and stiffness are required.";
    const REQUIRED: usize = 3;
    const EXAMPLE: Option<&'static str> = None;
    const DEFAULT: Option<&'static str> = Some("none");
    const EXPECTING: &'static str = "a map with the keys mass, damping, stiffness";
}

/// Coefficient functions of one experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Own;

impl CoefficientMap for Own {
    type Item = CoefficientSpec;
    const NAME: &'static str = "own_functions";
    const TEXT: &'static str =
        "Coefficient functions of one experiment, in place of the shared ones.";
    const REQUIRED: usize = 0;
    const EXAMPLE: Option<&'static str> = None;
    const DEFAULT: Option<&'static str> = None;
    const EXPECTING: &'static str = "a map such as {damping: {basis: constant, start: 1.0}}";
}

/// Columns of the true functions.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthColumns;

impl CoefficientMap for TruthColumns {
    type Item = String;
    const NAME: &'static str = "truth_columns";
    const TEXT: &'static str = "Names of the columns of the true functions.";
    const REQUIRED: usize = 0;
    const EXAMPLE: Option<&'static str> = Some("my_column");
    const DEFAULT: Option<&'static str> = Some("name and unit, as `mass_kg`");
    const EXPECTING: &'static str =
        "a map such as {mass: mass_kg, damping: damping_N_s_per_m, stiffness: stiffness_N_per_m}";
}
