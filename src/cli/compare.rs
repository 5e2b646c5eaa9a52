//! `kmcfit compare`

use super::fit::{begun, fit_into, note_discarded};
use super::progress::Progress;
use super::{Failure, NOT_CONVERGED, OK, inputs, interrupt, print, say, unwritable};
use crate::config::{Model, ModelFile, Purpose, build};
use crate::error::InputError;
use crate::report::compare::{ComparedRun, Comparison, LeftOut};
use crate::report::{fit_claim, json};
use crate::results::{
    AnalysisJournal, COMPARE_JOURNAL, Claim, FitJournal, Heading, MANIFEST, OutputFolder, RESULT,
};
use kmcfit_core::internals::solvers::Status;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Fit models or take finished runs, and put them side by side: a table, figures, one page.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model files (YAML), which are fitted, and folders of finished runs, which are read.
    #[arg(required = true, value_name = "MODEL|RUN")]
    runs: Vec<PathBuf>,
    /// Folder for the comparison; each fitted model has a folder of its own in it.
    #[arg(long, default_value = "runs/compare")]
    out: PathBuf,
    /// Print the comparison as JSON instead of the table.
    #[arg(long)]
    json: bool,
}

/// One argument, read and found usable.
pub(super) enum Entry {
    /// To be fitted into a folder of its own.
    Model(Box<ToFit>),
    /// Finished.
    Run(Box<ComparedRun>),
}

/// A model that is to be fitted.
pub(super) struct ToFit {
    file: ModelFile,
    model: Model,
    heading: Heading,
}

impl ToFit {
    fn claim(&self) -> Claim {
        fit_claim(&self.model).inputs(inputs(&self.file))
    }
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let entries = entries(&arguments.runs, &arguments.out)?;
    let claim = claim("compare", COMPARE_JOURNAL).inputs(files_of(&entries));
    let folder = OutputFolder::prepare(&arguments.out, claim)?;
    begin(entries, &folder, &arguments.runs, arguments.json)
}

/// Prepares a folder for a comparison inside another folder.
pub(super) fn prepare(parent: &OutputFolder, name: &str) -> Result<OutputFolder, InputError> {
    parent.prepare_inside(name, claim("compare", COMPARE_JOURNAL))
}

/// Compares models and runs in a folder that was prepared.
pub(super) fn run_in(folder: &OutputFolder, runs: &[PathBuf]) -> Result<u8, Failure> {
    begin(entries(runs, folder.path())?, folder, runs, false)
}

fn begin(
    entries: Entries,
    folder: &OutputFolder,
    runs: &[PathBuf],
    as_json: bool,
) -> Result<u8, Failure> {
    let children = children(&entries, folder)?;
    let heading = heading(&entries, runs);
    note_discarded(folder, &heading)?;
    let journal = AnalysisJournal::begin(folder.path(), COMPARE_JOURNAL, &heading)
        .map_err(|error| unwritable(folder.path(), &error))?;
    finish(entries, (folder, children), journal, (as_json, false))
}

/// Resumes a comparison that did not come to its end.
pub(super) fn go_on(place: &Path, as_json: bool) -> Result<u8, Failure> {
    let runs = AnalysisJournal::heading(place, COMPARE_JOURNAL)?.inputs;
    let entries = entries(&runs, place)?;
    let claim = claim("compare", COMPARE_JOURNAL).inputs(files_of(&entries));
    let folder = OutputFolder::prepare(place, claim)?;
    let children = children(&entries, &folder)?;
    let heading = heading(&entries, &runs);
    let journal = AnalysisJournal::resume(place, COMPARE_JOURNAL, &heading)?;
    finish(entries, (&folder, children), journal, (as_json, true))
}

/// What a comparison writes into its folder, fits apart.
pub(super) fn claim(command: &'static str, journal: &'static str) -> Claim {
    Comparison::claim(command).journals(&[journal])
}

fn heading(entries: &Entries, runs: &[PathBuf]) -> Heading {
    let heading = Heading::new("compare", runs.to_vec());
    entries
        .iter()
        .fold(heading, |heading, (_, entry)| match entry {
            Entry::Model(to_fit) => heading.with_model(&to_fit.file),
            Entry::Run(run) => heading.with_file(run.finished.folder.join(RESULT)),
        })
}

