//! `kmcfit compare`: fits models, reads finished runs, and writes their comparison.

use super::compared_names::names;
use super::fit::{fit_into, note_discarded, open_journal};
use super::progress::{Activity, Progress};
use super::{
    CommandError, NOT_CONVERGED, OK, Overrides, exit_code, inputs, interrupt, print, say,
    unwritable,
};
use crate::config::{BuildMode, Model, ModelFile, Override, Sequence, build};
use crate::error::InputError;
use crate::report::compare::{ComparedRun, Comparison, LeftOut};
use crate::report::{fit_claim, json};
use crate::results::{
    AnalysisJournal, COMPARE_JOURNAL, Claim, FitJournal, Heading, OutputFolder, RESULT,
    RequestedFiles, STUDY_JOURNAL,
};
use kmcfit_core::internals::solvers::Status;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Compare models and finished runs: one table, overlaid figures, one page.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit compare constant.yaml spline.yaml runs/earlier")]
pub struct Arguments {
    /// Model files (YAML), which are fitted, and folders of finished runs.
    #[arg(required = true, value_name = "MODEL|RUN")]
    runs: Vec<PathBuf>,
    /// Folder for the comparison, with a folder for each fitted model.
    #[arg(long, default_value = "runs/compare")]
    out: PathBuf,
    #[command(flatten)]
    set: Overrides,
    /// Print the comparison as JSON instead of the table.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let set = arguments.set.parse()?;
    if arguments.runs.iter().all(|path| path.is_dir()) {
        arguments.set.refuse("folders of finished runs")?;
    }
    compare(&arguments.runs, &set, &arguments.out, arguments.json, false)
}

/// Resumes an unfinished comparison.
pub(super) fn resume(place: &Path, as_json: bool) -> Result<u8, CommandError> {
    let heading = AnalysisJournal::heading(place, COMPARE_JOURNAL)?;
    let set = Override::parse_all(&heading.overrides)?;
    compare(&heading.inputs, &set, place, as_json, true)
}

fn compare(
    runs: &[PathBuf],
    set: &[Override],
    out: &Path,
    as_json: bool,
    is_resumed: bool,
) -> Result<u8, CommandError> {
    let job = Job::of_runs(runs, set, out)?;
    let folder = OutputFolder::prepare(out, job.claim())?;
    job.run(&folder, as_json, is_resumed)
}

/// Prepares a folder for a comparison inside another folder.
pub(super) fn prepare(parent: &OutputFolder, name: &str) -> Result<OutputFolder, InputError> {
    parent.prepare_inside(name, claim("compare", COMPARE_JOURNAL))
}

/// Compares models and runs in a folder that was prepared.
pub(super) fn run_in(folder: &OutputFolder, runs: &[PathBuf]) -> Result<u8, CommandError> {
    Job::of_runs(runs, &[], folder.path())?.run(folder, false, false)
}

/// Fits the models of a sequence one after another and compares them on one page.
pub(super) fn run_sequence(
    path: &Path,
    sequence: &Sequence,
    out: &Path,
    as_json: bool,
    is_resumed: bool,
) -> Result<u8, CommandError> {
    let heading = Heading::new("study", vec![path.to_path_buf()]).with_file(path.into());
    let job = Job {
        entries: entries(&sequence.models, &[], out)?,
        heading,
        journal: STUDY_JOURNAL,
        sequence: Some(sequence),
    };
    let folder = OutputFolder::prepare(out, job.claim().inputs([path.into()]))?;
    job.run(&folder, as_json, is_resumed)
}

/// Files of a comparison without those of its fits.
fn claim(command: &'static str, journal: &'static str) -> Claim {
    Comparison::claim(command).journals(&[journal])
}

/// A model or a run that is compared.
enum ComparisonEntry {
    /// A model that is fitted.
    Model(Box<ToFit>),
    /// A finished run.
    Run(Box<ComparedRun>),
}

/// A model that is to be fitted.
struct ToFit {
    file: ModelFile,
    model: Model,
    heading: Heading,
}

impl ComparisonEntry {
    /// The files that the comparison reads for it.
    fn files(&self) -> Vec<PathBuf> {
        match self {
            ComparisonEntry::Model(to_fit) => inputs(&to_fit.file),
            ComparisonEntry::Run(run) => vec![run.finished.folder.join(RESULT)],
        }
    }

    /// Prepares a folder for a model; `None` for a finished run.
    fn prepare(
        &self,
        name: &str,
        parent: &OutputFolder,
    ) -> Result<Option<OutputFolder>, InputError> {
        match self {
            ComparisonEntry::Model(to_fit) => {
                let claim = fit_claim(&to_fit.model).inputs(self.files());
                parent.prepare_inside(name, claim).map(Some)
            }
            ComparisonEntry::Run(_) => Ok(None),
        }
    }
}

