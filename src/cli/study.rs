//! `kmcfit study` and `kmcfit resume`

use super::compare::{side_by_side, verdict};
use super::fit::search;
use super::progress::Progress;
use super::{Failure, INTERRUPTED, NOT_CONVERGED, OK, interrupt, print, unwritable};
use crate::config::{Model, ModelFile, Purpose, Story, build};
use crate::error::InputError;
use crate::identifiability::count;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::report::study::{StudyDocument, gather};
use crate::report::{FinishedRun, Heading, Journal, OutputFolder, json};
use crate::solvers::Status;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the data can and cannot tell: of a model, or a story of several models on one page.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file or story (YAML), or the folder of a finished run, whose model is fitted again.
    model: PathBuf,
    /// Folder for the results [default: runs/NAME-study].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Threads; the results do not depend on them [default: one per core].
    #[arg(long)]
    threads: Option<usize>,
}

/// Go on with a study that was interrupted.
#[derive(Debug, clap::Args)]
pub struct ResumeArguments {
    /// Folder of the study.
    study: PathBuf,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Threads; the results do not depend on them [default: one per core].
    #[arg(long)]
    threads: Option<usize>,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    if arguments.threads == Some(0) {
        return Err(InputError::new(
            crate::error::Place::Argument("--threads".into()),
            "a study needs a thread",
        )
        .found(0)
        .expected("1 or more")
        .into());
    }
    let name = arguments.model.file_stem().unwrap_or_default();
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from("runs").join(format!("{}-study", name.to_string_lossy())));
    if arguments.model.is_dir() {
        // A run of another format, or one that failed, is refused here.
        let run = FinishedRun::open(&arguments.model)?;
        let model = PathBuf::from(&run.document.model.file);
        let threads = threads(arguments.threads);
        return study(&model, &out, arguments.json, threads, false);
    }
    match Story::read(&arguments.model)? {
        Some(story) => tell(&arguments.model, &story, &out, arguments.json, false),
        None => {
            let threads = threads(arguments.threads);
            study(&arguments.model, &out, arguments.json, threads, false)
        }
    }
}

pub fn resume(arguments: &ResumeArguments) -> Result<u8, Failure> {
    let heading = Journal::heading(&arguments.study)?;
    if let Some(story) = Story::read(&heading.model)? {
        return tell(
            &heading.model,
            &story,
            &arguments.study,
            arguments.json,
            true,
        );
    }
    let threads = threads(arguments.threads);
    study(
        &heading.model,
        &arguments.study,
        arguments.json,
        threads,
        true,
    )
}

fn threads(asked: Option<usize>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    asked.unwrap_or_else(cores).max(1)
}

/// Runs the models of a story and tells them on one page.
fn tell(path: &Path, story: &Story, out: &Path, as_json: bool, go_on: bool) -> Result<u8, Failure> {
    let mut text = String::new();
    for model in &story.models {
        // Whatever is wrong with a model is said before anything is made.
        let file = ModelFile::read(model)?;
        build(&file, Purpose::Fit)?;
        text += &file.text;
    }
    let heading = Heading::new(path, &text, 0.0);
    if go_on {
        // Refused where a model is another one by now.
        Journal::go_on(out, &heading)?;
    } else {
        let folder = OutputFolder::prepare(out)?;
        Journal::begin(folder.path(), &heading)
            .map_err(|error| unwritable(folder.path(), &error))?;
    }
    let (folder, comparison, interrupted) = side_by_side(&story.models, out, go_on)?;
    let comparison = match interrupted {
        true => comparison,
        false => comparison.told_as(&story.title),
    };
    comparison
        .write(&folder)
        .map_err(|error| unwritable(folder.path(), &error))?;
    if as_json {
        print(&json(&comparison.document()));
    } else {
        print(&format!("{}\n\n", story.title));
        if interrupted {
            print("interrupted: the story is not complete, so nothing is concluded from it\n");
        } else {
            for sentence in comparison.conclusions() {
                print(&format!("- {sentence}\n"));
            }
        }
        print(&format!(
            "\nthe page is {}\n",
            folder.path().join("compare.html").display()
        ));
    }
    Ok(match interrupted {
        true => INTERRUPTED,
        false => verdict(&comparison),
    })
}

