//! Overrides of values of a model file: `--set KEY=VALUE`.

use super::input_limits::Checked;
use super::key_positions::{Segment, key_path};
use crate::error::{InputError, Location};
use crate::text_io::quote;
use serde_yaml::{Mapping, Value};
use std::fmt;
use std::path::Path;

/// Expected value of an override, for messages.
const VALUE: &str = "a value as in a model file: 50, constant, {order: 2, weight: 0.1}, …";

/// An override: a key of the model file and its new value.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    key: String,
    path: Vec<Segment>,
    written: String,
    value: Value,
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.written)
    }
}

impl Override {
    /// Reads `KEY=VALUE`: a path such as `experiments.0.sigma.displacement` (or
    /// `experiments[0].sigma.displacement`; positions count from 0), and a value in YAML.
    ///
    /// # Errors
    /// When missing `=`, no key, or the value is not YAML.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        let wrong = |problem: &str| {
            InputError::new(Location::Argument("--set".into()), problem).found(quote(text))
        };
        let Some((key, written)) = text.split_once('=') else {
            return Err(
                wrong("missing `=`").expected("KEY=VALUE, for instance fit.stop.iterations=50")
            );
        };
        let (key, written) = (key.trim(), written.trim());
        let path = path(key);
        if path.is_empty() || matches!(path[0], Segment::Index(_)) {
            return Err(wrong("missing key before `=`")
                .expected("KEY=VALUE, for instance fit.stop.iterations=50"));
        }
        match Checked::new(Path::new("--set"), written)?.read() {
            Ok(Value::Null) | Err(_) => Err(wrong("the value cannot be read").expected(VALUE)),
            Ok(value) => Ok(Self {
                key: key.to_owned(),
                path,
                written: written.to_owned(),
                value,
            }),
        }
    }

    /// Parses each text of a list as [`parse`](Self::parse) does.
    ///
    /// # Errors
    /// As there, for the first invalid text.
    pub fn parse_all(texts: &[String]) -> Result<Vec<Self>, InputError> {
        texts.iter().map(|text| Self::parse(text)).collect()
    }

    /// True if this override supplies the value at a path.
    pub(super) fn covers(&self, path: &[Segment]) -> bool {
        path.starts_with(&self.path)
    }

    /// The override as the location of an error.
    pub(super) fn location(&self) -> Location {
        Location::Argument(format!("--set {self}"))
    }

    /// Sets the value in a model; creates missing maps along the path.
    pub(super) fn apply(&self, model: &mut Value) -> Result<(), InputError> {
        let mut here = model;
        for (depth, segment) in self.path.iter().enumerate() {
            here = self.step(here, segment, depth)?;
        }
        *here = self.value.clone();
        Ok(())
    }

    /// Descends one segment into a map or list.
    fn step<'a>(
        &self,
        here: &'a mut Value,
        segment: &Segment,
        depth: usize,
    ) -> Result<&'a mut Value, InputError> {
        let above = || written(&self.path[..depth]);
        if here.is_null() {
            *here = Value::Mapping(Mapping::new());
        }
        match (here, segment) {
            (Value::Mapping(map), Segment::Key(key)) => {
                Ok(map.entry(Value::from(key.as_str())).or_insert(Value::Null))
            }
            (Value::Sequence(list), Segment::Index(index)) => {
                let last = list.len().saturating_sub(1);
                list.get_mut(*index).ok_or_else(|| {
                    self.error(format!("no such element in the list {}", above()))
                        .found(format!("position {index}"))
                        .expected(match last {
                            0 => "the position 0".to_owned(),
                            _ => format!("a position from 0 to {last}"),
                        })
                })
            }
            (Value::Sequence(_), Segment::Key(key)) => {
                let example = format!("{}.0.{key}", above());
                Err(self
                    .error(format!("{} is a list", above()))
                    .found(quote(key))
                    .expected(format!("a position, as in {example}")))
            }
            (Value::Mapping(_), Segment::Index(index)) => Err(self
                .error(format!("{} is a map", above()))
                .found(format!("position {index}"))
                .expected("a key")),
            _ => Err(self
                .error(format!(
                    "{} is one value in this model, with no keys below it",
                    above()
                ))
                .expected(format!("{}=VALUE, which replaces it", above()))),
        }
    }

    fn error(&self, problem: String) -> InputError {
        InputError::new(self.location(), problem)
    }
}

/// A path in which numbers between dots are positions.
fn path(key: &str) -> Vec<Segment> {
    let segment = |segment| match segment {
        Segment::Key(key) => key.parse().map_or(Segment::Key(key), Segment::Index),
        index @ Segment::Index(_) => index,
    };
    key_path(key).into_iter().map(segment).collect()
}

/// A path in the notation of messages.
fn written(path: &[Segment]) -> String {
    let mut text = String::new();
    for segment in path {
        match segment {
            Segment::Key(key) if text.is_empty() => text += key,
            Segment::Key(key) => text += &format!(".{key}"),
            Segment::Index(index) => text += &format!("[{index}]"),
        }
    }
    text
}
