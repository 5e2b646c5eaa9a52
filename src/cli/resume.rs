//! `kmcfit resume`

use super::fit::{self, Printed};
use super::{Failure, INTERRUPTED, compare, exit_code, say, study};
use crate::error::InputError;
use crate::report::Run;
use crate::results::{self, COMPARE_JOURNAL, FitJournal, STUDY_JOURNAL};
use kmcfit_core::internals::solvers::Status;
use std::path::PathBuf;

/// Go on with a fit, study or comparison that was killed or interrupted, to the same bits.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Its folder.
    folder: PathBuf,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Draw readings, fit and functions of a fit in the terminal.
    #[arg(long, conflicts_with = "json")]
    plot: bool,
    /// Threads of a study; the results do not depend on them [default: one per core].
    #[arg(long)]
    threads: Option<usize>,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let folder = &arguments.folder;
    if !folder.is_dir() {
        return Err(InputError::file(folder, "there is no such folder")
            .expected("the folder of a fit, study or comparison that did not come to its end")
            .into());
    }
    results::complete(folder)?;
    if folder.join(STUDY_JOURNAL).exists() {
        return study::resume(folder, arguments.json, arguments.threads);
    }
    if folder.join(COMPARE_JOURNAL).exists() {
        return compare::resume(folder, arguments.json);
    }
    let printed = Printed {
        json: arguments.json,
        timings: false,
        plot: arguments.plot,
    };
    if let Some(heading) = FitJournal::heading(folder)? {
        return fit::go_on(folder, &heading, &printed);
    }
    finished(arguments, &printed)
}

/// What was finished before is told again.
fn finished(arguments: &Arguments, printed: &Printed) -> Result<u8, Failure> {
    let folder = &arguments.folder;
    if !folder.join("result.json").exists() {
        return Err(
            InputError::file(folder, "there is nothing to go on with in this folder")
                .expected("the folder of a fit, study or comparison that did not come to its end")
                .into(),
        );
    }
    let run = Run::open(folder)?;
    say(
        "note",
        "nothing is left to do: this run had come to its end",
    );
    fit::tell(&run.document, folder, printed);
    Ok(match run.document.outcome.status {
        Status::Interrupted => INTERRUPTED,
        status => exit_code(status),
    })
}
