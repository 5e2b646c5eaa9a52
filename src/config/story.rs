//! A story: models that are run one after the other and told on one page.

use super::failure;
use super::guard::{Checked, LONGEST_MODEL};
use super::locate::{Segment, locate};
use super::model_file::check_path;
use super::scalar::{Format, Text};
use crate::config::map::keys;
use crate::error::InputError;
use crate::input::read_text;
use std::path::{Path, PathBuf};

keys! {
    /// A story: models that `kmcfit study` runs in order and tells on one page.
    pub struct StorySpec = "story", expecting "a map with the keys format, title, story" {
        /// Version of the file format.
        format: Format, example "1";
        /// What the page is called.
        title: Option<Text>, example "From the paper to the device", default "the name of the file";
        /// Model files, in the order in which they are told; paths start from this file.
        story: Vec<Text>, example "[paper.yaml, paper-smooth.yaml]";
    }
}

/// A story: its title and the model files, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// Title of the page.
    pub title: String,
    /// The model files.
    pub models: Vec<PathBuf>,
}

impl Story {
    /// Reads a story; `None` if the file does not have the key `story`, so that it is a model.
    ///
    /// # Errors
    /// When the file cannot be read, or is a story that is not well written.
    pub fn read(path: &Path) -> Result<Option<Self>, InputError> {
        check_path(path)?;
        let text = read_text(path, "a model file or a story (YAML)", LONGEST_MODEL)?;
        let checked = Checked::new(path, &text)?;
        // The key in any style: `story:`, `"story":`, `{story: …}`.
        if locate(&text, &[Segment::Key("story".into())]).depth == 0 {
            return Ok(None);
        }
        let spec: StorySpec = failure::read(path, &checked)?;
        if spec.story.is_empty() {
            return Err(InputError::file(path, "the story has no model")
                .key("story")
                .found("an empty list")
                .expected("a list of model files"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Some(Self {
            title: spec.title.map_or_else(|| name.into_owned(), |t| t.0),
            models: spec.story.iter().map(|m| folder.join(&m.0)).collect(),
        }))
    }
}
