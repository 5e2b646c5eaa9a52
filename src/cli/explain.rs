//! `kmcfit explain`: prints the documentation of a key of the model file.

use super::{CommandError, OK, print};
use crate::config::key_documentation;

/// Explain a key of the model file: meaning, type, unit, default, example.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit explain functions.mass")]
pub struct Arguments {
    /// Key, with or without its parents: tolerance, fit.stop, functions.mass [default: top-level keys].
    key: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    print(&key_documentation::explain(arguments.key.as_deref())?);
    Ok(OK)
}
