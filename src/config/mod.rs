//! The model file: the only place that knows YAML.
//!
//! [`ModelFile::read`] turns a file into a [`ModelSpec`](spec::ModelSpec), which says what was
//! written, key by key. Mistakes of spelling, type and syntax end here, with file, line, column and
//! key; what the values mean together is checked later, through [`ModelFile::error_at`], which
//! finds the line of a key again.

mod build;
mod choice;
mod expansion;
mod failure;
mod guard;
pub mod key;
pub mod keys;
pub mod locate;
mod map;
mod model_file;
mod overrides;
pub mod scalar;
mod sequence;
mod source;
pub mod spec;
mod starter;
mod syntax;
mod value;

pub use build::{
    BuildMode, Candidate, ChannelNote, Equivalent, HoldOut, Model, Preparation, StudyPlan,
    StudyTarget, WeightSearch, build,
};
pub use model_file::ModelFile;
pub use overrides::Override;
pub use scalar::{Number, NumberOrColumn, Text};
pub use sequence::Sequence;
pub use source::{DataFile, ModelSource};
pub use starter::{Starter, starter};
