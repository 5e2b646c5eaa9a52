//! `kmcfit study`: runs the analyses of a fit, or compares a sequence of models.

use super::compare::run_sequence;
use super::fit::read;
use super::study_run::StudyTask;
use super::{
    CommandError, NOT_CONVERGED, Overrides, announce, exit_code, inputs, interrupt, print, say,
    stem,
};
use crate::config::{BuildMode, Model, ModelFile, Override, Sequence, build};
use crate::error::InputError;
use crate::report::study::{StudiedFit, StudyDocument};
use crate::report::{Run, json, rebuilt_fit};
use crate::results::{
    AnalysisJournal, CHECKPOINT, FIT_JOURNAL, Heading, OutputFolder, RESULT, STUDY_JOURNAL,
};
use crate::text_io::quote;
use kmcfit_core::internals::solvers::Status;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Analyse what the records determine: profiles, extremes, equivalent systems, next experiments.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit study model.yaml --threads 4")]
pub struct Arguments {
    /// Model file or sequence (YAML), or the folder of a finished run, whose fit is studied.
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
    if arguments.model.is_dir() {
        let run = Run::open(&arguments.model)?;
        let mut overrides = Override::parse_all(&run.document.model.overrides)?;
        let further = arguments.set.parse()?;
        // Other values give another fit.
        let finished = further.is_empty().then(|| finished_fit(&run)).flatten();
        overrides.extend(further);
        let model = Path::new(&run.document.model.file);
        if !model.exists() {
            let result = arguments.model.join(RESULT);
            return Err(InputError::file(result, "the model file of this run was not found")
                .key("model.file")
                .found(format!("{}, relative to the current folder", quote(&run.document.model.file)))
                .expected("the model file that was fitted")
                .hint("run this command in the folder in which the fit was started, or give the model file")
                .into());
        }
        let file = ModelFile::read_with_overrides(model, &overrides)?;
        return run_in(&file, &out, arguments.json, threads, finished, false);
    }
    match Sequence::read(&arguments.model)? {
        Some(sequence) => {
            arguments.set.refuse("a sequence")?;
            run_sequence(&arguments.model, &sequence, &out, arguments.json, false)
        }
        None => {
            let file = arguments.set.read(&arguments.model)?;
            run_in(&file, &out, arguments.json, threads, None, false)
        }
    }
}

/// Resumes an unfinished study or sequence.
pub(super) fn resume(
    folder: &Path,
    as_json: bool,
    asked: Option<usize>,
) -> Result<u8, CommandError> {
    let threads = threads(asked)?;
    let Heading {
        inputs, overrides, ..
    } = AnalysisJournal::heading(folder, STUDY_JOURNAL)?;
    let model = inputs.into_iter().next().unwrap_or_default();
    match Sequence::read(&model)? {
        Some(sequence) => run_sequence(&model, &sequence, folder, as_json, true),
        None => {
            let file = ModelFile::read_with_overrides(&model, &Override::parse_all(&overrides)?)?;
            run_in(&file, folder, as_json, threads, None, true)
        }
    }
}

fn threads(asked: Option<usize>) -> Result<usize, InputError> {
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

fn run_in(
    file: &ModelFile,
    out: &Path,
    as_json: bool,
    threads: usize,
    finished: Option<StudiedFit>,
    is_resumed: bool,
) -> Result<u8, CommandError> {
    let model = checked(file, read(file)?)?;
    announce(&model);
    let folder = prepare(file, out)?;
    let plan = StudyTask {
        file,
        model,
        threads,
        finished,
        is_resumed,
        flag: interrupt::flag(),
    };
    let document = plan.run(&folder)?;
    match as_json {
        true => print(&json(&document)),
        false => {
            print(&document.text());
            print(&format!(
                "\nPage   {}\n",
                folder.path().join("study.html").display()
            ));
        }
    }
    Ok(match (document.is_complete(), &document.fit) {
        (false, _) => interrupt::exit_code(),
        (true, Some(fit)) => exit_code(fit.status),
        (true, None) => NOT_CONVERGED,
    })
}

/// Prepares the folder of a study.
fn prepare(file: &ModelFile, out: &Path) -> Result<OutputFolder, InputError> {
    let claim = StudyDocument::claim()
        .journals(&[STUDY_JOURNAL, FIT_JOURNAL, CHECKPOINT])
        .inputs(inputs(file));
    OutputFolder::prepare(out, claim)
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
    finished: Option<StudiedFit>,
    flag: Arc<AtomicBool>,
) -> Result<StudyDocument, CommandError> {
    let threads = self::threads(threads)?;
    let model = checked(file, build(file, BuildMode::Fit)?)?;
    let folder = prepare(file, out)?;
    let plan = StudyTask {
        file,
        model,
        threads,
        finished,
        is_resumed: false,
        flag,
    };
    plan.run(&folder)
}

/// A model that can be studied, within the memory.
fn checked(file: &ModelFile, model: Model) -> Result<Model, InputError> {
    can_be_studied(file, &model)?;
    model.check_study_memory()?;
    Ok(model)
}

/// The fit of a finished run; `None` where it cannot be rebuilt, is not at its end, or has no parameters: then the model is fitted again.
fn finished_fit(run: &Run) -> Option<StudiedFit> {
    let is_at_end = run.document.outcome.status == Status::Converged;
    let (model, fit) = is_at_end.then(|| rebuilt_fit(run).ok()).flatten()?;
    say("note", "starting from the fit of this run");
    Some(StudiedFit::of(&model, &fit))
}

/// Checks that the fit simulates a response and has parameters.
fn can_be_studied(file: &ModelFile, model: &Model) -> Result<(), InputError> {
    use kmcfit_core::internals::solvers::Solver;
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
        _ => Ok(()),
    }
}
