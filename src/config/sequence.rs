//! Sequences: lists of models that are analysed in order.

use super::input_limits::{Checked, LONGEST_MODEL};
use super::key_positions::{Segment, locate};
use super::model_file::check_path;
use super::values::{Format, Text};
use super::yaml_errors;
use crate::config::map::keys;
use crate::error::InputError;
use crate::text_io::read_text;
use std::path::{Path, PathBuf};

keys! {
    /// A sequence: models that `kmcfit study` analyses in order, on one page.
    pub struct SequenceSpec = "sequence", expecting "a map with the keys format, title, sequence" {
        /// Version of the file format.
        format: Format, example "1";
        /// Title of the page.
        title: Option<Text>, example "From the paper's fit to the true system", default "the name of the file";
        /// Model files, in the order of the analysis; paths are relative to this file.
        sequence: Vec<Text>, example "[paper.yaml, paper-smooth.yaml]";
    }
}

/// A sequence: its title and the model files, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Title of the page.
    pub title: String,
    /// The model files.
    pub models: Vec<PathBuf>,
}

impl Sequence {
    /// Reads a sequence; `None` if the file does not have the key `sequence`, so that it is a model.
    ///
    /// # Errors
    /// When the file cannot be read, or is an invalid sequence.
    pub fn read(path: &Path) -> Result<Option<Self>, InputError> {
        check_path(path)?;
        let text = read_text(
            path,
            "a model file or a sequence (YAML), or the folder of a finished run",
            LONGEST_MODEL,
        )?;
        let checked = Checked::new(path, &text)?;
        // The key in any style: `sequence:`, `"sequence":`, `{sequence: …}`.
        if locate(&text, &[Segment::Key("sequence".into())]).depth == 0 {
            return Ok(None);
        }
        let spec: SequenceSpec = yaml_errors::read(path, &checked)?;
        if spec.sequence.is_empty() {
            return Err(InputError::file(path, "the sequence has no model")
                .key("sequence")
                .found("an empty list")
                .expected("a list of model files"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Some(Self {
            title: spec.title.map_or_else(|| name.into_owned(), |t| t.0),
            models: spec.sequence.iter().map(|m| folder.join(&m.0)).collect(),
        }))
    }
}
