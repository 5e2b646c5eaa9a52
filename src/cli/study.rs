//! `kmcfit study`: runs the analyses of a fit.

use super::fit::read;
use super::study_run::StudyRun;
use super::{
    CommandError, NOT_CONVERGED, Overrides, announce, exit_code, inputs, interrupt, print, stem,
};
use crate::config::{BuildMode, Model, ModelFile, build};
use crate::error::InputError;
use crate::report::study::{StudiedFit, StudyDocument};
use crate::report::{Run, json};
use crate::results::OutputFolder;
use kmcfit_core::problem::Problem;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Analyse what the records determine: profiles, extremes, equivalent systems, next experiments.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit study model.yaml --threads 4")]
pub struct Arguments {
    /// Model file (YAML), or the folder of a finished run, whose fit is studied.
    model: PathBuf,
    /// Folder for the results [default: runs/NAME-study].
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: Overrides,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Number of threads; results do not depend on it [default: one per core].
    #[arg(long)]
    threads: Option<usize>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let threads = threads(arguments.threads)?;
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-study", stem(&arguments.model))));
    let file = match arguments.model.is_dir() {
        true => {
            let run = Run::open(&arguments.model)?;
            let file = run.model_file()?;
            super::note_changes(&run);
            file.with_overrides(&arguments.set.parse()?)?
        }
        false => arguments.set.read(&arguments.model)?,
    };
    run_in(&file, &out, arguments.json, threads)
}

pub(super) fn threads(asked: Option<usize>) -> Result<usize, InputError> {
    match asked {
        Some(0) => Err(
            InputError::argument("--threads", "invalid number of threads")
                .found(0)
                .expected("1 or more"),
        ),
        Some(threads) => Ok(threads),
        None => Ok(std::thread::available_parallelism().map_or(1, usize::from)),
    }
}

fn run_in(file: &ModelFile, out: &Path, as_json: bool, threads: usize) -> Result<u8, CommandError> {
    let model = checked(file, read(file)?)?;
    announce(&model);
    let document = studied(out, (file, model), threads, None, interrupt::flag())?;
    match as_json {
        true => print(&json(&document)),
        false => {
            print(&document.text());
            print(&format!("\nPage   {}\n", out.join("study.html").display()));
        }
    }
    Ok(match (document.is_complete(), &document.fit) {
        (false, _) => interrupt::exit_code(),
        (true, Some(fit)) => exit_code(fit.status),
        (true, None) => NOT_CONVERGED,
    })
}

/// Studies a model and writes the results into a folder, without output on the terminal; starts from the fit `finished`, or fits first.
/// `flag` ends the study.
///
/// # Errors
/// If the model cannot be studied, the folder cannot be used, or the fit has no response.
pub fn study_into(
    out: &Path,
    file: &ModelFile,
    threads: Option<usize>,
    finished: Option<(StudiedFit, Problem)>,
    flag: Arc<AtomicBool>,
) -> Result<StudyDocument, CommandError> {
    let threads = self::threads(threads)?;
    let model = checked(file, build(file, BuildMode::Fit)?)?;
    studied(out, (file, model), threads, finished, flag)
}

fn studied(
    out: &Path,
    (file, model): (&ModelFile, Model),
    threads: usize,
    finished: Option<(StudiedFit, Problem)>,
    flag: Arc<AtomicBool>,
) -> Result<StudyDocument, CommandError> {
    let folder = OutputFolder::prepare(out, "study", inputs(file))?;
    StudyRun::new(model, threads, finished, flag).write(file, &folder)
}

/// The model, if its fit simulates a response and has parameters.
fn checked(file: &ModelFile, model: Model) -> Result<Model, InputError> {
    use kmcfit_core::solvers::Solver;
    match model.settings.solver {
        Solver::EquationError => Err(file
            .error_at(
                "fit.method",
                "`study` needs a fit of the simulated response",
            )
            .found("`equation-error`")
            .expected("another method")),
        _ if model.problem.parameters() == 0 => Err(file
            .error_at("functions", "nothing to study: every function is fixed")
            .expected("at least one function with a basis")),
        _ => Ok(model),
    }
}
