//! Keys of a structure: coordinates with their masses, and elements between them.

use super::CoefficientSpec;
use crate::structure::CoefficientKind;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// A system of any number of coordinates: masses, and elements between them.
#[derive(Debug, Clone, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "structure", extend("expecting" = "a map with the keys coordinates, elements"))]
pub struct StructureSpec {
    /// Coordinates by name, each with its mass; a displacement is relative to the ground, which is the base where that moves.
    #[schemars(extend("example" = "{floor_1: {mass: {fixed: 1.0}}}"))]
    pub coordinates: Named<CoordinateSpec>,
    /// Springs, dampers and other elements by name.
    #[schemars(extend("example" = "{storey_1: {spring: [ground, floor_1], basis: constant, start: 3000.0, min: 0.0}}"))]
    pub elements: Named<ElementSpec>,
}

/// A coordinate.
#[derive(Debug, Clone, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "coordinate", extend("expecting" = "a map such as {mass: {fixed: 1.0}}"))]
pub struct CoordinateSpec {
    /// Mass that moves with the coordinate.
    #[schemars(extend("example" = "{fixed: 1.0}", "unit" = "kg"))]
    pub mass: CoefficientSpec,
}

/// An element: its law with its two ends, and the function of time of its coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementSpec {
    /// Laws with their ends, coordinates or `ground`; a valid element has one. Elongation is that of the second end less that of the first.
    pub laws: Vec<(CoefficientKind, Vec<String>)>,
    /// Its coefficient.
    pub coefficient: CoefficientSpec,
}

impl ElementSpec {
    /// An element between two ends.
    pub fn new(kind: CoefficientKind, ends: [&str; 2], coefficient: CoefficientSpec) -> Self {
        Self {
            laws: vec![(kind, ends.map(str::to_owned).to_vec())],
            coefficient,
        }
    }
}

impl<'de> Deserialize<'de> for ElementSpec {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut map = Map::deserialize(from)?;
        let mut laws = Vec::new();
        for kind in CoefficientKind::ALL {
            let ends = kind.row().element.and_then(|name| map.remove(name));
            if let Some(ends) = ends {
                laws.push((
                    kind,
                    serde_json::from_value(ends).map_err(D::Error::custom)?,
                ));
            }
        }
        let coefficient = serde_json::from_value(Value::Object(map)).map_err(D::Error::custom)?;
        Ok(Self { laws, coefficient })
    }
}

impl JsonSchema for ElementSpec {
    fn schema_name() -> Cow<'static, str> {
        "element".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = CoefficientSpec::json_schema(generator);
        schema.insert(
            "description".to_owned(),
            "An element: its law with its two ends, and the keys of its coefficient.".into(),
        );
        schema.insert(
            "expecting".to_owned(),
            "a map such as {spring: [ground, floor_1], basis: constant, start: 3000.0}".into(),
        );
        if let Some(Value::Object(properties)) = schema.get_mut("properties") {
            for kind in CoefficientKind::ALL {
                let Some(name) = kind.row().element else {
                    continue;
                };
                let ends = json_schema!({
                    "type": ["array", "null"],
                    "items": {"type": "string"},
                    "description": format!("Two ends, coordinates or `ground`. {}", kind.row().text),
                    "example": "[ground, floor_1]",
                    "needs": "no other law in the same element",
                });
                properties.insert(name.to_owned(), ends.to_value());
            }
        }
        schema
    }
}

/// Values by the names that the user gives them, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(Entries(PhantomData))
    }
}

/// Reads the entries of a map.
struct Entries<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
    type Value = Named<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map of names")
    }

    /// Pairs of a name and a value, which keep their order.
    fn visit_seq<A: SeqAccess<'de>>(self, mut pairs: A) -> Result<Self::Value, A::Error> {
        let mut list = Vec::new();
        while let Some(entry) = pairs.next_element()? {
            list.push(entry);
        }
        Ok(Named(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut list = Vec::new();
        while let Some(entry) = map.next_entry()? {
            list.push(entry);
        }
        Ok(Named(list))
    }
}

impl<T: JsonSchema> JsonSchema for Named<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("{}s", T::schema_name()).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "object",
            "additionalProperties": generator.subschema_for::<T>(),
        })
    }
}
