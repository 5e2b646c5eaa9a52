//! `--set KEY=VALUE`: overrides of keys of the model file.

use crate::config::{ModelFile, Override};
use crate::error::InputError;
use std::path::Path;

/// Overrides of the model file.
#[derive(Debug, clap::Args)]
pub struct Overrides {
    /// Override a key of the model file, as in experiments.0.sigma.displacement=0.1; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Overrides {
    /// The parsed overrides.
    pub fn parse(&self) -> Result<Vec<Override>, InputError> {
        Override::parse_all(&self.set)
    }

    /// A model file with the overrides.
    pub fn read(&self, model: &Path) -> Result<ModelFile, InputError> {
        ModelFile::read_with_overrides(model, &self.parse()?)
    }

    /// Rejects overrides for inputs other than a model file.
    pub fn refuse(&self, what: &str) -> Result<(), InputError> {
        match self.set.first() {
            Some(first) => Err(InputError::argument(
                format!("--set {first}"),
                "no key can be overridden here",
            )
            .found(what)
            .expected("a model")),
            None => Ok(()),
        }
    }
}
