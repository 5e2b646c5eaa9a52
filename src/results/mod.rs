//! Results on disk: output folders, atomic writing, manifests, journals.
//!
//! Files and runs are replaced atomically, and only files that the manifest attributes to kmcfit by digest are replaced
//! or removed. All changes to the file system are made in `system`.

mod analysis_journal;
mod atomic;
mod claim;
mod exchange;
mod fit_journal;
mod heading;
mod journal;
mod lock;
mod manifest;
mod output_folder;
mod row_file;
mod system;
mod work_folder;

pub use analysis_journal::AnalysisJournal;
pub use atomic::{write_stream, write_together, write_whole};
pub use claim::{Claim, RESULT};
pub use exchange::{Stage, complete};
pub use fit_journal::FitJournal;
pub use heading::{Heading, RequestedFiles, SourceFile};
#[doc(hidden)]
pub use journal::with_checksums;
pub use journal::{CHECKPOINT, COMPARE_JOURNAL, FIT_JOURNAL, STUDY_JOURNAL};
pub use manifest::{FileRecord, MANIFEST, Manifest};
pub use output_folder::OutputFolder;
pub use row_file::{RowFile, complete_lines};
