//! Models and their files in memory.

use crate::errors::{Failure, keyed};
use kmcfit::config::{BuildMode, Model, ModelFile, Override, build};
use kmcfit::error::InputError;
use pyo3::pybacked::PyBackedBytes;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Files in memory by their names in the model.
pub type Files = BTreeMap<String, PyBackedBytes>;

/// A model with its overrides: a text, or without one the file of the path.
pub struct Source {
    pub text: Option<String>,
    pub path: PathBuf,
    pub files: Files,
    pub overrides: Vec<String>,
}

impl Source {
    /// Reads the file and builds its model for a fit.
    pub fn build(self) -> Result<(ModelFile, Model), Failure> {
        let overrides = Override::parse_all(&self.overrides)?;
        // Lines are those of a file; a text is made from arguments.
        let path = self.text.as_ref().map(|_| self.path.clone());
        let built = self.read(&overrides);
        built.map_err(|error| match &path {
            Some(path) => Failure::Input(keyed(error, path)),
            None => Failure::Input(error),
        })
    }

    fn read(self, overrides: &[Override]) -> Result<(ModelFile, Model), InputError> {
        let file = match self.text {
            Some(text) => ModelFile::parse(&self.path, text)?,
            None => ModelFile::read(&self.path)?,
        };
        let files = self.files.iter();
        let files = files.map(|(name, content)| (name.clone(), Arc::from(&**content)));
        let file = file.with_files(files).with_overrides(overrides)?;
        let model = build(&file, BuildMode::Fit)?;
        Ok((file, model))
    }
}

/// Numbers as the bytes of a float64 array in the order of the machine.
pub fn to_bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_ne_bytes()).collect()
}

/// The numbers of the bytes of a float64 array.
pub fn from_bytes(bytes: &[u8]) -> Vec<f64> {
    let (numbers, _) = bytes.as_chunks::<8>();
    numbers.iter().map(|x| f64::from_ne_bytes(*x)).collect()
}
