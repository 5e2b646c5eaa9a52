//! `kmcfit explain`

use super::{Failure, OK, print};
use crate::config::keys;

/// Say what a key of a model file means: its kind, unit, default, and an example.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A key, alone or with those above it: tolerance, fit.stop, functions.mass [default: the keys at
    /// the top].
    key: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    print(&keys::explain(arguments.key.as_deref())?);
    Ok(OK)
}
