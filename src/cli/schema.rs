//! `kmcfit schema`

use super::{Failure, OK, print};
use crate::config::keys;
use crate::report::json;

/// Print the JSON schema (draft 07) of model files, for editors that complete and check them.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

pub fn run(_: &Arguments) -> Result<u8, Failure> {
    print(&text());
    Ok(OK)
}

/// The schema as a file.
pub(super) fn text() -> String {
    json(&keys::schema())
}
