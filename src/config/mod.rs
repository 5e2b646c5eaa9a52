//! The model file: the only place that knows YAML.
//!
//! [`ModelFile::read`] turns a file into a [`ModelSpec`](spec::ModelSpec), which says what was
//! written, key by key. Mistakes of spelling, type and syntax end here, with file, line, column and
//! key; what the values mean together is checked later, through [`ModelFile::error_at`], which
//! finds the line of a key again.

mod build;
mod choice;
mod expansion;
mod input_limits;
pub mod key;
pub mod key_documentation;
pub mod key_positions;
mod map;
mod model_file;
mod overrides;
mod reader;
mod scaffold;
mod sequence;
mod source;
pub mod spec;
mod syntax;
pub mod values;
mod yaml_errors;

pub use build::{
    BuildMode, Candidate, ChannelNote, Equivalent, HoldOut, Model, Preparation, StudyPlan,
    StudyTarget, WeightSearch, build,
};
pub use model_file::ModelFile;
pub use overrides::Override;
pub use scaffold::{Scaffold, scaffold};
pub use sequence::Sequence;
pub use source::{DataFile, ModelSource};
pub use values::{Number, NumberOrColumn, Text};
