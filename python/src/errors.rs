//! Failures of the library as exceptions of the package.

use kmcfit::error::{InputError, Location};
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Reason for which a call fails.
pub enum Failure {
    /// Invalid input.
    Input(InputError),
    /// No result, as a sentence.
    Numerical(String),
    /// A panic, with its message.
    Panic(String),
    /// An exception of a function that was called.
    Raised(PyErr),
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl Failure {
    /// A panic with the message of its payload.
    pub fn of_panic(payload: &(dyn Any + Send)) -> Self {
        let text = payload.downcast_ref::<&str>().map(ToString::to_string);
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        Self::Panic(text.unwrap_or_else(|| "a panic without a message".into()))
    }

    /// The exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        let made = py.import("kmcfit._errors").and_then(|errors| match self {
            Self::Input(error) => {
                let location = location(&error);
                let details = (
                    error.problem,
                    location,
                    error.found,
                    error.expected,
                    error.hint,
                );
                errors.getattr("InputError")?.call1(details)
            }
            Self::Numerical(text) => errors.getattr("NumericalError")?.call1((text,)),
            Self::Panic(text) => errors.getattr("InternalError")?.call1((text,)),
            Self::Raised(error) => Err(error),
        });
        made.map_or_else(|error| error, PyErr::from_value)
    }
}

/// Place of an error, with its key; a changed value by its key alone.
fn location(error: &InputError) -> String {
    let location = match &error.location {
        Location::Argument(name) if name.starts_with("--set ") && error.key.is_some() => {
            return error.key.clone().unwrap_or_default();
        }
        Location::Argument(name) => name.trim_start_matches("--").to_owned(),
        location => location.to_string(),
    };
    match &error.key {
        Some(key) => format!("{location}: {key}"),
        None => location,
    }
}

/// An error in a text that was made from arguments: its place is the key, which is an argument, and no line.
pub fn keyed(error: InputError, path: &Path) -> InputError {
    let is_of_text =
        matches!(&error.location, Location::Line { file, .. } | Location::File(file) if file == path);
    match error.key {
        Some(key) if is_of_text => InputError {
            location: Location::Argument(key),
            key: None,
            ..error
        },
        key => InputError { key, ..error },
    }
}

/// Does `work` without the interpreter; a panic becomes an exception.
pub fn guarded<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Failure> + Send,
) -> PyResult<T> {
    py.detach(|| caught(work))
        .map_err(|failure| failure.raise(py))
}

/// The result of `work`, with a panic as a failure.
pub fn caught<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| Err(Failure::of_panic(&*payload)))
}
