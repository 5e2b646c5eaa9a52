//! What the journal of a fit is about: its first line.

use crate::config::ModelFile;
use crate::error::InputError;
use crate::input::{LONGEST_TABLE, read_bytes};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the format.
pub(super) const FORMAT: u32 = 1;

/// What the journal of a fit is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitHeading {
    /// Version of the format.
    pub format: u32,
    /// Version of kmcfit: another one may compute with other bits.
    pub version: String,
    /// The model file, as it was given.
    pub model: PathBuf,
    /// What was given beside it, in the place of its own values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Whether figures are drawn.
    pub figures: bool,
    /// Least time between two checkpoints, s, where it was given.
    pub checkpoint: Option<f64>,
    /// The model file and the files that it reads.
    pub sources: Vec<Source>,
}

/// A file that decides what a fit finds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The file.
    pub file: PathBuf,
    /// A hash of its bytes: a changed file does not go on.
    pub hash: String,
}

impl FitHeading {
    /// The heading for a fit of a model that was built: what it needs of its files could be read.
    pub fn new(file: &ModelFile, figures: bool, checkpoint: Option<f64>) -> Self {
        let mut sources = vec![Source {
            file: file.path.clone(),
            hash: hash(file.text.as_bytes()),
        }];
        for path in file.data_files() {
            let bytes = read_bytes(&path, "a file of readings", LONGEST_TABLE);
            sources.push(Source {
                file: path,
                hash: bytes.map_or("not read".into(), |bytes| hash(&bytes)),
            });
        }
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            model: file.path.clone(),
            overrides: file.override_texts(),
            figures,
            checkpoint,
            sources,
        }
    }

    /// The hashes of the files that the model reads.
    pub fn data_hashes(&self) -> String {
        let hashes = self.sources.iter().skip(1).map(|s| s.hash.as_str());
        hashes.collect::<Vec<_>>().join(" ")
    }

    /// Refuses to go on with a fit that was begun with something else.
    pub(super) fn same_as(&self, before: &Self, journal: &Path) -> Result<(), InputError> {
        if before.version != self.version {
            return Err(InputError::file(
                journal,
                "this fit was begun by another version of kmcfit",
            )
            .found(format!("version {}", before.version))
            .expected(format!("version {}, or a new fit", self.version)));
        }
        if before.overrides != self.overrides {
            return Err(InputError::file(
                journal,
                "this fit was begun with other values set beside the model",
            )
            .found(before.overrides.join(", "))
            .expected("the same ones, or a new fit"));
        }
        let changed = |source: &&Source| !before.sources.contains(source);
        match self.sources.iter().find(changed) {
            Some(source) => Err(InputError::file(
                &source.file,
                "this file is not as it was when the fit was begun",
            )
            .expected("the same model and data, or a new fit")),
            None => Ok(()),
        }
    }

    /// What tells this fit from others in the same folder.
    pub(super) fn fingerprint(&self) -> String {
        hash(serde_json::to_string(self).unwrap_or_default().as_bytes())
    }
}

/// FNV-1a, which is the same on every machine.
pub(in crate::report) fn hash(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
