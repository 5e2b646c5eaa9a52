//! Findings, warnings and suggestions of a document: severity, kind, quantities and a sentence.

use kmcfit_core::assessment::{Doubt, Severity};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;

/// One finding, warning or suggestion. In JSON an object with the field `kind`, the quantities of that kind, and the
/// field `text`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Severity; absent from the document for a note.
    #[serde(default, skip_serializing_if = "is_note")]
    pub level: Severity,
    /// Kind, in snake case.
    pub kind: String,
    /// Quantities by name.
    #[serde(flatten)]
    pub quantities: Map<String, Value>,
    /// The sentence.
    pub text: String,
    /// The doubt that it states, for decisions; not in files.
    #[serde(skip)]
    pub doubt: Option<Doubt>,
}

fn is_note(level: &Severity) -> bool {
    *level == Severity::Note
}

impl Finding {
    /// A note without quantities.
    pub fn new(kind: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            level: Severity::Note,
            kind: kind.into(),
            quantities: Map::new(),
            text: text.into(),
            doubt: None,
        }
    }

    /// The finding as the statement of a doubt.
    #[must_use]
    pub fn about(self, doubt: Doubt) -> Self {
        Self {
            doubt: Some(doubt),
            ..self
        }
    }

    /// A finding with the fields of an object as its quantities.
    pub fn having(kind: &str, text: impl Into<String>, quantities: Value) -> Self {
        let quantities = match quantities {
            Value::Object(fields) => fields,
            _ => Map::new(),
        };
        Self {
            quantities,
            ..Self::new(kind, text)
        }
    }

    /// The finding about a place: a key or an experiment of the model file.
    #[must_use]
    pub fn at(mut self, position: &str) -> Self {
        self.text = format!("{position}: {}", self.text);
        self.with("place", position)
    }

    /// The finding with another quantity; one that JSON cannot hold is `null`.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Serialize) -> Self {
        let value = serde_json::to_value(value).unwrap_or_default();
        self.quantities.insert(name.to_owned(), value);
        self
    }

    /// The finding of an enumeration's variant that serialises with its kind as the tag `kind`.
    pub fn of(variant: &impl Serialize, text: impl Into<String>) -> Self {
        let quantities = serde_json::to_value(variant).unwrap_or_default();
        let mut finding = Self::having("", text, quantities);
        let kind = finding.quantities.remove("kind");
        finding.kind = kind
            .as_ref()
            .and_then(Value::as_str)
            .unwrap_or_default()
            .to_owned();
        finding
    }

    /// The finding of a variant whose sentence is its `Display`.
    pub fn stated(variant: &(impl Serialize + fmt::Display)) -> Self {
        Self::of(variant, variant.to_string())
    }

    /// The finding with at least this severity.
    #[must_use]
    pub fn rated(mut self, level: Severity) -> Self {
        self.level = self.level.max(level);
        self
    }

    /// A quantity that is a text.
    pub fn said(&self, name: &str) -> Option<String> {
        Some(self.quantities.get(name)?.as_str()?.to_owned())
    }

    /// A quantity that is a number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.quantities.get(name)?.as_f64()
    }

    /// The sentences of findings.
    pub fn texts(findings: &[Self]) -> Vec<String> {
        findings.iter().map(|f| f.text.clone()).collect()
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_one_object_with_kind_quantities_and_text() {
        #[derive(Serialize)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        enum Example {
            CoarseSteps { ratio: f64 },
        }
        let finding = Finding::of(&Example::CoarseSteps { ratio: 2.0 }, "the steps are coarse");
        let json = serde_json::to_string(&finding).unwrap_or_default();
        assert_eq!(
            json,
            r#"{"kind":"coarse_steps","ratio":2.0,"text":"the steps are coarse"}"#
        );
        assert_eq!(serde_json::from_str::<Finding>(&json).ok(), Some(finding));
    }
}
