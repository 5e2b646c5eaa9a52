//! The model file. All uses of YAML are in this module.
//!
//! [`ModelFile::read`] parses a file into a [`ModelSpec`](kmcfit_core::model::ModelSpec), with one field for each key. Errors of
//! syntax, spelling and type are reported here with file, line, column and key. [`build()`] checks the values against
//! each other and reports errors at the line of a key by [`ModelFile::error_at`].

mod dominant;
mod input_limits;
pub mod key;
pub mod key_documentation;
pub mod key_positions;
mod lowering;
mod model_file;
mod new_record;
mod overrides;
mod reader;
mod retired;
mod run_settings;
mod scaffold;
mod scalar;
mod source;
mod syntax;
mod yaml_errors;

pub use lowering::{
    AutomaticGrid, BuildMode, ChannelNote, HoldOut, Model, Preparation, StudyPlan, WeightSearch,
    build,
};
pub use model_file::{ModelFile, is_record};
pub use new_record::{MeasuredChannel, NewRecord};
pub use overrides::Override;
pub use run_settings::{RunSensor, SensorValue};
pub use scaffold::{Role, Scaffold, Source, Statements, rate, recognised, scaffold};
pub use source::{DataFile, ModelSource};
