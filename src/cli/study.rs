//! `kmcfit study`: runs the analyses of a fit, or compares a sequence of models.

use super::compare::{open_analyses, run_sequence};
use super::fit::{read, search};
use super::progress::{self, Activity, Progress};
use super::{
    CommandError, NOT_CONVERGED, Overrides, announce, exit_code, inputs, interrupt, print, say,
    stem, unwritable,
};
use crate::config::{Model, ModelFile, Override, Sequence};
use crate::error::InputError;
use crate::report::study::{
    self, AnalysisFailure, Optimum, StudiedFit, StudyDocument, structural_rank,
};
use crate::report::{Run, json, rebuilt_fit};
use crate::results::{
    AnalysisJournal, CHECKPOINT, FIT_JOURNAL, FitJournal, Heading, OutputFolder, RESULT,
    RequestedFiles, STUDY_JOURNAL,
};
use crate::text_io::quote;
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{CheckpointStore, Status};
use kmcfit_core::internals::study::extremes::is_within_rounding;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    let mut model = read(file)?;
    can_be_studied(file, &model)?;
    model.check_study_memory()?;
    announce(&model);
    let flag = interrupt::flag();
    model.settings.interrupt = Some(Arc::clone(&flag));
    let heading = Heading::of_model("study", file, RequestedFiles::figures(), None);
    let claim = StudyDocument::claim()
        .journals(&[STUDY_JOURNAL, FIT_JOURNAL, CHECKPOINT])
        .inputs(inputs(file));
    let folder = OutputFolder::prepare(out, claim)?;
    let journal = open_analyses(&folder, STUDY_JOURNAL, &heading, is_resumed)?;
    let document = StudyDocument {
        format: 1,
        title: model.title.clone(),
        version: env!("CARGO_PKG_VERSION").into(),
        status: "interrupted".into(),
        confidence: model.study.confidence,
        seed: model.study.seed,
        structural_rank: structural_rank(&model.problem),
        ..StudyDocument::default()
    };
    let threads = model.threads_within_memory(threads);
    let mut work = StudyRun {
        model: Arc::new(model),
        folder: folder.path(),
        heading: Heading::of_model("study", file, RequestedFiles::default(), None),
        is_resumed,
        finished,
        journal,
        flag,
        threads,
        begun: 1,
        document,
    };
    let done = match work.run() {
        Ok(()) => true,
        Err(StudyError::Interrupted) => false,
        Err(StudyError::Disk(error)) => return Err(unwritable(folder.path(), &error).into()),
        Err(StudyError::Numerical(reason)) => return Err(CommandError::Numerical(reason)),
    };
    let mut document = work.document;
    if done {
        document.status = "complete".into();
    }
    let written = document
        .write(&folder, &work.model)
        .and_then(|()| work.journal.finish_if(done));
    written.map_err(|error| unwritable(folder.path(), &error))?;
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
    Ok(match (done, &document.fit) {
        (false, _) => interrupt::exit_code(),
        (true, Some(fit)) => exit_code(fit.status),
        (true, None) => NOT_CONVERGED,
    })
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

/// The model on the grid of a fit, with its width of Coulomb friction; `None` if it cannot be built.
fn on_grid_of(model: &Arc<Model>, fit: &StudiedFit) -> Option<Arc<Model>> {
    let system = &model.problem.system;
    let is_same_grid = fit.nodes == system.grid.nodes();
    if is_same_grid && fit.friction_width == system.friction_width() {
        return Some(Arc::clone(model));
    }
    let mut found = match is_same_grid {
        true => Model::clone(model),
        false => model.on_nodes(fit.nodes)?,
    };
    found.check_study_memory().ok()?;
    if let Some(width) = fit.friction_width {
        found = found.with_friction_width(width);
    }
    (found.problem.system.grid.nodes() == fit.nodes).then(|| Arc::new(found))
}

/// The journal of the fit within a study. A resumed study without one starts its fit over.
fn fit_journal(folder: &Path, heading: &Heading, is_resumed: bool) -> Option<FitJournal> {
    let before = is_resumed.then(|| FitJournal::resume(folder, heading));
    match before {
        Some(Ok(journal)) => Some(journal),
        _ => FitJournal::begin(folder, heading).ok(),
    }
}

