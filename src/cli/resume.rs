//! `kmcfit resume`: continues an interrupted fit, study or comparison from its journal.

use super::fit::{self, PlotOptions, Printed};
use super::{CommandError, INTERRUPTED, compare, say, study};
use crate::error::InputError;
use crate::report::Run;
use crate::results::{self, COMPARE_JOURNAL, FitJournal, STUDY_JOURNAL};
use kmcfit_core::internals::solvers::Status;
use std::path::PathBuf;

/// Resume an interrupted fit, study or comparison; the results are those of an uninterrupted run.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit resume runs/model")]
pub struct Arguments {
    /// Folder of the run.
    folder: PathBuf,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Print all findings, the fit of each channel and the work of the solver.
    #[arg(long, conflicts_with = "json")]
    verbose: bool,
    /// Exit with 4 for the verdict Check of a fit, with 5 for Inadequate.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    plots: PlotOptions,
    /// Number of threads of a study; results do not depend on it [default: one per core].
    #[arg(long)]
    threads: Option<usize>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let folder = &arguments.folder;
    if !folder.is_dir() {
        return Err(InputError::file(folder, "no such folder")
            .expected("the folder of an unfinished fit, study or comparison")
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
        plots: arguments.plots,
        verbose: arguments.verbose,
        strict: arguments.strict,
    };
    if let Some(heading) = FitJournal::heading(folder)? {
        return fit::resume(folder, &heading, &printed);
    }
    finished(arguments, &printed)
}

/// Prints the results of a finished run.
fn finished(arguments: &Arguments, printed: &Printed) -> Result<u8, CommandError> {
    let folder = &arguments.folder;
    if !folder.join("result.json").exists() {
        return Err(InputError::file(folder, "no unfinished run in this folder")
            .expected("the folder of an unfinished fit, study or comparison")
            .into());
    }
    let run = Run::open(folder)?;
    say("note", "this run is finished; nothing to resume");
    fit::print_results(&run.document, folder, printed);
    Ok(match run.document.outcome.status {
        Status::Interrupted => INTERRUPTED,
        _ => fit::code(&run.document, printed),
    })
}
