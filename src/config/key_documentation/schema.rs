//! JSON schema (draft 07) of a model file, for completion and validation in editors.

use super::{KeyDoc, KeyGroup, ValueType, model};
use serde_json::{Map, Value, json};

/// The schema of a model file.
///
/// The schema covers keys, types and choices; relations between keys are checked by the program.
pub fn schema() -> Value {
    let mut definitions = Map::new();
    define(model(), &mut definitions);
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "kmcfit model file",
        "description": "A model of an oscillator and its records.",
        "allOf": [reference(model())],
        "definitions": definitions,
    })
}

fn reference(group: &KeyGroup) -> Value {
    json!({"$ref": format!("#/definitions/{}", group.name)})
}

fn define(group: &'static KeyGroup, definitions: &mut Map<String, Value>) {
    if definitions.contains_key(group.name) {
        return;
    }
    let required: Vec<&str> = (group.keys.iter())
        .filter(|key| key.required)
        .map(|key| key.name)
        .collect();
    let properties: Map<String, Value> = (group.keys.iter())
        .map(|key| (key.name.to_owned(), property(key)))
        .collect();
    let mut map = json!({
        "type": "object",
        "description": group.text,
        "additionalProperties": false,
        "properties": properties,
    });
    if !required.is_empty() {
        map["required"] = json!(required);
    }
    definitions.insert(group.name.to_owned(), map);
    for inner in group.keys.iter().flat_map(|key| key.kind.groups()) {
        define(inner, definitions);
    }
}

/// Schema of a key: description for editors, and type of the value.
fn property(key: &KeyDoc) -> Value {
    // Draft 07 ignores everything beside `$ref`, so the type is in `allOf`.
    json!({"description": description(key), "allOf": [kind(key.kind)]})
}

/// Description of a key, with unit, default, range and the keys it needs.
fn description(key: &KeyDoc) -> String {
    let mut text = key.text.to_owned();
    let facts = [
        ("Unit", key.unit),
        ("Default", key.default),
        ("Range", key.range),
        ("Needs", key.needs),
    ];
    for (name, value) in facts {
        if let Some(value) = value {
            text += &format!(" {name}: {value}.");
        }
    }
    if let ValueType::Choice(words) = key.kind {
        for (word, meaning) in words {
            text += &format!("\n- {word}: {meaning}");
        }
    }
    text
}

fn kind(kind: ValueType) -> Value {
    match kind {
        ValueType::Format => json!({"const": 1}),
        ValueType::Number => json!({"type": "number"}),
        ValueType::Count => json!({"type": "integer", "minimum": 0}),
        // A name such as 12 keeps its spelling without quotes.
        ValueType::Text => json!({"type": ["string", "number"], "minLength": 1}),
        ValueType::Bool => json!({"type": "boolean"}),
        ValueType::Column => json!({"anyOf": [
            {"type": "string", "minLength": 1},
            {"type": "integer", "minimum": 1},
        ]}),
        ValueType::Word(word) => json!({"const": word}),
        ValueType::Choice(words) => {
            let words: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            json!({"enum": words})
        }
        ValueType::Map(group) => reference(group),
        ValueType::List(inner) => json!({"type": "array", "items": self::kind(*inner)}),
        ValueType::Names(inner) => {
            json!({"type": "object", "additionalProperties": self::kind(*inner)})
        }
        ValueType::AnyOf(kinds) => {
            let kinds: Vec<Value> = kinds.iter().map(|k| self::kind(*k)).collect();
            json!({"anyOf": kinds})
        }
    }
}