fn study(
    path: &Path,
    out: &Path,
    as_json: bool,
    threads: usize,
    go_on: bool,
) -> Result<u8, Failure> {
    let file = ModelFile::read(path)?;
    let mut model = build(&file, Purpose::Fit)?;
    can_be_studied(&file, &model)?;
    for remark in &model.remarks {
        eprintln!("note: {remark}");
    }
    for warning in &model.warnings {
        eprintln!("warning: {warning}");
    }
    let flag = interrupt::flag();
    model.settings.interrupt = Some(Arc::clone(&flag));
    let start = model.problem.start();
    let cost = model.problem.evaluate(&start).map_or(f64::NAN, |e| e.cost);
    let heading = Heading::new(path, &file.text, cost);
    let folder = OutputFolder::prepare(out)?;
    let journal = match go_on {
        true => Journal::go_on(folder.path(), &heading)?,
        false => Journal::begin(folder.path(), &heading)
            .map_err(|error| unwritable(folder.path(), &error))?,
    };
    let mut work = Work {
        model: &model,
        journal,
        flag,
        threads,
        document: StudyDocument {
            format: 1,
            title: model.title.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            status: "interrupted".into(),
            confidence: model.study.confidence,
            seed: model.study.seed,
            before: count(&model.problem).sentences,
            ..StudyDocument::default()
        },
    };
    let done = work.run().map_err(|trouble| match trouble {
        Trouble::Disk(error) => Failure::from(unwritable(folder.path(), &error)),
        Trouble::Numerical(reason) => Failure::Numerical(reason),
    })?;
    let mut document = work.document;
    if done {
        document.status = "complete".into();
    }
    document
        .write(&folder)
        .map_err(|error| unwritable(folder.path(), &error))?;
    match as_json {
        true => print(&json(&document)),
        false => {
            print(&document.text());
            print(&format!(
                "\nthe page is {}\n",
                folder.path().join("study.html").display()
            ));
        }
    }
    let fitted = document.fit.as_ref().map(|fit| fit.status.as_str());
    let fine = [Status::Converged, Status::Completed].map(Status::name);
    Ok(match (done, fitted) {
        (false, _) => INTERRUPTED,
        (true, Some(status)) if fine.contains(&status) => OK,
        (true, _) => NOT_CONVERGED,
    })
}

/// A study is of a simulated motion.
fn can_be_studied(file: &ModelFile, model: &Model) -> Result<(), InputError> {
    use crate::solvers::Solver;
    match model.settings.solver {
        Solver::EquationError => Err(file
            .error_at(
                "fit.method",
                "a fit of the equation error cannot be studied",
            )
            .found("`equation-error`, which simulates no motion")
            .expected("another method")),
        _ if model.problem.parameters() == 0 => Err(file
            .error_at(
                "functions",
                "there is nothing to study: every function is fixed",
            )
            .expected("at least one function with a basis")),
        _ => Ok(()),
    }
}

/// Why a study cannot go on.
enum Trouble {
    Disk(io::Error),
    Numerical(String),
}

impl From<io::Error> for Trouble {
    fn from(error: io::Error) -> Self {
        Trouble::Disk(error)
    }
}

/// A study at work.
struct Work<'a> {
    model: &'a Model,
    journal: Journal,
    flag: Arc<AtomicBool>,
    threads: usize,
    document: StudyDocument,
}

