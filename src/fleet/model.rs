//! The model of a fleet.

use super::records::Record;
use crate::config::ModelFile;
use crate::error::InputError;
use crate::text_io::read_bytes;
use std::sync::Arc;

/// What a record is, for messages.
const RECORD: &str = "a record";
/// Longest record, bytes.
const LONGEST: u64 = 1 << 40;

/// A model with one experiment, whose data are those of each record in turn.
#[derive(Debug, Clone)]
pub struct FleetModel {
    /// The model file.
    pub file: ModelFile,
}

impl FleetModel {
    /// # Errors
    /// If the model has several experiments, or one without `data`.
    pub fn new(file: ModelFile) -> Result<Self, InputError> {
        let experiments = &file.spec.experiments;
        if experiments.len() > 1 {
            return Err(file
                .error_at("experiments[1]", "the model of a fleet has one experiment")
                .found(format!("{} experiments", experiments.len()))
                .expected("one experiment, whose `data` each record replaces"));
        }
        match experiments.first().is_some_and(|e| e.data.is_some()) {
            true => Ok(Self { file }),
            false => Err(file
                .error_at("experiments[0].data", "the experiment has no data")
                .expected("`data: FILE`, in whose place each record is read")),
        }
    }

    /// The model with a record in place of its data; `content` is that of the record where it stands in memory.
    ///
    /// # Errors
    /// If the record cannot be read, or a value of its table is invalid.
    pub fn with_record(
        &self,
        record: &Record,
        content: Option<Arc<[u8]>>,
    ) -> Result<ModelFile, InputError> {
        let (name, content) = match content {
            // The name of the file states its format.
            Some(content) => (record.path.to_string_lossy(), content),
            None => {
                let content = read_bytes(&record.path, RECORD, LONGEST)?;
                (record.name.as_str().into(), content.into())
            }
        };
        let file = match record.overrides.is_empty() {
            true => self.file.clone(),
            false => self.file.clone().with_overrides(&record.overrides)?,
        };
        Ok(file.with_record(&name, content))
    }
}
