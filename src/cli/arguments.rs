//! Errors in command-line arguments, in the form of all other input errors.

use crate::error::InputError;
use crate::spelling::{did_you_mean, number_in};
use crate::text_io::{one_of, quote};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error;
use std::num::{ParseFloatError, ParseIntError};

/// The error of invalid arguments; `None` for a request for help or the version, and for an error without details.
///
/// `command` is the word behind the name of the program, which may be a command.
pub fn input_error(
    error: &clap::Error,
    program: &clap::Command,
    command: Option<&str>,
) -> Option<InputError> {
    let context = Context {
        error,
        command: program
            .get_subcommands()
            .find(|known| Some(known.get_name()) == command)
            .unwrap_or(program),
    };
    match error.kind() {
        ErrorKind::InvalidSubcommand => context.unknown_command(program),
        ErrorKind::UnknownArgument => context.unknown_argument(),
        ErrorKind::MissingRequiredArgument => context.missing(),
        ErrorKind::InvalidValue => context.invalid_value(),
        ErrorKind::ValueValidation => context.not_a_number(),
        ErrorKind::ArgumentConflict => context.conflict(),
        _ => None,
    }
}

/// An error and the command in which it occurred.
struct Context<'a> {
    error: &'a clap::Error,
    command: &'a clap::Command,
}

impl Context<'_> {
    fn text(&self, kind: ContextKind) -> Option<String> {
        match self.error.get(kind)? {
            ContextValue::String(text) => Some(text.clone()),
            ContextValue::Strings(texts) => Some(texts.join(", ")),
            _ => None,
        }
    }

    /// The name of the invalid argument without its value: `--nodes` of `--nodes <N>`.
    fn argument(&self) -> Option<String> {
        let argument = self.text(ContextKind::InvalidArg)?;
        Some(argument.split(' ').next().unwrap_or(&argument).to_owned())
    }

    fn name(&self) -> String {
        match self.command.get_name() {
            "kmcfit" => "kmcfit".to_owned(),
            name => format!("kmcfit {name}"),
        }
    }

    fn help(&self) -> String {
        format!("`{} --help` lists the arguments", self.name())
    }

    /// The names of the options: `--out`, `--set`, …
    fn options(&self) -> Vec<String> {
        (self.command.get_arguments())
            .filter_map(|argument| Some(format!("--{}", argument.get_long()?)))
            .collect()
    }

    fn unknown_command(&self, program: &clap::Command) -> Option<InputError> {
        let word = self.text(ContextKind::InvalidSubcommand)?;
        let names: Vec<&str> = (program.get_subcommands().map(clap::Command::get_name)).collect();
        Some(
            InputError::argument("kmcfit", "unknown command")
                .found(quote(&word))
                .expected(one_of(names.iter().copied()))
                .hint_if(did_you_mean(&word, names)),
        )
    }

    fn unknown_argument(&self) -> Option<InputError> {
        let found = self.text(ContextKind::InvalidArg)?;
        let error = InputError::argument(self.name(), "unknown argument").found(quote(&found));
        let options = self.options();
        if !found.starts_with('-') || options.is_empty() {
            return Some(error.expected(self.usage()).hint(self.help()));
        }
        let names = || options.iter().map(String::as_str);
        Some(
            error
                .expected(one_of(names()))
                .hint_if(did_you_mean(&found, names())),
        )
    }

    fn missing(&self) -> Option<InputError> {
        let missing = self.text(ContextKind::InvalidArg)?;
        Some(
            InputError::argument(self.name(), format!("{missing} is missing"))
                .expected(self.usage())
                .hint(self.help()),
        )
    }

    /// The arguments of the command: `kmcfit fit [OPTIONS] <MODEL>`.
    fn usage(&self) -> String {
        let usage = self.command.clone().render_usage().to_string();
        let arguments = usage.trim().trim_start_matches("Usage: ");
        match arguments.starts_with("kmcfit") {
            true => arguments.to_owned(),
            false => format!("kmcfit {arguments}"),
        }
    }

    fn invalid_value(&self) -> Option<InputError> {
        let name = self.argument()?;
        let found = self.text(ContextKind::InvalidValue).unwrap_or_default();
        let error = InputError::argument(&name, "invalid value");
        if found.is_empty() {
            return Some(
                InputError::argument(&name, "the value is missing")
                    .expected(self.text(ContextKind::InvalidArg)?),
            );
        }
        let error = error.found(quote(&found));
        Some(match self.error.get(ContextKind::ValidValue) {
            Some(ContextValue::Strings(valid)) => {
                let valid = || valid.iter().map(String::as_str);
                error
                    .expected(one_of(valid()))
                    .hint_if(did_you_mean(&found, valid()))
            }
            _ => error.expected(self.help()),
        })
    }

    fn not_a_number(&self) -> Option<InputError> {
        let name = self.argument()?;
        let found = self.text(ContextKind::InvalidValue)?;
        let source = self.error.source()?;
        let error = |problem, expected: &str| {
            InputError::argument(&name, problem)
                .found(quote(&found))
                .expected(expected)
        };
        Some(match () {
            () if source.is::<ParseFloatError>() => {
                error("not a number", "a number").hint_if(number_in(&found))
            }
            () if source.is::<ParseIntError>() => {
                let least = match &*name {
                    "--nodes" => 3,
                    "--threads" => 1,
                    _ => 0,
                };
                error("not a number", &format!("an integer, {least} or more"))
            }
            () => error("invalid value", &source.to_string()),
        })
    }

    fn conflict(&self) -> Option<InputError> {
        let name = self.argument()?;
        let other = self.text(ContextKind::PriorArg)?;
        Some(match other.split(' ').next() {
            Some(other) if other == name => InputError::argument(&name, "given more than once")
                .expected("this argument at most once"),
            _ => InputError::argument(&name, format!("cannot be combined with `{other}`"))
                .expected("one of the two"),
        })
    }
}
