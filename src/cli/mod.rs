//! The command line: one file per command, no numerics.

mod arguments;
mod check;
mod compare;
mod demo;
mod explain;
mod fit;
mod init;
mod interrupt;
mod overrides;
mod predict;
mod progress;
mod resume;
mod schema;
mod shell;
mod simulate;
mod study;

use crate::error::{InputError, Place};
use crate::excerpt::Excerpt;
use crate::input::harmless;
use crate::solvers::Status;
use clap::{CommandFactory, Parser, Subcommand};
use console::style;
use overrides::Overrides;
use std::fmt::Display;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// Finds the time-varying mass, damping and stiffness of an oscillator from its measured motion.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Fit(fit::Arguments),
    Simulate(simulate::Arguments),
    Check(check::Arguments),
    Predict(predict::Arguments),
    Compare(compare::Arguments),
    Study(study::Arguments),
    Resume(resume::Arguments),
    Init(init::Arguments),
    Explain(explain::Arguments),
    Schema(schema::Arguments),
    Demo(demo::Arguments),
    Completions(shell::Completions),
    Man(shell::Manual),
}

/// Everything is as asked for.
const OK: u8 = 0;
/// The input cannot be used.
const BAD_INPUT: u8 = 2;
/// Ended otherwise than asked for; results are written.
const NOT_CONVERGED: u8 = 3;
/// Interrupted by Ctrl-C; the best so far is written.
const INTERRUPTED: u8 = 130;

/// Why a command did not come to its end.
#[derive(Debug)]
enum Failure {
    /// The input cannot be used.
    Input(InputError),
    /// Numerical trouble before there was a result, in one sentence.
    Numerical(String),
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Failure::Input(error)
    }
}

/// Runs the program on the arguments of the process.
pub fn main() -> ExitCode {
    crate::memory::restart_with_plain_allocators();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => match arguments::no_number(&error) {
            Some(error) => {
                complain(&error);
                return ExitCode::from(BAD_INPUT);
            }
            None => arguments::with_near_command(error, &Arguments::command()).exit(),
        },
    };
    if let Err(error) = crate::lanes::check_limit().and_then(|()| crate::memory::check_base()) {
        complain(&error);
        return ExitCode::from(BAD_INPUT);
    }
    let result = match arguments.command {
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Resume(arguments) => resume::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Completions(arguments) => shell::completions(&arguments),
        Command::Man(arguments) => shell::manual(&arguments),
    };
    ExitCode::from(match result {
        Ok(code) => code,
        Err(Failure::Input(error)) => {
            complain(&error);
            BAD_INPUT
        }
        Err(Failure::Numerical(reason)) => {
            let failed = style("failed:").for_stderr().red().bold();
            eprintln!("{failed} {}", harmless(&reason));
            NOT_CONVERGED
        }
    })
}

/// Says what is wrong with the input: the message, and below its first line the line of the file that
/// it is about. Coloured on a terminal only, and not where `NO_COLOR` is set.
fn complain(error: &InputError) {
    let red = |text: &str| style(text.to_owned()).for_stderr().red().bold();
    let message = error.to_string();
    let message = harmless(&message);
    let (headline, rest) = message.split_once('\n').unwrap_or((&message, ""));
    eprintln!("{} {headline}", red("error:"));
    if let Some(excerpt) = Excerpt::of(error) {
        let [blank, line, mark] = excerpt.lines();
        let (edge, mark) = mark.split_at(blank.len());
        eprintln!("{blank}\n{line}\n{edge}{}", red(mark));
    }
    if !rest.is_empty() {
        eprintln!("{rest}");
    }
}

fn exit_code(status: Status) -> u8 {
    match status {
        Status::Converged | Status::Completed => OK,
        Status::Interrupted => INTERRUPTED,
        Status::MaxIterations
        | Status::TimeLimit
        | Status::Stalled
        | Status::Infeasible
        | Status::Failed => NOT_CONVERGED,
    }
}

/// The name of a model file without its ending, for a folder: never one that leads out of the folder
/// above, as `..` does.
fn stem(model: &Path) -> String {
    match model.file_stem().map(|stem| stem.to_string_lossy()) {
        Some(stem) if !stem.trim_matches('.').is_empty() => stem.into_owned(),
        _ => "run".into(),
    }
}

/// A failure to write, as an input error about where the output should go.
fn unwritable(path: &Path, error: &io::Error) -> InputError {
    InputError::new(
        Place::Argument("--out".into()),
        "the results cannot be written",
    )
    .found(format!("{}: {error}", path.display()))
    .expected("a place that can be written to")
}

/// Says something beside the results.
fn say(kind: &str, what: impl Display) {
    eprintln!("{kind}: {}", harmless(&what.to_string()));
}

/// Prints results; a reader that has gone away (`| head`) is no error, a full disk ends the
/// program.
fn print(text: &str) {
    use io::Write;
    let mut out = io::stdout();
    match out
        .write_all(harmless(text).as_bytes())
        .and_then(|()| out.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            eprintln!("error: the output cannot be written: {error}");
            std::process::exit(BAD_INPUT.into());
        }
        _ => {}
    }
}
