//! Sources of a model, for reproducible runs: its text, overrides, and data files with digests.

use super::ModelFile;
use crate::digest::{FileDigests, digest};
use std::path::Path;
use std::time::SystemTime;

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

/// A data file with its digest at the time when the model was built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataFile {
    /// Path as in the model file, relative to its folder.
    pub name: String,
    /// Size in bytes and SHA-256 in hexadecimal digits; `None` for a file that can no longer be read.
    pub content: Option<(u64, String)>,
    /// Time of its last change, where the file system has it.
    pub modified: Option<SystemTime>,
}

impl ModelSource {
    /// The text of a model file, and the files behind its keys `data`.
    pub fn of(file: &ModelFile) -> Self {
        let data = file.data_names().into_iter().map(|name| DataFile {
            content: match file.in_memory(&name) {
                Some(bytes) => Some((bytes.len() as u64, digest(bytes))),
                None => content(&file.resolve(&name), file.digests()),
            },
            modified: (file.resolve(&name).metadata())
                .and_then(|m| m.modified())
                .ok(),
            name,
        });
        Self {
            text: file.text.clone(),
            overrides: file.override_texts(),
            data: data.collect(),
        }
    }
}

fn content(path: &Path, digests: &FileDigests) -> Option<(u64, String)> {
    let bytes = path.metadata().ok()?.len();
    Some((bytes, digests.of(path).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{BuildMode, Model, build};
    use std::sync::Arc;

    #[test]
    fn every_data_file_is_named_once() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.csv"), "abc").expect("a file");
        let text = "format: 1
experiments:
  - {data: a.csv, columns: {force: {data: b.csv, column: f}}, initial: {displacement: 1, velocity: 0}}
  - {data: a.csv, initial: {displacement: 1, velocity: 0}}
functions: {mass: {fixed: 1}, damping: {fixed: {data: b.csv, column: c}}, stiffness: {fixed: 1}}
fit: {initial: data}
";
        let file = ModelFile::parse(folder.path().join("model.yaml"), text).expect("a model");
        let source = ModelSource::of(&file);
        assert_eq!(source.text, text);
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let expected = [("a.csv", Some((3, digest.to_string()))), ("b.csv", None)];
        let found: Vec<_> = (source.data.into_iter())
            .map(|file| (file.name, file.content))
            .collect();
        assert_eq!(
            found,
            expected.map(|(name, content)| (name.to_string(), content))
        );
    }

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
                .map(|file| file.content)
                .collect()
        };
        assert_eq!(contents(memory), contents(disk));
        // A name that is neither in memory nor on the disk.
        let file = ModelFile::parse("model.yaml", text).expect("a model");
        let error = build(&file, BuildMode::Fit).expect_err("no file");
        assert!(error.to_string().contains("a.csv"), "{error}");
    }
}