/// Reason for which a study ends early.
enum StudyError {
    Interrupted,
    Disk(io::Error),
    Numerical(String),
}

impl From<io::Error> for StudyError {
    fn from(error: io::Error) -> Self {
        StudyError::Disk(error)
    }
}

/// A running study.
struct StudyRun<'a> {
    /// The model; after the fit on the grid of the fit.
    model: Arc<Model>,
    folder: &'a Path,
    /// Heading of the journal of the fit.
    heading: Heading,
    is_resumed: bool,
    /// The fit of a finished run.
    finished: Option<StudiedFit>,
    journal: AnalysisJournal,
    flag: Arc<AtomicBool>,
    threads: usize,
    /// Number of analyses begun, the fit included.
    begun: usize,
    document: StudyDocument,
}

impl StudyRun<'_> {
    /// All analyses, up to an interrupt.
    fn run(&mut self) -> Result<(), StudyError> {
        let (problem, theta, evaluation) = self.fit()?;
        let at = Optimum {
            problem: &problem,
            theta: &theta,
            evaluation: &evaluation,
        };
        self.at_the_optimum(at)?;
        self.further_fits(at)?;
        self.extremes(at)
    }

    /// Analyses of the linearised fit, profiles, candidate experiments and equivalent systems.
    fn at_the_optimum(&mut self, at: Optimum) -> Result<(), StudyError> {
        let model = Arc::clone(&self.model);
        let plan = &model.study;
        self.document.sensitivity = Some(self.analysis("sensitivity", || study::sensitivity(at))?);
        let bands = || study::bands(at, &model);
        self.document.bands = Some(self.analysis("bands", bands)?);
        for target in &plan.profiles {
            let Some(of) = study::linear(at.problem, target) else {
                continue;
            };
            let profile = || study::profile_of(at, &of, &model);
            let name = format!("profile of {}", of.name);
            let found = self.analysis(&name, profile)?;
            let found = self.or_fail(&name, found);
            self.document.profiles.extend(found);
        }
        if !plan.candidates.is_empty() {
            let candidates = || study::candidates(at, &plan.candidates);
            self.document.candidates = self.analysis("candidates", candidates)?;
        }
        let equivalent = || study::equivalent(at, &plan.equivalent_systems);
        self.document.equivalent_systems = self.analysis("equivalent systems", equivalent)?;
        Ok(())
    }

    /// Further fits: from random starting points, with constant functions, of resampled records.
    fn further_fits(&mut self, at: Optimum) -> Result<(), StudyError> {
        let (model, threads) = (Arc::clone(&self.model), self.threads);
        let plan = &model.study;
        if plan.starts > 0 {
            let starts = || study::starts(&model, at, threads);
            self.document.multistart = Some(self.analysis("starts", starts)?);
        }
        if plan.constancy_test {
            let test = || study::constancy_test(at, plan, threads);
            let found = self.analysis("constancy test", test)?;
            let found = self.or_fail("constancy test", found);
            self.document.constancy_test = found.unwrap_or_default();
        }
        if plan.replicates > 0 {
            let found = self.analysis("bootstrap", || study::refits(at, plan, threads))?;
            let mut found = self.or_fail("bootstrap", found).unwrap_or_default();
            for interval in &mut found {
                interval.unit = model.converted_unit(&interval.unit).to_owned();
            }
            self.document.bootstrap = found;
        }
        Ok(())
    }

    /// Extremes of the functions, and the predictions of the systems that have them.
    fn extremes(&mut self, at: Optimum) -> Result<(), StudyError> {
        let (model, threads) = (Arc::clone(&self.model), self.threads);
        if model.study.misfit_limit.is_none() && is_within_rounding(at.problem, at.evaluation) {
            let reason = "the samples are matched to machine precision and a penalty determines every function: without a stated \
                 `study.misfit_limit` the ranges are rounding errors";
            self.fail("extremes", reason);
            return Ok(());
        }
        let compute = || study::extremes(&model, at, threads);
        let (extremes, predictions) = self.analysis("extremes", compute)?;
        if extremes.is_empty() {
            let reason = "the optimum violates the misfit limit or the constraints";
            self.fail("extremes", reason);
        }
        self.document.extremes = extremes;
        self.document.roughness_limited = !at.problem.penalties.is_empty();
        self.document.predictions = predictions;
        Ok(())
    }

    /// Result of one analysis, from the journal or computed. The result of an interrupted analysis is discarded.
    fn analysis<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        compute: impl FnOnce() -> T,
    ) -> Result<T, StudyError> {
        let flag = Arc::clone(&self.flag);
        let whole = || !flag.load(Ordering::Relaxed);
        if !whole() {
            return Err(StudyError::Interrupted);
        }
        self.begun += 1;
        let stage = format!(
            "study {}/{}: {name}",
            self.begun,
            self.model.study.analyses()
        );
        let activity = Activity::begin(stage);
        progress::forget_jobs();
        let found = self.journal.analysis(name, compute, whole)?;
        drop(activity);
        if found.is_none() {
            let done = progress::jobs().map(|[done, all]| format!(" after {done} of {all} jobs"));
            let reason = format!(
                "interrupted{}; none of its results is used, and `kmcfit resume` begins it again",
                done.unwrap_or_default()
            );
            self.fail(name, &reason);
        }
        found.ok_or(StudyError::Interrupted)
    }

    /// The result of an analysis; its failure is noted in the document.
    fn or_fail<T>(&mut self, what: &str, found: Result<T, String>) -> Option<T> {
        found.map_err(|reason| self.fail(what, &reason)).ok()
    }

    fn fail(&mut self, what: &str, reason: &str) {
        self.document.failures.push(AnalysisFailure {
            analysis: what.to_owned(),
            reason: reason.to_owned(),
        });
    }

    /// The fit, from the journal or computed.
    fn fit(&mut self) -> Result<(Problem, Vec<f64>, Evaluation), StudyError> {
        let model = Arc::clone(&self.model);
        let shown = format!("study 1/{}: fit", model.study.analyses());
        let progress = Progress::new(&model.settings.stopping).named(&shown);
        let (folder, heading, is_resumed) = (self.folder, &self.heading, self.is_resumed);
        let flag = Arc::clone(&self.flag);
        let finished = self.finished.take();
        let mut interrupted = None;
        let compute = || {
            if let Some(finished) = finished {
                return Ok(finished);
            }
            let mut journal = fit_journal(folder, heading, is_resumed);
            let journal = journal.as_mut().map(|j| j as &mut dyn CheckpointStore);
            let (fitted, _, found) = search(&model, &progress, journal)?;
            let fit = StudiedFit::of(&fitted, &found);
            interrupted = Some(fit.clone());
            Ok::<_, String>(fit)
        };
        let whole = || !flag.load(Ordering::Relaxed);
        let is_right = |kept: &Result<StudiedFit, String>| match kept {
            Ok(fit) => on_grid_of(&model, fit).is_some_and(|model| fit.is_of(&model.problem)),
            Err(_) => true,
        };
        self.journal.forget_unless("fit", is_right);
        let fitted = self.journal.analysis("fit", compute, whole)?;
        let Some(fitted) = fitted else {
            // The document has the best point; the journal of the fit has its checkpoint.
            self.document.fit = interrupted;
            return Err(StudyError::Interrupted);
        };
        let fit = fitted.map_err(StudyError::Numerical)?;
        FitJournal::clear(folder)?;
        let interrupted = fit.status == Status::Interrupted;
        let model = on_grid_of(&model, &fit);
        let model = model.ok_or_else(|| {
            StudyError::Numerical("the grid of the fit does not fit into memory".into())
        })?;
        let problem = fit.problem(&model.problem);
        self.threads = model.threads_within_memory(self.threads);
        self.model = model;
        let theta = fit.parameters.clone();
        self.document.fit = Some(fit);
        let evaluation = problem
            .evaluate(&theta)
            .map_err(|breakdown| StudyError::Numerical(breakdown.to_string()))?;
        match interrupted {
            true => Err(StudyError::Interrupted),
            false => Ok((problem, theta, evaluation)),
        }
    }
}
