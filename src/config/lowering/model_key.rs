//! A key of the model file, and errors about its value.

use crate::config::ModelFile;
use crate::error::{InputError, Location};

/// A key of the model file.
#[derive(Debug, Clone)]
pub(in crate::config) struct ModelKey<'a> {
    pub file: &'a ModelFile,
    pub key: String,
}

impl<'a> ModelKey<'a> {
    pub fn new(file: &'a ModelFile, key: impl Into<String>) -> Self {
        let key = key.into();
        Self { file, key }
    }

    /// A key below this one.
    pub fn below(&self, part: &str) -> Self {
        Self::new(self.file, format!("{}.{part}", self.key))
    }

    /// An error about the value.
    pub fn error(&self, problem: impl Into<String>) -> InputError {
        self.file.error_at(&self.key, problem)
    }

    /// An error about the value of a key below this one.
    pub fn error_in(&self, part: &str, problem: impl Into<String>) -> InputError {
        self.below(part).error(problem)
    }

    /// Moves an error about a file as a whole to the key that names it. An error in a line of the file keeps its location.
    pub fn asks_for(&self) -> impl Fn(InputError) -> InputError {
        |error| match &error.location {
            Location::File(path) => {
                let problem = format!("{}: {}", path.display(), error.problem);
                let here = self.error(problem);
                InputError {
                    location: here.location,
                    key: here.key,
                    problem: here.problem,
                    ..error
                }
            }
            _ => error,
        }
    }
}
