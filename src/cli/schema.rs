//! `kmcfit schema`: prints the JSON schema of model files.

use super::{CommandError, OK, print};
use crate::config::key_documentation;
use crate::report::json;

/// Print the JSON schema (draft 07) of model files, for completion and checks in editors.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit schema > kmcfit.schema.json")]
pub struct Arguments {}

pub fn run(_: &Arguments) -> Result<u8, CommandError> {
    print(&text());
    Ok(OK)
}

/// The schema as a file.
pub(super) fn text() -> String {
    json(&key_documentation::schema())
}
