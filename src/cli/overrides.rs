//! `--set KEY=VALUE`

use crate::config::{ModelFile, Override};
use crate::error::InputError;
use std::path::Path;

/// Values in the place of those of the model file.
#[derive(Debug, clap::Args)]
pub struct Overrides {
    /// Another value for a key of the model, for instance fit.stop.iterations=50 or
    /// experiments.0.sigma.displacement=0.1; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Overrides {
    /// The overrides, taken apart.
    pub fn parse(&self) -> Result<Vec<Override>, InputError> {
        Override::parse_all(&self.set)
    }

    /// A model file with the overrides.
    pub fn read(&self, model: &Path) -> Result<ModelFile, InputError> {
        ModelFile::read_with(model, &self.parse()?)
    }

    /// Refuses overrides where nothing can be set.
    pub fn refuse(&self, what: &str) -> Result<(), InputError> {
        match self.set.first() {
            Some(first) => Err(InputError::argument(
                format!("--set {first}"),
                "nothing can be set here",
            )
            .found(what)
            .expected("a model")),
            None => Ok(()),
        }
    }
}
