//! Texts.

use super::Scalar;
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, SeqAccess, Visitor};
use std::fmt;
use std::ops::Deref;
use std::path::Path;

/// A text that is not empty: a title, a name, a column, the path of a file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Text(pub String);

impl Deref for Text {
    type Target = str;
    fn deref(&self) -> &str {
        &self.0
    }
}

impl AsRef<Path> for Text {
    fn as_ref(&self) -> &Path {
        Path::new(&self.0)
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Text {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        match scalar {
            Scalar::Text("") | Scalar::Nothing => {
                Err(Complaint::new("the text is empty", "nothing", "text"))
            }
            Scalar::Text(text) => Ok(Self(text.to_owned())),
            other => Err(Complaint::new("not a text", other.describe(), "text")),
        }
    }
}

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Text;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("text")
            }
            scalar_visits!(Text, Text::read);
        }
        // Asked for as text, a name such as 12 or 1.50 keeps its spelling.
        deserializer.deserialize_str(Reader)
    }
}

impl Value for Text {
    const KIND: Kind = Kind::Text;
}
