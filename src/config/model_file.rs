//! A model file: path, text, parsed specification and overrides.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::input_limits::{Checked, LONGEST_MODEL};
use super::key_positions::{key_path, locate, location};
use super::overrides::Override;
use super::yaml_errors;
use crate::digest::ReadFiles;
use crate::error::InputError;
use crate::formats::has_data_extension;
use crate::tables::{TABLE, Table, TableFormat};
use crate::text_io::{LONGEST_TABLE, read_text};
use kmcfit_core::model::ModelSpec;

/// Expected contents of a model file, for messages.
const MODEL_FILE: &str = "a model file (YAML)";

/// Most experiments. Each reads its own files, so a short text could need more memory than is available.
const MOST_EXPERIMENTS: usize = 2000;

/// A parsed model file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// Path, as given on the command line.
    pub path: PathBuf,
    /// Text, without a byte order mark.
    pub text: String,
    /// Parsed specification, with the overrides applied.
    pub spec: ModelSpec,
    /// Overrides (`--set`).
    pub overrides: Vec<Override>,
    /// Text with the overrides applied; `None` without overrides.
    edited: Option<String>,
    /// Contents of data files by their names in the model, in place of files.
    files: BTreeMap<String, Arc<[u8]>>,
    /// The data files that were read.
    read: Arc<ReadFiles>,
}

/// True for a file of measurements: by its content no model, and by its name no YAML; or one that is not there with a name of such a file.
pub fn is_record(path: &Path) -> bool {
    let has_keys = |text: &str| text.lines().any(|line| line.starts_with("format:"));
    let text = || read_text(path, MODEL_FILE, LONGEST_MODEL);
    let extension = path.extension().map(|own| own.to_ascii_lowercase());
    let is_yaml = extension.is_none_or(|own| own == "yaml" || own == "yml");
    match path.is_file() {
        true => !is_yaml && !text().is_ok_and(|text| has_keys(&text)),
        false => has_data_extension(path),
    }
}

