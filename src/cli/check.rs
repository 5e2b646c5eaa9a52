//! `kmcfit check`: an overview of a model and its data before a fit, or of a data file.

use super::fit::read;
use super::progress::Activity;
use super::{CommandError, OK, Overrides, announce, check_file, print};
use crate::config::is_record;
use crate::report::overview;
use std::path::PathBuf;

/// Show how the data of a model are read and what they can determine; or list the columns of a data file.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit check model.yaml\n  kmcfit check record.mat                       list its variables"
)]
pub struct Arguments {
    /// Model file (YAML), or a data file.
    model: PathBuf,
    #[command(flatten)]
    set: Overrides,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    if is_record(&arguments.model) {
        return Ok(check_file::run(&arguments.model)?);
    }
    let file = arguments.set.read(&arguments.model)?;
    let model = read(&file)?;
    announce(&model);
    let activity = Activity::begin("computing the sensitivities");
    let text = overview(&model);
    drop(activity);
    print(&text);
    Ok(OK)
}
