//! Additions to the corpus: inputs that led to new kinds of messages.

use std::fs;
use std::path::{Path, PathBuf};

/// Longest input that is added, bytes: the length of a hand-written model.
const LONGEST: usize = 2000;
/// Most inputs that one run adds to a target; the corpus must remain readable within a second.
const MOST: usize = 20;

/// Adds inputs to the corpus of a target, where `KMCFIT_FUZZ_GROW` is set.
pub struct Growth {
    folder: Option<PathBuf>,
    added: usize,
}

impl Growth {
    pub fn of(target: &str) -> Self {
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
        let is_asked = std::env::var_os("KMCFIT_FUZZ_GROW").is_some_and(|v| !v.is_empty());
        Self {
            folder: is_asked.then(|| corpus.join(target)),
            added: 0,
        }
    }

    /// Stores an input under a name derived from its content.
    pub fn add(&mut self, input: &[u8]) {
        let Some(folder) = &self.folder else { return };
        if input.len() > LONGEST || self.added == MOST {
            return;
        }
        // FNV-1a.
        let hash = input.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        });
        fs::write(folder.join(format!("grown-{hash:016x}")), input).expect("room");
        self.added += 1;
    }

    /// Number of stored inputs.
    pub fn added(&self) -> usize {
        self.added
    }
}