/// The files that a comparison reads.
pub(super) fn files_of(entries: &Entries) -> Vec<PathBuf> {
    let files = entries.iter().flat_map(|(_, entry)| match entry {
        Entry::Model(to_fit) => inputs(&to_fit.file),
        Entry::Run(run) => vec![run.finished.folder.join(RESULT)],
    });
    files.collect()
}

fn finish(
    entries: Entries,
    (folder, children): (&OutputFolder, Children),
    mut journal: AnalysisJournal,
    (as_json, is_resumed): (bool, bool),
) -> Result<u8, Failure> {
    let flag = interrupt::flag();
    let (comparison, interrupted) =
        side_by_side(entries, children, &flag, &mut journal, is_resumed)?;
    let written = comparison
        .write(folder)
        .and_then(|()| journal.finish_if(!interrupted));
    written.map_err(|error| unwritable(folder.path(), &error))?;
    if as_json {
        print(&json(&comparison.document()));
    } else {
        print(&comparison.text());
        print(&format!(
            "\nresults in {}, the page is {}\n",
            folder.path().display(),
            folder.path().join("compare.html").display()
        ));
    }
    if interrupted {
        let folder = folder.path().display();
        say(
            "note",
            format!("`kmcfit resume {folder}` goes on with this comparison"),
        );
    }
    Ok(match interrupted {
        true => interrupt::exit_code(),
        false => verdict(&comparison),
    })
}

/// The folders of the fits of a comparison, in the order of its entries; `None` for a finished run.
pub(super) type Children = Vec<Option<OutputFolder>>;

/// Prepares a folder for each model: what is wrong with one is found before the first fit.
pub(super) fn children(entries: &Entries, folder: &OutputFolder) -> Result<Children, InputError> {
    let prepare = |(name, entry): &(String, Entry)| match entry {
        Entry::Model(to_fit) => folder.prepare_inside(name, to_fit.claim()).map(Some),
        Entry::Run(_) => Ok(None),
    };
    entries.iter().map(prepare).collect()
}

/// Fits models and reads finished runs; the comparison, and whether it was interrupted. Where it is resumed, fits that
/// the journal lists as finished are read from their folders, and one with a journal of its own is
/// resumed.
pub(super) fn side_by_side(
    entries: Entries,
    children: Children,
    flag: &Arc<AtomicBool>,
    journal: &mut AnalysisJournal,
    is_resumed: bool,
) -> Result<(Comparison, bool), Failure> {
    let mut compared = Compared::default();
    for ((name, entry), folder) in entries.into_iter().zip(children) {
        match (entry, folder) {
            (Entry::Model(to_fit), Some(folder)) => {
                let finished = ComparedRun::read(&name, folder.path()).ok();
                match finished.filter(|_| journal.has(&name)) {
                    Some(run) => compared.runs.push(run),
                    None => {
                        let heading = &to_fit.heading;
                        let before = is_resumed
                            .then(|| FitJournal::resume(folder.path(), heading).ok())
                            .flatten();
                        let begin = || begun(&folder, heading);
                        let fit = before.map_or_else(begin, Ok)?;
                        compared.fit(&name, to_fit.model, fit, &folder, flag)?;
                    }
                }
                if !compared.interrupted {
                    let kept = journal.analysis(&name, || true, || true);
                    kept.map_err(|error| unwritable(folder.path(), &error))?;
                }
            }
            (Entry::Run(run), _) => compared.runs.push(*run),
            (Entry::Model(..), None) => {}
        }
    }
    let interrupted = compared.interrupted;
    Ok((
        Comparison::new(compared.runs, compared.left_out),
        interrupted,
    ))
}

/// The arguments and the name of each.
pub(super) type Entries = Vec<(String, Entry)>;

/// The arguments, read and found usable, and what each is called: whatever is wrong with them is said
/// before anything is run or made.
pub(super) fn entries(runs: &[PathBuf], out: &Path) -> Result<Entries, InputError> {
    let entries = runs.iter().zip(names(runs, out));
    entries
        .map(|(path, name)| Ok((name.clone(), entry(path, &name)?)))
        .collect()
}

