//! Declaration of the files that a command may write into its output folder, made before its work begins.

use std::path::PathBuf;

/// Name of the result document of a fit.
pub const RESULT: &str = "result.json";

/// Names of the files that a command may write in an output folder, and the files that it reads.
#[derive(Debug, Clone)]
pub struct Claim {
    pub(super) command: &'static str,
    files: Vec<String>,
    pub(super) families: Vec<Family>,
    pub(super) journals: Vec<&'static str>,
    pub(super) inputs: Vec<PathBuf>,
}

/// The files `FOLDER/STEM.EXTENSION` and `FOLDER/STEM-*.EXTENSION` of some stems: their number depends on the results.
#[derive(Debug, Clone)]
pub(super) struct Family {
    pub folder: &'static str,
    extension: &'static str,
    stems: Vec<String>,
}

impl Family {
    /// True if a file name belongs to the family.
    pub fn covers(&self, file_name: &str) -> bool {
        let Some((stem, extension)) = file_name.rsplit_once('.') else {
            return false;
        };
        let is_stem = |known: &String| {
            stem.strip_prefix(known.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        extension == self.extension && self.stems.iter().any(is_stem)
    }
}

impl Claim {
    /// A claim of `command` without files.
    pub fn new(command: &'static str) -> Self {
        Self {
            command,
            files: Vec::new(),
            families: Vec::new(),
            journals: Vec::new(),
            inputs: Vec::new(),
        }
    }

    /// Adds files by their paths relative to the folder.
    #[must_use]
    pub fn files<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.files.extend(names.into_iter().map(Into::into));
        self
    }

    /// Adds the files `FOLDER/STEM.EXTENSION` and `FOLDER/STEM-*.EXTENSION`.
    #[must_use]
    pub fn family<S: Into<String>>(
        mut self,
        folder: &'static str,
        extension: &'static str,
        stems: impl IntoIterator<Item = S>,
    ) -> Self {
        self.families.push(Family {
            folder,
            extension,
            stems: stems.into_iter().map(Into::into).collect(),
        });
        self
    }

    /// Adds journals and checkpoints, which are written while the command works.
    #[must_use]
    pub fn journals(mut self, names: &[&'static str]) -> Self {
        self.journals.extend(names);
        self
    }

    /// Adds files that the command reads and therefore must not replace.
    #[must_use]
    pub fn inputs(mut self, files: impl IntoIterator<Item = PathBuf>) -> Self {
        self.inputs.extend(files);
        self
    }

    /// The files with fixed names.
    pub(super) fn fixed(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(String::as_str)
    }

    /// True if the command may write a file of this relative path.
    pub fn covers(&self, name: &str) -> bool {
        let in_family = |family: &Family| {
            name.strip_prefix(family.folder)
                .and_then(|rest| rest.strip_prefix('/'))
                .is_some_and(|file_name| family.covers(file_name))
        };
        self.files.iter().any(|file| file == name) || self.families.iter().any(in_family)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_covers_its_names_only() {
        let claim = Claim::new("fit")
            .files([RESULT])
            .family("figures", "svg", ["motion"]);
        for name in ["result.json", "figures/motion.svg", "figures/motion-2.svg"] {
            assert!(claim.covers(name), "{name}");
        }
        for name in [
            "figures/motions.svg",
            "figures/motion.csv",
            "figures/motion",
            "motion.svg",
            "figures/sub/motion.svg",
            "other/result.json",
        ] {
            assert!(!claim.covers(name), "{name}");
        }
    }
}
