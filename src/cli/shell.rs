//! `kmcfit completions` and `kmcfit man`: completion scripts for shells and the manual page.

use super::{CommandError, OK, print};
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use std::io;

/// Print a completion script for a shell.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit completions bash > ~/.local/share/bash-completion/completions/kmcfit"
)]
pub struct Completions {
    /// Shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page in roff format.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit man > kmcfit.1")]
pub struct Manual {}

pub fn completions(arguments: &Completions) -> Result<u8, CommandError> {
    let mut script = Vec::new();
    let mut command = super::Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "kmcfit", &mut script);
    print(&String::from_utf8_lossy(&script));
    Ok(OK)
}

pub fn manual(_: &Manual) -> Result<u8, CommandError> {
    let page = page().map_err(|error| CommandError::Numerical(error.to_string()))?;
    print(&String::from_utf8_lossy(&page));
    Ok(OK)
}

/// One page: the program, then every command with its options.
fn page() -> io::Result<Vec<u8>> {
    let mut command = super::Arguments::command();
    command.build();
    let mut page = Vec::new();
    let man = Man::new(command.clone());
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    page.extend(b".SH COMMANDS\n");
    for command in command.get_subcommands().filter(|c| c.get_name() != "help") {
        section(command, &mut page)?;
    }
    man.render_version_section(&mut page)?;
    Ok(page)
}

/// Manual section of a command: usage, description, options.
fn section(command: &Command, page: &mut Vec<u8>) -> io::Result<()> {
    let man = Man::new(command.clone());
    page.extend(format!(".SS {}\n", command.get_name()).as_bytes());
    let mut usage = Vec::new();
    man.render_synopsis_section(&mut usage)?;
    without_headings(&usage, page);
    page.extend(b".PP\n");
    let mut body = Vec::new();
    man.render_description_section(&mut body)?;
    man.render_options_section(&mut body)?;
    without_headings(&body, page);
    Ok(())
}

/// The lines of some sections, which are parts of one here.
fn without_headings(sections: &[u8], page: &mut Vec<u8>) {
    let lines = sections.split(|byte| *byte == b'\n');
    for line in lines.filter(|line| !line.starts_with(b".SH") && !line.is_empty()) {
        page.extend(line);
        page.push(b'\n');
    }
}
