//! Sources of a model, for reproducible runs: its text, overrides, and data files with digests.

use super::ModelFile;
use crate::digest::digest;
use serde::{Deserialize, Serialize};

/// Text, overrides and data files of a model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ModelSource {
    /// The text of the model file.
    pub text: String,
    /// Overrides, as given on the command line.
    pub overrides: Vec<String>,
    /// Data files, each once, in the order of the text.
    pub data: Vec<DataFile>,
}

/// A data file with the digest of the bytes that were read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DataFile {
    /// Path as in the model file, relative to its folder.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256 in hexadecimal digits.
    pub sha256: String,
}

impl ModelSource {
    /// The text of a model file, and the files behind its keys `data` that were read.
    pub fn of(file: &ModelFile) -> Self {
        let data = file.data_names().into_iter().filter_map(|name| {
            let path = file.resolve(&name);
            let (bytes, sha256) = match file.in_memory(&name) {
                Some(bytes) => (bytes.len() as u64, digest(bytes)),
                None => (file.read_files().of(&path)).map(|read| (read.bytes, read.sha256))?,
            };
            Some(DataFile {
                bytes,
                sha256,
                name,
            })
        });
        Self {
            text: file.text.clone(),
            overrides: file.override_texts(),
            data: data.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{BuildMode, Model, build};
    use std::sync::Arc;

    #[test]
    fn a_file_in_memory_is_that_of_the_disk() {
        let folder = tempfile::tempdir().expect("a folder");
        let table = "t_s,y_m\n0,3.3\n1,3.2\n2,3.0\n3,2.6\n4,2.1\n";
        std::fs::write(folder.path().join("a.csv"), table).expect("a file");
        let text = "format: 1
experiments: [{data: a.csv, initial: {displacement: 3.3, velocity: 0}}]
functions: {mass: {fixed: 1}, damping: {basis: constant, start: 0.1}, stiffness: {fixed: {data: k.csv, column: k}}}
";
        let on_disk = ModelFile::parse(folder.path().join("model.yaml"), text).expect("a model");
        let stiffness = "t_s,k\n0,1\n4,2\n";
        std::fs::write(folder.path().join("k.csv"), stiffness).expect("a file");
        let files = [("a.csv", table), ("k.csv", stiffness)];
        let files = files.map(|(name, text)| (name.to_owned(), Arc::from(text.as_bytes())));
        let in_memory = ModelFile::parse("model.yaml", text).expect("a model");
        let in_memory = in_memory.with_files(files);
        let [disk, memory] =
            [on_disk, in_memory].map(|file| build(&file, BuildMode::Fit).expect("a model"));
        assert_eq!(memory.problem.start(), disk.problem.start());
        let observed = |model: &Model| -> Vec<f64> {
            let channels = model.problem.channels();
            channels.flat_map(|c| c.observed().to_vec()).collect()
        };
        assert_eq!(observed(&memory), [3.3, 3.2, 3.0, 2.6, 2.1]);
        assert_eq!(observed(&memory), observed(&disk));
        let contents = |model: Model| -> Vec<_> {
            model
                .source
                .data
                .into_iter()
                .map(|file| (file.name, file.sha256))
                .collect()
        };
        assert_eq!(contents(memory), contents(disk));
        // A name that is neither in memory nor on the disk.
        let file = ModelFile::parse("model.yaml", text).expect("a model");
        let error = build(&file, BuildMode::Fit).expect_err("no file");
        assert!(error.to_string().contains("a.csv"), "{error}");
    }
}