/// Models and runs to be compared, or the models of a sequence.
struct Job<'a> {
    /// The arguments and the name of each.
    entries: Vec<(String, ComparisonEntry)>,
    heading: Heading,
    journal: &'static str,
    sequence: Option<&'a Sequence>,
}

impl Job<'_> {
    fn of_runs(runs: &[PathBuf], set: &[Override], out: &Path) -> Result<Self, InputError> {
        Ok(Self {
            entries: entries(runs, set, out)?,
            heading: Heading {
                overrides: set.iter().map(Override::to_string).collect(),
                ..Heading::new("compare", runs.to_vec())
            },
            journal: COMPARE_JOURNAL,
            sequence: None,
        })
    }

    fn claim(&self) -> Claim {
        let command = match self.sequence {
            Some(_) => "study",
            None => "compare",
        };
        let files = self.entries.iter().flat_map(|(_, entry)| entry.files());
        claim(command, self.journal).inputs(files)
    }

    /// The heading with all files on which the results depend.
    fn full_heading(&self) -> Heading {
        let entries = self.entries.iter();
        entries.fold(self.heading.clone(), |heading, (_, entry)| match entry {
            ComparisonEntry::Model(to_fit) => heading.with_model(&to_fit.file),
            ComparisonEntry::Run(run) => heading.with_file(run.finished.folder.join(RESULT)),
        })
    }

    fn run(
        self,
        folder: &OutputFolder,
        as_json: bool,
        is_resumed: bool,
    ) -> Result<u8, CommandError> {
        let full = |error| unwritable(folder.path(), &error);
        // The output folders of all models are checked before the first fit.
        let children = self.entries.iter();
        let children = children.map(|(name, entry)| entry.prepare(name, folder));
        let children = children.collect::<Result<Vec<_>, _>>()?;
        let heading = self.full_heading();
        let mut journal = open_analyses(folder, self.journal, &heading, is_resumed)?;
        let mut compared = Compared {
            flag: interrupt::flag(),
            is_resumed,
            ..Compared::default()
        };
        let all = self.entries.len();
        for (i, ((name, entry), child)) in self.entries.into_iter().zip(children).enumerate() {
            match (entry, child) {
                (ComparisonEntry::Model(to_fit), Some(child)) => {
                    compared.shown = format!("{}/{all} {name}", i + 1);
                    compared.model(&name, *to_fit, &child, &mut journal)?;
                }
                (ComparisonEntry::Run(run), _) => compared.runs.push(*run),
                (ComparisonEntry::Model(..), None) => {}
            }
        }
        let interrupted = compared.interrupted;
        let comparing = Activity::begin("comparing");
        let mut comparison = Comparison::new(compared.runs, compared.left_out);
        if let Some(sequence) = self.sequence.filter(|_| !interrupted) {
            comparison = comparison.as_sequence(&sequence.title);
        }
        comparison.write(folder).map_err(full)?;
        drop(comparing);
        journal.finish_if(!interrupted).map_err(full)?;
        match as_json {
            true => print(&json(&comparison.document())),
            false => show(&comparison, self.sequence, interrupted, folder.path()),
        }
        if interrupted && self.sequence.is_none() {
            interrupt::say_resumable(folder.path(), "comparison");
        }
        Ok(match interrupted {
            true => interrupt::exit_code(),
            false => exit_code_of(&comparison),
        })
    }
}

/// Opens the journal of a study or comparison: a new one, or to resume an older one, which is refused if an input has
/// changed.
pub(super) fn open_analyses(
    folder: &OutputFolder,
    name: &str,
    heading: &Heading,
    is_resumed: bool,
) -> Result<AnalysisJournal, InputError> {
    if is_resumed {
        return AnalysisJournal::resume(folder.path(), name, heading);
    }
    note_discarded(folder, heading)?;
    AnalysisJournal::begin(folder.path(), name, heading)
        .map_err(|error| unwritable(folder.path(), &error))
}

/// Prints a comparison, or the conclusions of a sequence.
fn show(comparison: &Comparison, sequence: Option<&Sequence>, interrupted: bool, folder: &Path) {
    let page = folder.join("compare.html");
    let page = page.display();
    let Some(sequence) = sequence else {
        print(&comparison.text());
        let folder = folder.display();
        return print(&format!("\nresults in {folder}, the page is {page}\n"));
    };
    print(&format!("{}\n\n", sequence.title));
    match interrupted {
        true => {
            print("Interrupted: no conclusions, because the sequence is incomplete.\n");
        }
        false => comparison
            .conclusions()
            .iter()
            .for_each(|sentence| print(&format!("- {sentence}\n"))),
    }
    print(&format!("\nPage   {page}\n"));
}