impl Work<'_> {
    fn interrupted(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// All pieces; whether none was left out because of an interrupt.
    fn run(&mut self) -> Result<bool, Trouble> {
        let Some((problem, theta, evaluation)) = self.fit()? else {
            return Ok(false);
        };
        let (plan, threads) = (&self.model.study, self.threads);
        macro_rules! piece {
            ($name:expr, $compute:expr) => {{
                if self.interrupted() {
                    return Ok(false);
                }
                let name: &str = $name;
                if std::io::stderr().is_terminal() {
                    eprintln!("studying: {name}");
                }
                self.journal.piece(name, || $compute)?
            }};
        }
        let spectrum = piece!("spectrum", gather::spectrum(&problem, &theta, &evaluation));
        self.document.spectrum = Some(spectrum);
        let truth = self.model.truth.as_ref();
        let bands = piece!(
            "bands",
            gather::bands(&problem, &theta, &evaluation, plan, truth)
        );
        self.document.bands = Some(bands);
        for (i, target) in plan.profiles.iter().enumerate() {
            let Some(of) = gather::linear(&problem, target) else {
                continue;
            };
            let found = piece!(
                &format!("profile {i}"),
                gather::profile_of(&problem, &theta, &of, plan)
            );
            match found {
                Ok(found) => self.document.profiles.push(found),
                Err(reason) => self.fail(&format!("the profile of {}", of.name), &reason),
            }
        }
        if !plan.candidates.is_empty() {
            self.document.candidates = piece!(
                "candidates",
                gather::candidates(&problem, &theta, &evaluation, &plan.candidates)
            );
        }
        self.document.equivalents = piece!(
            "equivalents",
            gather::equivalents(&problem, &evaluation, plan)
        );
        if plan.starts > 0 {
            let found = piece!(
                "starts",
                gather::multistart(self.model, &problem, &theta, plan, threads)
            );
            self.document.multistart = Some(found);
        }
        if plan.varies {
            match piece!("varies", gather::varies(&problem, &theta, plan, threads)) {
                Ok(found) => self.document.varies = found,
                Err(reason) => self.fail("whether each function varies", &reason),
            }
        }
        if plan.replicates > 0 {
            match piece!("refits", gather::refits(&problem, &theta, plan, threads)) {
                Ok(found) => self.document.bootstrap = found,
                Err(reason) => self.fail("refits", &reason),
            }
        }
        let model = self.model;
        let (tubes, predictions) = piece!("tubes", {
            let level = gather::level(&problem, &theta, &evaluation, plan);
            let (tubes, extremes) = gather::tubes(&problem, &theta, &level, plan, threads);
            let predictions = gather::predictions(&problem, &theta, &evaluation, model, &extremes);
            (tubes, predictions)
        });
        if tubes.is_empty() {
            let reason = "the optimum itself is not within the stated level and the constraints";
            self.fail("tubes", reason);
        }
        self.document.tubes = tubes;
        self.document.budgeted = !problem.penalties.is_empty();
        self.document.predictions = predictions;
        Ok(true)
    }

    fn fail(&mut self, what: &str, reason: &str) {
        self.document.failures.push(format!("{what}: {reason}"));
    }

    /// The fit, from the journal if it is there; `None` if it was interrupted.
    fn fit(&mut self) -> Result<Option<(Problem, Vec<f64>, Evaluation)>, Trouble> {
        let model = self.model;
        let progress = Progress::new(model.settings.stopping.iterations);
        let fitted = self.journal.piece("fit", || {
            let (weighted, _, found) = search(model, &progress)?;
            let problem = weighted.as_ref().map_or(&model.problem, |m| &m.problem);
            Ok::<_, String>(gather::fit(problem, &found))
        })?;
        let fit = fitted.map_err(Trouble::Numerical)?;
        let interrupted = fit.status == Status::Interrupted.name();
        let problem = gather::as_fitted(&model.problem, &fit);
        let theta = fit.parameters.clone();
        self.document.fit = Some(fit);
        let evaluation = problem
            .evaluate(&theta)
            .map_err(|breakdown| Trouble::Numerical(breakdown.to_string()))?;
        Ok((!interrupted).then_some((problem, theta, evaluation)))
    }
}
