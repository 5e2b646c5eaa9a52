//! `kmcfit check`: an overview of a model and its data before a fit, or of a data file; and the check of the gradient.

use super::fit::read;
use super::progress::Activity;
use super::{CommandError, OK, Overrides, announce, check_file, check_gradient, print};
use crate::formats::has_data_extension;
use crate::report::overview;
use std::path::PathBuf;

/// Show how the data of a model are read and what they can determine; list the columns of a data file; or compare the gradient with finite
/// differences.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit check model.yaml\n  kmcfit check record.mat                       list its variables\n  kmcfit check model.yaml --gradient --nodes 500,1000,2000"
)]
pub struct Arguments {
    /// Model file (YAML), or a data file.
    model: PathBuf,
    #[command(flatten)]
    set: Overrides,
    /// Compare the gradient with finite differences.
    #[arg(long)]
    gradient: bool,
    /// Numbers of nodes for the check of the gradient [default: that of the model].
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "N,N,...",
        requires = "gradient"
    )]
    nodes: Vec<usize>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    if has_data_extension(&arguments.model) {
        return Ok(check_file::run(&arguments.model)?);
    }
    let file = arguments.set.read(&arguments.model)?;
    let model = read(&file)?;
    announce(&model);
    if arguments.gradient && model.problem.functions.parameters() > 0 {
        return check_gradient::run(&file, &model, &arguments.nodes);
    }
    let activity = Activity::begin("computing the sensitivities");
    let text = overview(&model);
    drop(activity);
    print(&text);
    Ok(OK)
}
