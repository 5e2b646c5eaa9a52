//! Models and their files in memory.

use crate::errors::{Failure, guarded, keyed};
use kmcfit::config::{BuildMode, Model, ModelFile, Override, build};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Most bytes of small records: three columns of 2700 samples.
const SMALL: usize = 1 << 16;

/// A model with its overrides and the files that stand in memory, ready to be fitted many times.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawModel {
    file: ModelFile,
    /// True for a text that was made from arguments: lines of it mean nothing to the user.
    is_text: bool,
}

#[pymethods]
impl RawModel {
    /// A model from a text, or without one from the file of the path; `files` are those in memory by their names in the model.
    #[new]
    fn new(
        py: Python<'_>,
        text: Option<String>,
        path: PathBuf,
        files: BTreeMap<String, PyBackedBytes>,
        overrides: Vec<String>,
    ) -> PyResult<Self> {
        let is_text = text.is_some();
        guarded(py, || {
            let read = || {
                let overrides = Override::parse_all(&overrides)?;
                let file = match text {
                    Some(text) => ModelFile::parse(&path, text)?,
                    None => ModelFile::read(&path)?,
                };
                file.with_files(contents(&files)).with_overrides(&overrides)
            };
            let file = read().map_err(|error| match is_text {
                true => keyed(error, &path),
                false => error,
            })?;
            Ok(Self { file, is_text })
        })
    }

    /// The same model with other files in memory.
    fn with_files(&self, py: Python<'_>, files: BTreeMap<String, PyBackedBytes>) -> PyResult<Self> {
        guarded(py, || {
            Ok(Self {
                file: self.file.clone().with_files(contents(&files)),
                is_text: self.is_text,
            })
        })
    }
}

fn contents(files: &BTreeMap<String, PyBackedBytes>) -> impl Iterator<Item = (String, Arc<[u8]>)> {
    let files = files.iter();
    files.map(|(name, content)| (name.clone(), Arc::from(&**content)))
}

impl RawModel {
    /// True if all records stand in memory and are small.
    pub fn is_small(&self) -> bool {
        let sizes = self.file.files_in_memory();
        let total: usize = sizes.iter().map(|(_, content)| content.len()).sum();
        (1..=SMALL).contains(&total)
    }

    /// The model file.
    pub fn file(&self) -> &ModelFile {
        &self.file
    }

    /// Builds the model for a fit.
    pub fn build(&self) -> Result<Model, Failure> {
        build(&self.file, BuildMode::Fit).map_err(|error| self.located(error).into())
    }

    /// An error of the model, with a key in place of a line where the text was made from arguments.
    pub fn located(&self, error: kmcfit::error::InputError) -> kmcfit::error::InputError {
        match self.is_text {
            true => keyed(error, &self.file.path),
            false => error,
        }
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
