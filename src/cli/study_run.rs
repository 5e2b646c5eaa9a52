//! The analyses of a study in their order.

use super::fit::search;
use super::progress::{Activity, Progress};
use super::{CommandError, unwritable};
use crate::config::{Model, ModelFile};
use crate::report::study::{
    self, AnalysisFailure, COMPLETE, Optimum, StudiedFit, StudyDocument, structural_rank,
};
use crate::results::OutputFolder;
use kmcfit_core::objective::Evaluation;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::Status;
use kmcfit_core::study::is_within_rounding;
use kmcfit_core::threads::interruptible;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The model on the grid of a fit; `None` if it cannot be built.
fn on_grid_of(model: &Arc<Model>, fit: &StudiedFit) -> Option<Arc<Model>> {
    let system = &model.problem.system;
    let is_same_grid = fit.nodes == system.grid.nodes();
    if is_same_grid {
        return Some(Arc::clone(model));
    }
    let found = model.on_nodes(fit.nodes)?;
    (found.problem.system.grid.nodes() == fit.nodes).then(|| Arc::new(found))
}

/// Reason for which a study ends early.
enum StudyError {
    Interrupted,
    Numerical(String),
}

/// A study: its analyses write into one document.
pub(super) struct StudyRun {
    /// The model; after the fit on the grid of the fit.
    model: Arc<Model>,
    /// The fit of a finished run, with its problem.
    finished: Option<(StudiedFit, Problem)>,
    /// The problem as fitted, with the noise of the fit.
    fitted: Option<Problem>,
    flag: Arc<AtomicBool>,
    threads: usize,
    /// Number of analyses begun, the fit included.
    begun: usize,
    document: StudyDocument,
}

impl StudyRun {
    /// A study with at most `threads` threads that ends early if `flag` is set. A finished fit is not repeated.
    pub fn new(
        mut model: Model,
        threads: usize,
        finished: Option<(StudiedFit, Problem)>,
        flag: Arc<AtomicBool>,
    ) -> Self {
        model.settings.interrupt = Some(Arc::clone(&flag));
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
        Self {
            model: Arc::new(model),
            finished,
            fitted: None,
            flag,
            threads,
            begun: 1,
            document,
        }
    }

    /// Runs all analyses and writes the study, complete or not, into the folder.
    pub fn write(
        mut self,
        file: &ModelFile,
        folder: &OutputFolder,
    ) -> Result<StudyDocument, CommandError> {
        match self.run() {
            Ok(()) => self.document.status = COMPLETE.into(),
            Err(StudyError::Interrupted) => {}
            Err(StudyError::Numerical(reason)) => return Err(CommandError::Numerical(reason)),
        }
        file.read_files().check()?;
        let written = self.document.write(folder, &self.model);
        written.map_err(|error| unwritable(folder.shown(), &error))?;
        Ok(self.document)
    }

    /// All analyses, up to an interrupt.
    fn run(&mut self) -> Result<(), StudyError> {
        let (problem, theta, evaluation) = self.fit()?;
        let at = Optimum {
            problem: &problem,
            theta: &theta,
            evaluation: &evaluation,
        };
        self.at_the_optimum(at)?;
        self.extremes(at)
    }

    /// Analyses of the linearised fit, profiles, candidate experiments, equivalent systems, and fits from random starting points.
    fn at_the_optimum(&mut self, at: Optimum) -> Result<(), StudyError> {
        let (model, threads) = (Arc::clone(&self.model), self.threads);
        let plan = &model.study;
        self.document.sensitivity = Some(self.analysis("sensitivity", || study::sensitivity(at))?);
        // The intervals of the fit are those with its correlation of the noise.
        let fitted = self.fitted.take().and_then(|problem| {
            let evaluation = problem.evaluate(at.theta).ok()?;
            Some((problem, evaluation))
        });
        let of_fit = fitted.as_ref().map_or(at, |(problem, evaluation)| Optimum {
            problem,
            evaluation,
            ..at
        });
        let bands = || study::bands(of_fit, &model);
        self.document.bands = Some(self.analysis("bands", bands)?);
        for target in &plan.profiles {
            let Some(of) = target.at(at.problem, at.theta) else {
                continue;
            };
            let profile = || study::profile_of(at, target, &model);
            let name = format!("profile of {}", of.name);
            match self.analysis(&name, profile)? {
                Ok(found) => self.document.profiles.push(found),
                Err(reason) => self.fail(&name, &reason),
            }
        }
        if !plan.candidates.is_empty() {
            let candidates = || study::candidates(at, &plan.candidates);
            self.document.candidates = self.analysis("candidates", candidates)?;
        }
        let equivalent = || study::equivalent(at, &plan.equivalent_systems);
        self.document.equivalent_systems = self.analysis("equivalent systems", equivalent)?;
        if plan.starts > 0 {
            let starts = || study::starts(&model, at, threads);
            self.document.multistart = Some(self.analysis("starts", starts)?);
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

    /// Result of one analysis. The result of an interrupted analysis is discarded.
    fn analysis<T>(&mut self, name: &str, compute: impl FnOnce() -> T) -> Result<T, StudyError> {
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
        let found = interruptible(&flag, compute);
        drop(activity);
        if !whole() {
            self.fail(name, "interrupted; none of its results is used");
            return Err(StudyError::Interrupted);
        }
        Ok(found)
    }

    fn fail(&mut self, what: &str, reason: &str) {
        self.document.failures.push(AnalysisFailure {
            analysis: what.to_owned(),
            reason: reason.to_owned(),
        });
    }

    /// The fit.
    fn fit(&mut self) -> Result<(Problem, Vec<f64>, Evaluation), StudyError> {
        let mut model = Arc::clone(&self.model);
        let shown = format!("study 1/{}: fit", model.study.analyses());
        let progress = Progress::new(&shown);
        let fit = match self.finished.take() {
            Some((finished, problem)) => {
                self.fitted = Some(problem);
                finished
            }
            None => {
                let found = search(&model, &progress).map_err(StudyError::Numerical)?;
                let fit = StudiedFit::of(&found.model, &found.fit);
                self.fitted = Some(found.model.problem.clone());
                // A fit that finds jumps has other parameters than its model.
                if found.model.problem.parameters() != model.problem.parameters() {
                    model = Arc::new(found.model);
                }
                fit
            }
        };
        let interrupted = fit.status == Status::Interrupted;
        let model = on_grid_of(&model, &fit);
        let model = model.ok_or_else(|| {
            StudyError::Numerical("the grid of the fit does not fit into memory".into())
        })?;
        let problem = fit.problem(&model.problem);
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
