//! Errors in command-line arguments, with more detail than clap gives.

use crate::error::InputError;
use crate::spelling::nearest;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error;
use std::num::{ParseFloatError, ParseIntError};

/// The error of an argument that is not a number; `None` for any other error.
pub fn no_number(error: &clap::Error) -> Option<InputError> {
    if error.kind() != ErrorKind::ValueValidation {
        return None;
    }
    let source = error.source()?;
    let expected = match () {
        () if source.is::<ParseFloatError>() => "a number",
        () if source.is::<ParseIntError>() => "a whole number, 0 or greater",
        () => return None,
    };
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let argument = text(ContextKind::InvalidArg)?;
    let name = argument.split(' ').next().unwrap_or(&argument);
    let found = text(ContextKind::InvalidValue)?;
    let error = InputError::argument(name, "not a number");
    Some(error.found(format!("`{found}`")).expected(expected))
}

/// The error with the most similar command as a suggestion.
pub fn with_near_command(mut error: clap::Error, program: &clap::Command) -> clap::Error {
    if let (ErrorKind::InvalidSubcommand, None, Some(ContextValue::String(word))) = (
        error.kind(),
        error.get(ContextKind::SuggestedSubcommand),
        error.get(ContextKind::InvalidSubcommand),
    ) {
        let names = program.get_subcommands().map(clap::Command::get_name);
        if let Some(near) = nearest(word, names) {
            let near = ContextValue::Strings(vec![near.to_owned()]);
            error.insert(ContextKind::SuggestedSubcommand, near);
        }
    }
    error
}
