//! The command line, one file for each command.

mod arguments;
mod check;
mod check_file;
mod compare;
mod demo;
mod environment;
mod explain;
mod fit;
mod fleet;
mod init;
mod interrupt;
mod output;
mod overrides;
mod predict;
mod progress;
mod retired;
mod schema;
mod shell;
mod simulate;
mod source_snippet;
mod study;
mod study_run;
mod verify;

use crate::config::{Model, ModelFile};
use crate::error::InputError;
use crate::report::Run;
use clap::{CommandFactory, Parser, Subcommand};
use environment::check_arithmetic;
pub use environment::provide_host;
use kmcfit_core::solvers::Status;
use output::{complain, print, say};
use overrides::Overrides;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
pub use study::study_into;

/// Identify time-varying mass, damping and stiffness of a vibrating system from measured records.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    max_term_width = 100,
    after_help = "Example:\n  kmcfit init record.csv      write a model file for the record\n  kmcfit fit record.yaml      fit it; results in runs/record\n\nExit status: 0 converged or completed, 2 invalid input, 3 not converged, 130 or 143 interrupted."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Fit(fit::Arguments),
    Fleet(fleet::Arguments),
    Simulate(simulate::Arguments),
    Check(check::Arguments),
    Predict(predict::Arguments),
    Compare(compare::Arguments),
    Verify(verify::Arguments),
    Study(study::Arguments),
    Init(init::Arguments),
    Explain(explain::Arguments),
    Schema(schema::Arguments),
    Demo(demo::Arguments),
    Completions(shell::Completions),
}

/// Converged or completed.
const OK: u8 = 0;
/// Invalid input.
const BAD_INPUT: u8 = 2;
/// Not converged; results are written.
const NOT_CONVERGED: u8 = 3;
/// Interrupted by Ctrl-C; the best point is written.
const INTERRUPTED: u8 = 130;
/// Interrupted by SIGTERM; the best point is written.
const TERMINATED: u8 = 143;

/// Reason for which a command failed.
#[derive(Debug)]
pub enum CommandError {
    /// Invalid input.
    Input(InputError),
    /// Numerical failure before there was a result, as a sentence.
    Numerical(String),
}

impl From<InputError> for CommandError {
    fn from(error: InputError) -> Self {
        CommandError::Input(error)
    }
}

/// Runs the program on the arguments of the process, which ends with its exit code.
///
/// All output is flushed by then. The process ends without its exit handlers, which would return the memory of long records page by page.
pub fn main() -> ! {
    let code = run(std::env::args_os().collect());
    signal_hook::low_level::exit(code.into())
}

/// Runs the program on arguments, the first of which is its name; returns its exit code.
pub fn run(mut words: Vec<OsString>) -> u8 {
    interrupt::ignore_file_size_signal();
    // `kmcfit help --help` is `kmcfit help`; clap takes the option for a command.
    if words.len() == 3 && words[1] == "help" && (words[2] == "--help" || words[2] == "-h") {
        words.truncate(2);
    }
    let arguments = match Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(error) => {
            let command = words.get(1).and_then(|word| word.to_str());
            return match retired::error(&words)
                .or_else(|| arguments::input_error(&error, &Arguments::command(), command))
            {
                Some(error) => {
                    complain(&error);
                    BAD_INPUT
                }
                None => output::print_usage(&error),
            };
        }
    };
    provide_host();
    if let Err(error) = check_arithmetic() {
        complain(&error);
        return BAD_INPUT;
    }
    let result = match arguments.command {
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Completions(arguments) => shell::completions(&arguments),
    };
    let code = match result {
        Ok(code) => code,
        Err(CommandError::Input(error)) => {
            complain(&error);
            BAD_INPUT
        }
        Err(CommandError::Numerical(reason)) => {
            output::say_failed(&reason);
            NOT_CONVERGED
        }
    };
    match output::has_failed() {
        true => BAD_INPUT,
        false => code,
    }
}

/// Prints the notes and warnings of a model.
fn announce(model: &Model) {
    (model.automatic.iter()).for_each(|note| say("note", note));
    (model.warnings.iter()).for_each(|warning| say("warning", warning));
}

/// Notes the files that have changed since the fit of a run.
fn note_changes(run: &Run) {
    for (path, is_model) in run.changed_files() {
        let what = match (path.exists(), is_model) {
            // The run has the model, which may be that of a record.
            (false, true) => continue,
            (false, false) => "is missing, and was read by the fit",
            (true, true) => "has changed since the fit: the model in the run is used",
            (true, false) => "has changed since the fit",
        };
        say(
            "note",
            format!("{}: {} {what}", run.folder.display(), path.display()),
        );
    }
}

fn exit_code(status: Status) -> u8 {
    match status {
        Status::Converged | Status::Completed => OK,
        Status::Interrupted => interrupt::exit_code(),
        Status::MaxIterations
        | Status::TimeLimit
        | Status::Stalled
        | Status::Infeasible
        | Status::Failed => NOT_CONVERGED,
    }
}

/// Name of a model file without its extension, as the name of a folder; `run` for names such as `..`.
fn stem(model: &Path) -> String {
    match model.file_stem().map(|stem| stem.to_string_lossy()) {
        Some(stem) if !stem.trim_matches('.').is_empty() => stem.into_owned(),
        _ => "run".into(),
    }
}

/// Files that a command on a model reads, which its results must not replace.
fn inputs(file: &ModelFile) -> Vec<PathBuf> {
    let mut files = file.data_files();
    files.push(file.path.clone());
    files
}

/// A failure to write as an error of the output folder.
fn unwritable(path: &Path, error: &io::Error) -> InputError {
    let found = match path.ancestors().skip(1).find(|above| above.is_file()) {
        Some(file) => format!("{} is a file, not a folder", file.display()),
        None => error.to_string(),
    };
    InputError::argument("--out", "the results cannot be written")
        .found(format!("{}: {found}", path.display()))
        .expected("a writable folder")
}