/// The arguments with their names. All errors in them are found before anything is run or written.
fn entries(
    runs: &[PathBuf],
    set: &[Override],
    out: &Path,
) -> Result<Vec<(String, ComparisonEntry)>, InputError> {
    let entries = runs.iter().zip(names(runs, out));
    entries
        .map(|(path, name)| Ok((name.clone(), entry(path, set, &name)?)))
        .collect()
}

/// The runs so far.
#[derive(Default)]
struct Compared {
    runs: Vec<ComparedRun>,
    left_out: Vec<LeftOut>,
    flag: Arc<AtomicBool>,
    is_resumed: bool,
    interrupted: bool,
    /// Number and name of the current model, as shown before its progress.
    shown: String,
}

impl Compared {
    /// Fits a model into its folder. A resumed comparison reads the fits that its journal lists as finished, and
    /// resumes a fit that has its own journal.
    fn model(
        &mut self,
        name: &str,
        ToFit { model, heading, .. }: ToFit,
        folder: &OutputFolder,
        journal: &mut AnalysisJournal,
    ) -> Result<(), CommandError> {
        let finished = ComparedRun::read(name, folder.path()).ok();
        match finished.filter(|_| journal.has(name)) {
            Some(run) => self.runs.push(run),
            None => {
                let before = self
                    .is_resumed
                    .then(|| open_journal(folder, &heading, true));
                let before = before.and_then(Result::ok);
                let begin = || open_journal(folder, &heading, false);
                self.fit(name, model, before.map_or_else(begin, Ok)?, folder)?;
            }
        }
        if !self.interrupted {
            let kept = journal.analysis(name, || true, || true);
            kept.map_err(|error| unwritable(folder.path(), &error))?;
        }
        Ok(())
    }

    /// A run without a result does not end the comparison; a folder that cannot be written to does.
    fn fit(
        &mut self,
        name: &str,
        mut model: Model,
        journal: FitJournal,
        folder: &OutputFolder,
    ) -> Result<(), CommandError> {
        if self.flag.load(Ordering::Relaxed) {
            self.interrupted = true;
            self.leave_out(name, "not started: interrupted".into());
            return Ok(());
        }
        for warning in &model.warnings {
            say("warning", format!("{name}: {warning}"));
        }
        model.settings.interrupt = Some(Arc::clone(&self.flag));
        let progress = Progress::new(&model.settings.stopping).named(&self.shown);
        match fit_into(
            folder,
            &model,
            &progress,
            RequestedFiles::figures(),
            journal,
        ) {
            Ok((_, status)) => {
                self.interrupted |= status == Status::Interrupted;
                match ComparedRun::read(name, folder.path()) {
                    Ok(run) => self.runs.push(run),
                    Err(error) => self.leave_out(name, error.to_string()),
                }
                Ok(())
            }
            Err(CommandError::Numerical(reason)) => {
                say("failed", format!("{name}: {reason}"));
                self.leave_out(name, reason);
                Ok(())
            }
            Err(failure) => Err(failure),
        }
    }

    fn leave_out(&mut self, name: &str, reason: String) {
        self.left_out.push(LeftOut {
            name: name.into(),
            reason,
        });
    }
}

fn entry(path: &Path, set: &[Override], name: &str) -> Result<ComparisonEntry, InputError> {
    const EXPECTED: &str = "a model file (YAML), or the folder of a finished run";
    let _reading = Activity::begin(format!("reading {}", path.display()));
    if path.is_dir() {
        return Ok(ComparisonEntry::Run(Box::new(ComparedRun::read(
            name, path,
        )?)));
    }
    if !path.exists() {
        let missing = ModelFile::read(path).err();
        let missing = missing.unwrap_or_else(|| InputError::file(path, "no such file"));
        return Err(missing.expected(EXPECTED));
    }
    if path.file_name().is_some_and(|name| name == "result.json") {
        let folder = path.parent().unwrap_or(path).display();
        return Err(
            InputError::file(path, "a result file in place of a model file")
                .expected(EXPECTED)
                .hint(format!("give its folder: {folder}")),
        );
    }
    let file = ModelFile::read_with_overrides(path, set)?;
    let model = build(&file, BuildMode::Fit)?;
    let heading = Heading::of_model("fit", &file, RequestedFiles::figures(), None);
    Ok(ComparisonEntry::Model(Box::new(ToFit {
        file,
        model,
        heading,
    })))
}

/// Exit code: success if every run converged or completed.
fn exit_code_of(comparison: &Comparison) -> u8 {
    let all = (comparison.measures().iter()).all(|m| exit_code(m.status) == OK);
    match all && comparison.left_out().is_empty() {
        true => OK,
        false => NOT_CONVERGED,
    }
}
