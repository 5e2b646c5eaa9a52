//! `kmcfit verify`: recomputes the results of a finished run.

use super::progress::Activity;
use super::{CommandError, NOT_CONVERGED, OK, print};
use crate::report::{Run, Verification, json, model_predictions};
use std::path::PathBuf;

/// Recompute the results of a finished run from its model file, data and parameters.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit verify runs/model\n\nExit status: 0 if all results hold, 3 if not."
)]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
    /// Print the checks as JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let activity = Activity::begin(format!("reading {}", arguments.run.display()));
    let run = Run::open(&arguments.run)?;
    activity.stage("recomputing the results");
    let verification = Verification::of(&run, &model_predictions)?;
    drop(activity);
    match arguments.json {
        true => print(&json(&verification)),
        false => print(&verification.text()),
    }
    Ok(match verification.holds {
        true => OK,
        false => NOT_CONVERGED,
    })
}
