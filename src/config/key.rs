//! Keys of a model file: meaning, kind of value, unit, default and an example of each, from the schema of the types that read it.

use kmcfit_core::model::ModelSpec;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Type of a value.
#[derive(Debug, Clone, Copy)]
pub enum ValueType {
    /// The version of the file format: 1.
    Format,
    /// A finite number.
    Number,
    /// An integer, 0 or more.
    Count,
    /// A non-empty text.
    Text,
    /// `true` or `false`.
    Bool,
    /// A column of a file, by its name or its number from 1.
    Column,
    /// One fixed word.
    Word(&'static str),
    /// One of these words, each with its meaning.
    Choice(&'static [(&'static str, &'static str)]),
    /// A map with these keys.
    Map(&'static KeyGroup),
    /// A list.
    List(&'static ValueType),
    /// A map from names that the user gives to such values.
    Names(&'static ValueType),
    /// One of several kinds.
    AnyOf(&'static [ValueType]),
}

/// Keys of one map.
#[derive(Debug)]
pub struct KeyGroup {
    /// Its name in the schema.
    pub name: &'static str,
    /// Meaning of the map, as a sentence.
    pub text: &'static str,
    /// What is expected where it is no map.
    pub expecting: &'static str,
    /// Its keys, in the order of declaration.
    pub keys: &'static [KeyDoc],
}

/// A key.
#[derive(Debug, Clone, Copy)]
pub struct KeyDoc {
    /// Name in the file.
    pub name: &'static str,
    /// Type of its value.
    pub kind: ValueType,
    /// Meaning.
    pub text: &'static str,
    /// Example of a value.
    pub example: &'static str,
    /// Unit, if it has one.
    pub unit: Option<&'static str>,
    /// Default, if it has one.
    pub default: Option<&'static str>,
    /// Range of its numbers, if it is limited.
    pub range: Option<&'static str>,
    /// Keys and values without which it is refused or unused, if any.
    pub needs: Option<&'static str>,
    /// True for a required key.
    pub required: bool,
    /// True for a key that may have no value: it is then left out.
    pub nullable: bool,
}

impl ValueType {
    /// Maps among the values of this type, those in lists included.
    pub fn groups(self) -> Vec<&'static KeyGroup> {
        match self {
            ValueType::Map(group) => vec![group],
            ValueType::List(inner) | ValueType::Names(inner) => inner.groups(),
            ValueType::AnyOf(kinds) => kinds.iter().flat_map(|kind| kind.groups()).collect(),
            _ => Vec::new(),
        }
    }
}

/// The keys of a model.
pub fn model() -> &'static KeyGroup {
    static MODEL: LazyLock<&KeyGroup> = LazyLock::new(|| {
        let generator = SchemaSettings::draft2020_12().into_generator();
        let root = generator.into_root_schema_for::<ModelSpec>().to_value();
        let root = &*Box::leak(Box::new(root));
        let mut keys = Keys {
            definitions: root["$defs"].as_object(),
            groups: BTreeMap::new(),
        };
        keys.group("model", root)
    });
    *MODEL
}

/// Reads the keys out of a schema, which lives as long as the program.
struct Keys {
    definitions: Option<&'static Map<String, Value>>,
    groups: BTreeMap<&'static str, &'static KeyGroup>,
}

impl Keys {
    /// The keys of a map, once for each name.
    fn group(&mut self, name: &'static str, schema: &'static Value) -> &'static KeyGroup {
        if let Some(group) = self.groups.get(name) {
            return group;
        }
        let required = schema["required"].as_array();
        let is_required =
            |name: &str| required.is_some_and(|all| all.iter().any(|key| key == name));
        let properties = schema["properties"].as_object().into_iter().flatten();
        let keys = properties.map(|(name, key)| {
            let fact = |fact: &str| key.get(fact).and_then(Value::as_str);
            KeyDoc {
                name,
                kind: self.kind(key),
                text: words_of(key),
                example: fact("example").unwrap_or_default(),
                unit: fact("unit"),
                default: fact("default"),
                range: fact("range"),
                needs: fact("needs"),
                required: is_required(name),
                nullable: is_nullable(key),
            }
        });
        let keys = keys.collect::<Vec<_>>().leak();
        let group = &*Box::leak(Box::new(KeyGroup {
            name,
            text: words_of(schema),
            expecting: schema["expecting"].as_str().unwrap_or("a map"),
            keys,
        }));
        self.groups.insert(name, group);
        group
    }

    /// The type of a value.
    fn kind(&mut self, schema: &'static Value) -> ValueType {
        if let Some(path) = schema["$ref"].as_str() {
            let name = path.rsplit('/').next().unwrap_or_default();
            let found = self.definitions.and_then(|all| all.get(name));
            return match found {
                Some(map) if map.get("properties").is_some() => {
                    ValueType::Map(self.group(name, map))
                }
                Some(other) => self.kind(other),
                None => unreachable!("a definition {name} of the schema"),
            };
        }
        let list = |name: &str| schema[name].as_array().into_iter().flatten();
        if schema.get("column").is_some() {
            return ValueType::Column;
        }
        if let Some(word) = schema.get("const") {
            return word.as_str().map_or(ValueType::Format, ValueType::Word);
        }
        if schema.get("oneOf").is_some() {
            let words =
                list("oneOf").map(|word| (word["const"].as_str().unwrap_or(""), words_of(word)));
            return ValueType::Choice(words.collect::<Vec<_>>().leak());
        }
        if schema.get("anyOf").is_some() {
            let mut kinds = Vec::new();
            // An optional value may be null as well; a fixed word has a null type beside it.
            let is_null = |one: &&Value| one["type"] == "null" && one.get("const").is_none();
            for one in list("anyOf").filter(|one| !is_null(one)) {
                match self.kind(one) {
                    ValueType::AnyOf(inner) => kinds.extend(inner),
                    other => kinds.push(other),
                }
            }
            return match kinds.as_slice() {
                [one] => *one,
                _ => ValueType::AnyOf(kinds.leak()),
            };
        }
        if schema["additionalProperties"].is_object() {
            let inner = self.kind(&schema["additionalProperties"]);
            return ValueType::Names(Box::leak(Box::new(inner)));
        }
        // The first type of an optional value is its own.
        let kind = schema["type"].as_str().or(schema["type"][0].as_str());
        match kind.unwrap_or_default() {
            "number" => ValueType::Number,
            "integer" => ValueType::Count,
            "boolean" => ValueType::Bool,
            "array" => ValueType::List(Box::leak(Box::new(self.kind(&schema["items"])))),
            "string" => ValueType::Text,
            _ => unreachable!("a type of the model file without a value type: {schema}"),
        }
    }
}

/// True for a schema that accepts null.
fn is_nullable(schema: &Value) -> bool {
    let list = |name: &str| schema[name].as_array().into_iter().flatten();
    let in_types = list("type").any(|one| one == "null");
    in_types || list("anyOf").any(|one| one["type"] == "null" && one.get("const").is_none())
}

/// The description of a schema in one line.
fn words_of(schema: &'static Value) -> &'static str {
    let text = schema["description"].as_str().unwrap_or_default();
    text.replace('\n', " ").leak()
}