/// The runs so far.
#[derive(Default)]
struct Compared {
    runs: Vec<ComparedRun>,
    left_out: Vec<LeftOut>,
    interrupted: bool,
}

impl Compared {
    /// Fits a model into its folder. A run without a result does not end the comparison; a folder
    /// that cannot be written to does.
    fn fit(
        &mut self,
        name: &str,
        mut model: Model,
        journal: FitJournal,
        folder: &OutputFolder,
        flag: &Arc<AtomicBool>,
    ) -> Result<(), Failure> {
        if flag.load(Ordering::Relaxed) {
            self.interrupted = true;
            self.leave_out(name, "not begun: interrupted".into());
            return Ok(());
        }
        for warning in &model.warnings {
            say("warning", format!("{name}: {warning}"));
        }
        model.settings.interrupt = Some(Arc::clone(flag));
        let progress = Progress::new(&model.settings.stopping).named(name);
        match fit_into(folder, &model, &progress, true, journal) {
            Ok((_, status)) => {
                self.interrupted |= status == Status::Interrupted;
                match ComparedRun::read(name, folder.path()) {
                    Ok(run) => self.runs.push(run),
                    Err(error) => self.leave_out(name, error.to_string()),
                }
                Ok(())
            }
            Err(Failure::Numerical(reason)) => {
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

fn entry(path: &Path, name: &str) -> Result<Entry, InputError> {
    const EXPECTED: &str = "a model file (YAML), or the folder of a finished run";
    if path.is_dir() {
        return Ok(Entry::Run(Box::new(ComparedRun::read(name, path)?)));
    }
    if !path.exists() {
        let missing = ModelFile::read(path).err();
        let missing = missing.unwrap_or_else(|| InputError::file(path, "there is no such file"));
        return Err(missing.expected(EXPECTED));
    }
    if path.file_name().is_some_and(|name| name == "result.json") {
        let folder = path.parent().unwrap_or(path).display();
        return Err(InputError::file(path, "this is a result, not a model")
            .expected(EXPECTED)
            .hint(format!("give its folder: {folder}")));
    }
    let file = ModelFile::read(path)?;
    let model = build(&file, Purpose::Fit)?;
    let heading = Heading::of_model("fit", &file, true, None);
    Ok(Entry::Model(Box::new(ToFit {
        file,
        model,
        heading,
    })))
}

/// What each run is called: the name of its file or folder, with a number where that is taken. A
/// fitted model never takes the folder of a finished run that is compared with it, or one of the
/// comparison's own names.
fn names(paths: &[PathBuf], out: &Path) -> Vec<String> {
    let runs: Vec<PathBuf> = paths
        .iter()
        .filter(|path| path.is_dir())
        .filter_map(|path| path.canonicalize().ok())
        .collect();
    let mut taken: Vec<String> = [
        "figures",
        "compare.csv",
        "compare.html",
        COMPARE_JOURNAL,
        MANIFEST,
    ]
    .map(String::from)
    .into();
    let mut names = Vec::new();
    for path in paths {
        let stem = stem(path);
        let numbered = (2..).map(|i| format!("{stem}-{i}"));
        let mut wanted = std::iter::once(stem.clone()).chain(numbered);
        let free = |name: &String| {
            let place = out.join(name).canonicalize();
            let overwrites = !path.is_dir() && place.is_ok_and(|place| runs.contains(&place));
            // Some file systems do not tell small letters from capitals.
            !taken.contains(&name.to_lowercase()) && !overwrites
        };
        let name = wanted.find(free).unwrap_or(stem.clone());
        taken.push(name.to_lowercase());
        names.push(name);
    }
    names
}

fn stem(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = match path.is_dir() {
        true => whole.file_name(),
        false => return super::stem(path),
    };
    name.map_or_else(|| "run".into(), |name| name.to_string_lossy().into_owned())
}

/// Whether every run ended as asked for.
pub(super) fn verdict(comparison: &Comparison) -> u8 {
    let fine = [Status::Converged, Status::Completed].map(Status::name);
    let all = (comparison.measures().iter()).all(|m| fine.contains(&m.status.as_str()));
    match all && comparison.left_out().is_empty() {
        true => OK,
        false => NOT_CONVERGED,
    }
}