impl ModelFile {
    /// Reads a model file.
    ///
    /// # Errors
    ///
    /// If the file does not exist, its path or its content is not UTF-8 text, or
    /// [`parse`](Self::parse) finds a mistake.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        check_path(path)?;
        match is_record(path) {
            true => Err(InputError::file(path, "a record in place of a model file")
                .expected(MODEL_FILE)
                .hint(format!(
                    "`kmcfit init {record}` writes a model file for the record, `kmcfit fit {record}` fits it",
                    record = path.display()
                ))),
            false => Self::parse(path, read_text(path, MODEL_FILE, LONGEST_MODEL)?),
        }
    }

    /// Reads a model file and applies overrides.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read) and [`with_overrides`](Self::with_overrides).
    pub fn read_with_overrides(
        path: impl AsRef<Path>,
        overrides: &[Override],
    ) -> Result<Self, InputError> {
        Self::read(path)?.with_overrides(overrides)
    }

    /// Applies overrides one after another.
    ///
    /// # Errors
    ///
    /// When a key is unknown or its value has the wrong type; the location is the override.
    pub fn with_overrides(mut self, overrides: &[Override]) -> Result<Self, InputError> {
        for change in overrides {
            let unreadable = |error: serde_yaml::Error| {
                InputError::new(
                    change.location(),
                    "the model cannot be written with this value",
                )
                .found(error)
            };
            let checked = Checked::new(&self.path, self.effective_text())?;
            let mut model = checked.read().map_err(unreadable)?;
            change.apply(&mut model)?;
            let text = serde_yaml::to_string(&model).map_err(unreadable)?;
            let moved = |error: InputError| InputError {
                location: change.location(),
                ..error
            };
            let edited = Self::parse(&self.path, &text).map_err(moved)?;
            self.spec = edited.spec;
            self.edited = Some(text);
            self.overrides.push(change.clone());
        }
        Ok(self)
    }

    /// The text of the model with the overrides applied.
    pub fn effective_text(&self) -> &str {
        self.edited.as_deref().unwrap_or(&self.text)
    }

    /// Adds contents of data files by their names in the model: they are read in place of files.
    #[must_use]
    pub fn with_files(mut self, files: impl IntoIterator<Item = (String, Arc<[u8]>)>) -> Self {
        self.files.extend(files);
        self
    }

    /// The model with the record `name` in place of the data of its first experiment; its content stands in memory.
    #[must_use]
    pub fn with_record(mut self, name: &str, content: Arc<[u8]>) -> Self {
        if let Some(experiment) = self.spec.experiments.first_mut() {
            experiment.data = Some(name.to_owned());
        }
        self.files.insert(name.to_owned(), content);
        self
    }

    /// The contents of data files that stand in memory, by their names in the model.
    pub fn files_in_memory(&self) -> Vec<(String, Arc<[u8]>)> {
        let files = self.files.iter();
        files
            .map(|(name, content)| (name.clone(), Arc::clone(content)))
            .collect()
    }

    /// The data files that were read.
    pub fn read_files(&self) -> &ReadFiles {
        &self.read
    }

    /// The content of a data file that stands in memory.
    pub(super) fn in_memory(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(|content| &**content)
    }

    /// The tables of a data file, by its name in the model.
    ///
    /// # Errors
    ///
    /// As [`Table::read_all`].
    pub(super) fn tables(
        &self,
        name: &str,
        format: &TableFormat,
    ) -> Result<Vec<Table>, InputError> {
        match self.in_memory(name) {
            Some(content) => Table::parse_all(name, content, format),
            None => {
                let path = self.resolve(name);
                let bytes = self.read.read(&path, TABLE, LONGEST_TABLE)?;
                Table::from_bytes(&path, bytes, format)
            }
        }
    }

    /// The model with the overrides applied as JSON: its keys, with the values of all anchors and merges.
    pub fn to_json(&self) -> String {
        serde_json::to_string(&self.value()).unwrap_or_default()
    }

    /// The overrides as they were written.
    pub fn override_texts(&self) -> Vec<String> {
        self.overrides.iter().map(Override::to_string).collect()
    }

    /// Parses the text of a model file. Messages name `path`, and relative paths in the text start from its folder.
    ///
    /// ```
    /// use kmcfit::config::ModelFile;
    /// let model = ModelFile::parse("free.yaml", "
    /// format: 1
    /// experiments:
    ///   - initial: {displacement: 3.3, velocity: 1}
    /// functions:
    ///   mass: {basis: nodal, start: 2.0}
    ///   damping: {basis: constant, start: 1.0}
    ///   stiffness: {fixed: 1.0}
    /// ")?;
    /// assert_eq!(model.spec.experiments.len(), 1);
    /// let error = model.error_at("functions.mass.start", "the mass must be smaller");
    /// assert_eq!(
    ///     error.to_string(),
    ///     "free.yaml:6:31: functions.mass.start: the mass must be smaller"
    /// );
    /// # Ok::<(), kmcfit::error::InputError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// When the text is not YAML, has unknown, missing or repeated keys, or values of the wrong type.
    pub fn parse(path: impl AsRef<Path>, text: impl Into<String>) -> Result<Self, InputError> {
        let path = path.as_ref().to_path_buf();
        let text = text.into();
        if is_blank(&text) {
            return Err(InputError::file(path, "the file is empty")
                .expected(MODEL_FILE)
                .hint("begin with `format: 1`"));
        }
        let spec = yaml_errors::read(&path, &Checked::new(&path, &text)?)?;
        let model = Self {
            path,
            text,
            spec,
            overrides: Vec::new(),
            edited: None,
            files: BTreeMap::new(),
            read: Arc::default(),
        };
        if model.spec.experiments.is_empty() {
            return Err(model
                .error_at("experiments", "no experiment")
                .found("an empty list")
                .expected("at least one experiment"));
        }
        let experiments = model.spec.experiments.len();
        if experiments > MOST_EXPERIMENTS {
            let key = format!("experiments[{MOST_EXPERIMENTS}]");
            return Err(model
                .error_at(&key, "too many experiments")
                .found(experiments)
                .expected(format!("at most {MOST_EXPERIMENTS}")));
        }
        Ok(model)
    }

    /// Name of experiment `i` in reports.
    pub(super) fn experiment_name(&self, i: usize) -> String {
        let given = self.spec.experiments[i].name.as_ref();
        given.map_or_else(|| format!("experiment {}", i + 1), |name| name.clone())
    }

    /// An error about an argument, moved to the key of the model that supplies it.
    pub(super) fn error_about(&self, key: &str, error: InputError) -> InputError {
        let here = self.error_at(key, &error.problem);
        InputError {
            location: here.location,
            key: here.key,
            ..error
        }
    }

    /// An error about the value at a key such as `experiments[0].initial.velocity`.
    ///
    /// The location is the line and column of the value, or of the nearest enclosing key if the file omits it. The
    /// location of an aliased value (`*name`) is its anchor (`&name`).
    pub fn error_at(&self, key: &str, problem: impl Into<String>) -> InputError {
        let path = key_path(key);
        if let Some(change) = self.overrides.iter().rev().find(|o| o.covers(&path)) {
            return InputError::new(change.location(), problem).key(key);
        }
        let found = locate(&self.text, &path);
        let position = match found.key {
            Some(key) if found.depth < path.len() => key,
            _ => found.value,
        };
        InputError::new(location(&self.path, position), problem).key(key)
    }

    /// The files that the model reads, each once, in the order of the text.
    pub fn data_files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = Vec::new();
        for file in self.data_names().iter().map(|name| self.resolve(name)) {
            if !files.contains(&file) {
                files.push(file);
            }
        }
        files
    }

    /// The values of all keys `data` that name a file, each once, in the order of the text.
    pub(super) fn data_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        collect_data(&self.value(), &mut names);
        names
    }

    /// Those of the records, without the coefficients of experiments.
    pub fn record_names(&self) -> Vec<String> {
        let mut value = self.value();
        let list = value.get_mut("experiments");
        let list = list.and_then(|list| list.as_sequence_mut());
        let mut names = Vec::new();
        for experiment in list.into_iter().flatten() {
            (experiment.as_mapping_mut()).and_then(|keys| keys.remove("functions"));
            collect_data(experiment, &mut names);
        }
        names
    }

    /// The model with the overrides applied; it was parsed before, so no step fails.
    fn value(&self) -> serde_yaml::Value {
        let text = Checked::new(&self.path, self.effective_text()).ok();
        text.and_then(|text| text.read().ok()).unwrap_or_default()
    }

    /// A path in the model file, relative to its folder.
    pub fn resolve(&self, relative: impl AsRef<Path>) -> PathBuf {
        match self.path.parent() {
            Some(folder) => folder.join(relative),
            None => relative.as_ref().to_path_buf(),
        }
    }
}

