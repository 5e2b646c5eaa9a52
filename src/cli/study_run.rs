//! The analyses of a study in their order, each from the journal or computed.

use super::compare::open_analyses;
use super::fit::search;
use super::output::message;
use super::progress::{self, Activity, Progress};
use super::{CommandError, unwritable};
use crate::config::{Model, ModelFile};
use crate::report::study::{
    self, AnalysisFailure, COMPLETE, Optimum, StudiedFit, StudyDocument, structural_rank,
};
use crate::results::{
    AnalysisJournal, FitJournal, Heading, OutputFolder, RequestedFiles, STUDY_JOURNAL,
};
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{CheckpointStore, Status};
use kmcfit_core::internals::study::extremes::is_within_rounding;
use kmcfit_core::internals::threads::interruptible;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// Most findings of a part that are shown before the end.
const FIRST_FINDINGS: usize = 3;

/// A study that is to be run.
pub(super) struct StudyTask<'a> {
    pub file: &'a ModelFile,
    pub model: Model,
    /// Number of threads, at least 1.
    pub threads: usize,
    /// The fit, if the model was fitted before.
    pub finished: Option<StudiedFit>,
    pub is_resumed: bool,
    /// Ends the study.
    pub flag: Arc<AtomicBool>,
}

impl StudyTask<'_> {
    /// Runs the study and writes its results; interrupted, those of the finished analyses.
    pub fn run(self, folder: &OutputFolder) -> Result<StudyDocument, CommandError> {
        let mut model = self.model;
        model.settings.interrupt = Some(Arc::clone(&self.flag));
        let heading = Heading::of_model("study", self.file, RequestedFiles::figures(), None);
        let journal = open_analyses(folder, STUDY_JOURNAL, &heading, self.is_resumed)?;
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
        show_findings(&document, "structural-rank");
        let threads = model.threads_within_memory(self.threads);
        let mut work = StudyRun {
            model: Arc::new(model),
            folder: folder.path(),
            heading: Heading::of_model("study", self.file, RequestedFiles::default(), None),
            is_resumed: self.is_resumed,
            finished: self.finished,
            journal,
            flag: self.flag,
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
            document.status = COMPLETE.into();
        }
        let written = document
            .write(folder, &work.model)
            .and_then(|()| work.journal.finish_if(done));
        written.map_err(|error| unwritable(folder.path(), &error))?;
        Ok(document)
    }
}

/// The first findings of a part of a study while the others are computed, on standard error where that is a terminal.
fn show_findings(document: &StudyDocument, part: &str) {
    if io::stderr().is_terminal() {
        let findings = document.findings().into_iter();
        let own = findings.filter(|(of, _)| *of == part).take(FIRST_FINDINGS);
        own.for_each(|(of, sentence)| message(&format!("{of}: {sentence}")));
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
        show_findings(&self.document, "sensitivity");
        let bands = || study::bands(at, &model);
        self.document.bands = Some(self.analysis("bands", bands)?);
        show_findings(&self.document, "bands");
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
        let work = || interruptible(&flag, compute);
        let found = self.journal.analysis(name, work, whole)?;
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
