//! Standard output and standard error: the only place that writes to them.
//!
//! A message that cannot be written is dropped, because there is no other place to report it and the results on disk
//! must not depend on it. A result that cannot be printed makes the program end with [`BAD_INPUT`](super::BAD_INPUT),
//! after its files are written; a reader that has closed the pipe (`| head`) is no error.

use super::source_snippet::Excerpt;
use super::{BAD_INPUT, OK};
use crate::error::InputError;
use crate::escape::harmless;
use console::style;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

static HAS_FAILED: AtomicBool = AtomicBool::new(false);

/// True if a result could not be printed.
pub fn has_failed() -> bool {
    HAS_FAILED.load(Ordering::Relaxed)
}

/// Prints results.
pub fn print(text: &str) {
    let write = || {
        let mut out = io::stdout().lock();
        out.write_all(harmless(text).as_bytes())?;
        out.flush()
    };
    let result: io::Result<()> = write();
    if let Err(error) = result
        && error.kind() != io::ErrorKind::BrokenPipe
        && !HAS_FAILED.swap(true, Ordering::Relaxed)
    {
        message(&format!("error: the output cannot be written: {error}"));
    }
}

/// Writes a message to standard error.
pub fn message(line: &str) {
    styled(&harmless(line));
}

/// A line of a kind, as `warning: ...`.
pub fn say(kind: &str, what: impl Display) {
    message(&format!("{kind}: {what}"));
}

/// Prints a numerical failure.
pub fn say_failed(reason: &str) {
    styled(&format!("{} {}", red("failed:"), harmless(reason)));
}

/// Prints an input error: its message and, below the first line, the line of the file. Coloured on a terminal unless
/// `NO_COLOR` is set.
pub fn complain(error: &InputError) {
    let message = error.to_string();
    let message = harmless(&message);
    let (headline, rest) = message.split_once('\n').unwrap_or((&message, ""));
    let mut text = format!("{} {headline}", red("error:"));
    if let Some(excerpt) = Excerpt::of(error) {
        let [blank, line, mark] = excerpt.lines();
        let (edge, mark) = mark.split_at(blank.len());
        text += &format!("\n{blank}\n{line}\n{edge}{}", red(mark));
    }
    if !rest.is_empty() {
        text += &format!("\n{rest}");
    }
    styled(&text);
}

/// Writes escaped lines, which may be coloured. A failure is ignored: it cannot be reported.
fn styled(text: &str) {
    let _ = io::stderr()
        .lock()
        .write_all(format!("{text}\n").as_bytes());
}

/// Prints help and version to standard output, usage errors to standard error. Returns the exit code.
pub fn print_usage(error: &clap::Error) -> u8 {
    let is_mistake = error.use_stderr();
    match error.print().and_then(|()| io::stdout().flush()) {
        Err(unwritable) if !is_mistake && unwritable.kind() != io::ErrorKind::BrokenPipe => {
            BAD_INPUT
        }
        _ if is_mistake => BAD_INPUT,
        _ => OK,
    }
}

fn red(text: &str) -> String {
    style(text).for_stderr().red().bold().to_string()
}
