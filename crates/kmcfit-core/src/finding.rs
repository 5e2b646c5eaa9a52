//! Findings, warnings and suggestions of a document: severity, kind, quantities and a sentence.

pub use crate::severity::Severity;

use crate::assessment::Doubt;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;

/// One finding, warning or suggestion. In JSON an object with the field `kind`, the quantities of that kind, and the
/// field `text`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Severity; absent from the document for a note.
    #[serde(rename = "level", default, skip_serializing_if = "is_note")]
    pub severity: Severity,
    /// What was found, in snake case: for readers of the file. Decisions read the doubt.
    #[serde(rename = "kind")]
    pub check: String,
    /// Quantities by name.
    #[serde(flatten)]
    pub quantities: Map<String, Value>,
    /// The sentence.
    #[serde(rename = "text")]
    pub sentence: String,
    /// The doubt that it states, for decisions; not in files.
    #[serde(skip)]
    pub doubt: Option<Doubt>,
}

fn is_note(severity: &Severity) -> bool {
    *severity <= Severity::Note
}

impl Finding {
    /// A note without quantities.
    pub fn new(check: impl Into<String>, sentence: impl Into<String>) -> Self {
        Self {
            severity: Severity::Note,
            check: check.into(),
            quantities: Map::new(),
            sentence: sentence.into(),
            doubt: None,
        }
    }

    /// The finding as a statement of a doubt, with at least its severity.
    #[must_use]
    pub fn about(self, doubt: Doubt) -> Self {
        Self {
            doubt: Some(doubt.clone()),
            ..self.rated(doubt.severity())
        }
    }

    /// A finding with the fields of an object as its quantities.
    pub fn having(check: &str, sentence: impl Into<String>, quantities: Value) -> Self {
        let quantities = match quantities {
            Value::Object(fields) => fields,
            _ => Map::new(),
        };
        Self {
            quantities,
            ..Self::new(check, sentence)
        }
    }

    /// The finding about a place: a key or an experiment of the model file.
    #[must_use]
    pub fn at(mut self, position: &str) -> Self {
        self.sentence = format!("{position}: {}", self.sentence);
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
    pub fn of(variant: &impl Serialize, sentence: impl Into<String>) -> Self {
        let quantities = serde_json::to_value(variant).unwrap_or_default();
        let mut finding = Self::having("", sentence, quantities);
        let kind = finding.quantities.remove("kind");
        finding.check = kind
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
    pub fn rated(mut self, severity: Severity) -> Self {
        self.severity = self.severity.max(severity);
        self
    }

    /// The sentences of findings.
    pub fn texts(findings: &[Self]) -> Vec<String> {
        findings.iter().map(|f| f.sentence.clone()).collect()
    }
}

impl From<Doubt> for Finding {
    fn from(doubt: Doubt) -> Self {
        Self::of(&doubt, doubt.sentence()).about(doubt)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
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
