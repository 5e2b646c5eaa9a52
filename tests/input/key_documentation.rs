//! The documentation of keys, the reader and the schema agree.
#![allow(
    clippy::disallowed_methods,
    reason = "the texts are those of the project"
)]

use kmcfit::config::key_documentation::{self, KeyGroup, ValueType, model};
use kmcfit::config::{ModelFile, Override};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A model into which every map can be inserted.
const BASE: &str = "
format: 1
experiments:
  - initial: {displacement: 3.3, velocity: 1.0}
functions:
  mass: {basis: nodal}
  damping: {basis: nodal}
  stiffness: {basis: nodal}
";

fn base() -> ModelFile {
    ModelFile::parse("m.yaml", BASE).expect("a model")
}

fn set(model: ModelFile, path: &str, value: &str) -> Result<ModelFile, String> {
    let change = Override::parse(&format!("{path}={value}")).map_err(|e| e.to_string())?;
    model.with_overrides(&[change]).map_err(|e| e.to_string())
}

/// The whole model with `value` at a path, as JSON.
fn as_json(model: &ModelFile) -> Value {
    serde_yaml::from_str(model.effective_text()).expect("YAML that is JSON")
}

/// Keys that the reader accepts in place of an unknown one.
fn accepted(message: &str) -> BTreeSet<String> {
    let (_, rest) = message.split_once("expected: ").expect("what is expected");
    let line = rest.lines().next().expect("a line");
    let names = line.trim_start_matches("one of: ").split(", ");
    names
        .map(|name| name.trim_matches('`').to_owned())
        .collect()
}

/// Visits a group and all below: the model has a map of the group at `path`. A key whose kind has
/// several maps is visited with each.
fn visit(group: &'static KeyGroup, path: &str, model: &ModelFile, seen: &mut BTreeSet<String>) {
    let at = |key: &str| match path {
        "" => key.to_owned(),
        path => format!("{path}.{key}"),
    };
    let message = set(model.clone(), &at("no_such_key"), "1").expect_err(path);
    assert!(message.contains("unknown key"), "{path}: {message}");
    let known: BTreeSet<String> = group.keys.iter().map(|k| k.name.to_owned()).collect();
    assert_eq!(accepted(&message), known, "{path}");
    let schema = key_documentation::schema();
    for key in group.keys {
        let here = at(key.name);
        seen.insert(format!("{}.{}", group.name, key.name));
        let with = set(model.clone(), &here, key.example)
            .unwrap_or_else(|message| panic!("the example of {here}: {message}"));
        valid(&schema, &as_json(&with)).unwrap_or_else(|why| panic!("{here}: {why}"));
        for inner in key.kind.groups() {
            if inner.name == group.name {
                continue;
            }
            descend(inner, key.kind, &here, model, seen);
        }
    }
}

/// Inserts a map of a group at a key and visits it.
fn descend(
    group: &'static KeyGroup,
    kind: ValueType,
    here: &str,
    model: &ModelFile,
    seen: &mut BTreeSet<String>,
) {
    let required: Vec<String> = (group.keys.iter())
        .filter(|key| key.required)
        .map(|key| format!("{}: {}", key.name, key.example))
        .collect();
    let map = format!("{{{}}}", required.join(", "));
    let in_list = matches!(kind, ValueType::List(_));
    let (value, path) = match in_list {
        true => (format!("[{map}]"), format!("{here}.0")),
        false => (map, here.to_owned()),
    };
    let with = set(model.clone(), here, &value).unwrap_or_else(|why| panic!("{here}: {why}"));
    visit(group, &path, &with, seen);
}

#[test]
fn reader_and_registry_know_the_same_keys_and_examples_are_read() {
    let mut seen = BTreeSet::new();
    visit(model(), "", &base(), &mut seen);
    assert!(seen.len() > 120, "{}", seen.len());
    let all = key_documentation::all();
    assert!(all.len() <= seen.len(), "{} {}", all.len(), seen.len());
}

#[test]
fn required_keys_are_those_of_the_reader() {
    fn check(group: &'static KeyGroup, path: &str, model: &ModelFile) {
        let required: Vec<_> = group.keys.iter().filter(|key| key.required).collect();
        for missing in &required {
            let others: Vec<String> = (required.iter())
                .filter(|key| key.name != missing.name)
                .map(|key| format!("{}: {}", key.name, key.example))
                .collect();
            let map = format!("{{{}}}", others.join(", "));
            let message = set(model.clone(), path, &map).expect_err(missing.name);
            let expected = format!("the key `{}` is missing", missing.name);
            assert!(message.contains(&expected), "{path}: {message}");
        }
    }
    let find = |name: &str| {
        let all = key_documentation::all();
        let groups = all.iter().flat_map(|f| f.key.kind.groups());
        groups
            .into_iter()
            .find(|g| g.name == name)
            .expect("a group")
    };
    for (group, path) in [
        ("state", "predict"),
        ("functions", "functions"),
        ("initial", "experiments.0.initial"),
        ("truth", "truth"),
        ("penalty", "functions.mass.penalty"),
        ("column", "functions.mass.start"),
    ] {
        let model = base();
        match group {
            "state" => {
                let with = set(model, "predict", "[{displacement: 1, velocity: 1}]");
                check(find(group), "predict.0", &with.expect("a model"));
            }
            _ => check(find(group), path, &model),
        }
    }
}

