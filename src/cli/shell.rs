//! `kmcfit completions`: completion scripts for shells.

use super::{CommandError, OK, print};
use clap::CommandFactory;
use clap_complete::Shell;

/// Print the completion script for a shell.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit completions bash > ~/.local/share/bash-completion/completions/kmcfit"
)]
pub struct Completions {
    /// Shell.
    #[arg(value_enum)]
    shell: Shell,
}

pub fn completions(arguments: &Completions) -> Result<u8, CommandError> {
    let mut script = Vec::new();
    let mut command = super::Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "kmcfit", &mut script);
    print(&String::from_utf8_lossy(&script));
    Ok(OK)
}
