//! `kmcfit compare`

use super::fit::{begun, fit_into};
use super::progress::Progress;
use super::{Failure, INTERRUPTED, NOT_CONVERGED, OK, interrupt, print, say, unwritable};
use crate::config::{Model, ModelFile, Purpose, build};
use crate::error::InputError;
use crate::report::compare::{ComparedRun, Comparison, LeftOut};
use crate::report::{FitHeading, FitJournal, Journal, OutputFolder, json};
use crate::solvers::Status;
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

impl Arguments {
    /// A comparison of models in a folder.
    pub(super) fn of(runs: Vec<PathBuf>, out: PathBuf) -> Self {
        Self {
            runs,
            out,
            json: false,
        }
    }
}

/// One argument, read and found usable.
pub(super) enum Entry {
    /// To be fitted into a folder.
    Model(Box<Model>, FitHeading),
    /// Finished.
    Run(Box<ComparedRun>),
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let entries = entries(&arguments.runs, &arguments.out)?;
    let flag = interrupt::flag();
    let folder = OutputFolder::prepare(&arguments.out)?;
    let (comparison, interrupted) = side_by_side(entries, &folder, &flag, None)?;
    comparison
        .write(&folder)
        .map_err(|error| unwritable(folder.path(), &error))?;
    if arguments.json {
        print(&json(&comparison.document()));
    } else {
        print(&comparison.text());
        print(&format!(
            "\nresults in {}, the page is {}\n",
            folder.path().display(),
            folder.path().join("compare.html").display()
        ));
    }
    Ok(match interrupted {
        true => INTERRUPTED,
        false => verdict(&comparison),
    })
}

/// Fits models and reads finished runs; the comparison, and whether it was interrupted. Fits that the
/// journal of a story says were finished in the folder before are read, not made again.
pub(super) fn side_by_side(
    entries: Vec<(String, Entry)>,
    folder: &OutputFolder,
    flag: &Arc<AtomicBool>,
    mut journal: Option<&mut Journal>,
) -> Result<(Comparison, bool), Failure> {
    let out = folder.path();
    let mut compared = Compared::default();
    let mut prepared = Vec::new();
    for (name, entry) in entries {
        let folder = match entry {
            Entry::Model(..) => Some(OutputFolder::prepare(&out.join(&name))?),
            Entry::Run(_) => None,
        };
        prepared.push((name, entry, folder));
    }
    for (name, entry, folder) in prepared {
        match (entry, folder) {
            (Entry::Model(model, heading), Some(folder)) => {
                let is_kept = journal.as_ref().is_some_and(|j| j.has(&name));
                match ComparedRun::read(&name, folder.path())
                    .ok()
                    .filter(|_| is_kept)
                {
                    Some(run) => compared.runs.push(run),
                    None => {
                        // A fit of a story goes on where it was, one of a comparison begins.
                        let before = journal
                            .as_ref()
                            .and_then(|_| FitJournal::go_on(folder.path(), &heading).ok());
                        let begin = || begun(&folder, &heading);
                        let fit = before.map_or_else(begin, Ok)?;
                        compared.fit(&name, *model, fit, &folder, flag)?;
                    }
                }
                if let Some(journal) = &mut journal
                    && !compared.interrupted
                {
                    let kept = journal.piece(&name, || true, || true);
                    kept.map_err(|error| unwritable(out, &error))?;
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

/// The arguments, read and found usable, and what each is called: whatever is wrong with them is said
/// before anything is run or made.
pub(super) fn entries(runs: &[PathBuf], out: &Path) -> Result<Vec<(String, Entry)>, InputError> {
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
    let heading = FitHeading::new(&file, true, None);
    Ok(Entry::Model(Box::new(model), heading))
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
    let mut taken: Vec<String> = ["figures", "compare.csv", "compare.html"]
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