#[test]
fn a_key_that_need_not_be_there_may_be_missing() {
    // The model of every visit has only the required keys, which therefore suffice.
    let schema = key_documentation::schema();
    valid(&schema, &as_json(&base())).expect("a valid model");
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[test]
fn the_schema_in_the_repository_is_the_one_that_is_printed() {
    let text = std::fs::read_to_string(repository("docs/kmcfit.schema.json")).expect("the schema");
    assert!(
        text == kmcfit::report::json(&key_documentation::schema()),
        "make it again: cargo run -- schema > docs/kmcfit.schema.json"
    );
}

#[test]
fn shipped_models_are_valid_and_turn_the_schema_on() {
    let schema = key_documentation::schema();
    let mut count = 0;
    for entry in std::fs::read_dir(repository("models")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let text = std::fs::read_to_string(&path).expect("a model");
        let first = "# yaml-language-server: $schema=../docs/kmcfit.schema.json\n";
        assert!(text.starts_with(first), "{}", path.display());
        let model: Value = serde_yaml::from_str(&text).expect("YAML that is JSON");
        valid(&schema, &model).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
        count += 1;
    }
    assert!(count >= 20, "{count}");
}

#[test]
fn mistakes_are_no_models_of_the_schema() {
    let schema = key_documentation::schema();
    for (path, value) in [
        ("grid", "{node: 3}"),
        ("grid", "{nodes: many}"),
        ("grid", "{nodes: -1}"),
        ("grid", "{nodes: 2.5}"),
        ("fit", "{method: l-bfgs}"),
        ("fit", "[]"),
        ("format", "2"),
        ("experiments", "[{}]"),
        ("experiments", "[{initial: {displacement: 1}}]"),
        ("functions", "{mass: {fixed: 1}}"),
        ("predict", "{displacement: 1, velocity: 1}"),
        ("title", "''"),
    ] {
        let mut model = as_json(&base());
        let value: Value = serde_yaml::from_str(value).expect("YAML");
        model[path] = value;
        assert!(valid(&schema, &model).is_err(), "{model}");
    }
}

/// True if a document satisfies a schema, for the part of draft 07 that the schema uses. An unknown keyword of the schema is an
/// error.
fn valid(root: &Value, document: &Value) -> Result<(), String> {
    check(root, root, document, "")
}

fn check(root: &Value, schema: &Value, value: &Value, at: &str) -> Result<(), String> {
    let wrong = |why: &str| Err(format!("{at}: {why}: {value}"));
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let holds = |schema: &Value| check(root, schema, value, at).is_ok();
    for (word, rule) in schema.as_object().expect("a schema is a map") {
        match word.as_str() {
            "$schema" | "title" | "description" | "definitions" | "then" | "else" => {}
            "if" => check(
                root,
                &schema[if holds(rule) { "then" } else { "else" }],
                value,
                at,
            )?,
            "$ref" => {
                let pointer = rule
                    .as_str()
                    .and_then(|r| r.strip_prefix('#'))
                    .expect("a pointer");
                check(
                    root,
                    root.pointer(pointer).expect("a definition"),
                    value,
                    at,
                )?;
            }
            "allOf" => {
                for each in list(rule) {
                    check(root, &each, value, at)?;
                }
            }
            "anyOf" if list(rule).iter().any(holds) => {}
            "anyOf" => return wrong("none of the kinds"),
            "const" if rule == value => {}
            "enum" if list(rule).contains(value) => {}
            "const" | "enum" => return wrong("another word"),
            "type" => {
                let types = match rule {
                    Value::Array(types) => types.clone(),
                    one => vec![one.clone()],
                };
                let is = |t: &Value| match t.as_str().expect("a name") {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "number" => value.is_number(),
                    "integer" => value.is_i64() || value.is_u64(),
                    "boolean" => value.is_boolean(),
                    other => panic!("the type {other}"),
                };
                if !types.iter().any(is) {
                    return wrong("the wrong type");
                }
            }
            "minimum" if value.as_f64().is_some_and(|x| Some(x) < rule.as_f64()) => {
                return wrong("too small");
            }
            "minLength" if value.as_str().is_some_and(str::is_empty) => return wrong("empty"),
            "minimum" | "minLength" => {}
            "required" => {
                for key in list(rule) {
                    let key = key.as_str().expect("a name");
                    if value.is_object() && value.get(key).is_none() {
                        return wrong(&format!("{key} is missing"));
                    }
                }
            }
            "properties" => {
                for (key, inner) in value.as_object().into_iter().flatten() {
                    match rule.get(key) {
                        Some(rule) => check(root, rule, inner, &format!("{at}.{key}"))?,
                        None => return wrong(&format!("{key} is unknown")),
                    }
                }
            }
            "additionalProperties" => assert_eq!(rule, false),
            "items" => {
                for inner in list(value) {
                    check(root, rule, &inner, &format!("{at}[]"))?;
                }
            }
            other => panic!("the word {other} of the schema"),
        }
    }
    Ok(())
}