fn collect_data(value: &serde_yaml::Value, names: &mut Vec<String>) {
    use serde_yaml::Value;
    match value {
        Value::Mapping(map) => {
            for (key, value) in map {
                match (key.as_str(), value.as_str()) {
                    (Some("data"), Some(name)) => {
                        if !names.iter().any(|known| known == name) {
                            names.push(name.to_owned());
                        }
                    }
                    _ => collect_data(value, names),
                }
            }
        }
        Value::Sequence(list) => list.iter().for_each(|value| collect_data(value, names)),
        _ => {}
    }
}

/// Refuses a path that is not UTF-8: results, which are UTF-8, name the model by its path.
pub(super) fn check_path(path: &Path) -> Result<(), InputError> {
    match path.to_str() {
        Some(_) => Ok(()),
        None => Err(InputError::file(path, "the path of the model is not UTF-8")
            .found("bytes that are not valid UTF-8")
            .expected("a path in UTF-8: the results name the model by its path")
            .hint("rename the file or its folder")),
    }
}

/// True for a text that consists of blank lines, comments and document markers.
fn is_blank(text: &str) -> bool {
    text.lines()
        .map(|line| line.split('#').next().unwrap_or_default().trim())
        .all(|line| matches!(line, "" | "---" | "..."))
}
