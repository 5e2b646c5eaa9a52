//! `kmcfit compare`: fits models, reads finished runs, and writes their comparison.

use super::fit::{RunLocation, fit_into};
use super::progress::{Activity, Progress};
use super::{
    CommandError, NOT_CONVERGED, OK, Overrides, exit_code, inputs, interrupt, note_changes, print,
    say, stem, unwritable,
};
use crate::config::{BuildMode, Model, ModelFile, Override, build};
use crate::error::InputError;
use crate::report::compare::{ComparedRun, Comparison, LeftOut};
use crate::report::{RequestedFiles, json};
use crate::results::{OutputFolder, RESULT};
use kmcfit_core::solvers::Status;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Compare models and finished runs: one table, and a page of overlaid figures.
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
    let entries = entries(&arguments.runs, &set, &arguments.out)?;
    let folder = OutputFolder::prepare(&arguments.out, "compare", files(&entries))?;
    let comparison = compared(entries, &folder, "")?;
    finish(&comparison, &folder, arguments.json)
}

/// The files that a comparison reads.
fn files(entries: &[(String, Entry)]) -> Vec<PathBuf> {
    let files = entries.iter().flat_map(|(_, entry)| match entry {
        Entry::Model(to_fit) => inputs(&to_fit.file),
        Entry::Run(run) => vec![run.finished.folder.join(RESULT)],
    });
    files.collect()
}

/// A model that is fitted, or a finished run.
pub(super) enum Entry {
    Model(Box<ToFit>),
    Run(Box<ComparedRun>),
}

/// A model that is to be fitted.
pub(super) struct ToFit {
    file: ModelFile,
    model: Model,
}

/// The arguments with their names. All errors in them are found before anything is run or written.
fn entries(
    paths: &[PathBuf],
    set: &[Override],
    out: &Path,
) -> Result<Vec<(String, Entry)>, InputError> {
    let named = paths.iter().zip(names(paths, out));
    named
        .map(|(path, name)| Ok((name.clone(), entry(path, set, &name)?)))
        .collect()
}

fn entry(path: &Path, set: &[Override], name: &str) -> Result<Entry, InputError> {
    const EXPECTED: &str = "a model file (YAML), or the folder of a finished run";
    let _reading = Activity::begin(format!("reading {}", path.display()));
    if path.is_dir() {
        let run = ComparedRun::read(name, path)?;
        note_changes(&run.finished);
        return Ok(Entry::Run(Box::new(run)));
    }
    if !path.exists() {
        let missing = ModelFile::read(path).err();
        let missing = missing.unwrap_or_else(|| InputError::file(path, "no such file"));
        return Err(missing.expected(EXPECTED));
    }
    if path.file_name().is_some_and(|name| name == RESULT) {
        let folder = path.parent().unwrap_or(path).display();
        return Err(
            InputError::file(path, "a result file in place of a model file")
                .expected(EXPECTED)
                .hint(format!("give its folder: {folder}")),
        );
    }
    Entry::of_model(ModelFile::read_with_overrides(path, set)?)
}

impl Entry {
    /// A model that is to be fitted.
    pub fn of_model(file: ModelFile) -> Result<Self, InputError> {
        let model = build(&file, BuildMode::Fit)?;
        Ok(Self::Model(Box::new(ToFit { file, model })))
    }
}

/// Name of each run: that of its file or folder, numbered where it is taken. No fitted model gets the name of a compared run's folder.
fn names(paths: &[PathBuf], out: &Path) -> Vec<String> {
    let folders: Vec<PathBuf> = paths.iter().filter_map(|p| p.canonicalize().ok()).collect();
    let mut names = vec!["figures".to_owned()];
    for path in paths {
        let whole = path.canonicalize().unwrap_or_else(|_| path.clone());
        let stem = stem(&whole);
        let is_free = |name: &String| {
            let location = out.join(name).canonicalize();
            let overwrites =
                !path.is_dir() && location.is_ok_and(|location| folders.contains(&location));
            // Some file systems ignore case.
            !overwrites && names.iter().all(|taken| !taken.eq_ignore_ascii_case(name))
        };
        let numbered = (2..).map(|i| format!("{stem}-{i}"));
        let name = std::iter::once(stem.clone()).chain(numbered).find(is_free);
        names.push(name.unwrap_or(stem));
    }
    names.split_off(1)
}

/// Fits the models and compares them with the runs; their files are written `inside` the folder of the command. A model without a result does not end the comparison; a folder that cannot be
/// written to does.
pub(super) fn compared(
    entries: Vec<(String, Entry)>,
    folder: &OutputFolder,
    inside: &str,
) -> Result<Comparison, CommandError> {
    let flag = interrupt::flag();
    let (mut runs, mut left_out) = (Vec::new(), Vec::new());
    let all = entries.len();
    for (i, (name, entry)) in entries.into_iter().enumerate() {
        let run = match entry {
            Entry::Model(to_fit) => {
                let shown = format!("{}/{all} {name}", i + 1);
                let location = format!("{inside}{name}");
                let run = RunLocation {
                    folder,
                    inside: Some(&location),
                };
                fitted(&name, *to_fit, run, &shown, &flag)?
            }
            Entry::Run(run) => Ok(*run),
        };
        match run {
            Ok(run) => runs.push(run),
            Err(reason) => left_out.push(LeftOut { name, reason }),
        }
    }
    let _comparing = Activity::begin("comparing");
    let comparison = Comparison::new(runs, left_out);
    let write = |name: &str, bytes: &[u8]| folder.write(&format!("{inside}{name}"), bytes);
    let written = comparison.write(&write);
    written.map_err(|error| unwritable(folder.shown(), &error))?;
    Ok(comparison)
}

/// Fits a model into its folder; the reason where there is no result.
fn fitted(
    name: &str,
    ToFit { file, mut model }: ToFit,
    location: RunLocation,
    shown: &str,
    flag: &Arc<AtomicBool>,
) -> Result<Result<ComparedRun, String>, CommandError> {
    if flag.load(Ordering::Relaxed) {
        return Ok(Err("not started: interrupted".into()));
    }
    for warning in &model.warnings {
        say("warning", format!("{name}: {warning}"));
    }
    model.settings.interrupt = Some(Arc::clone(flag));
    let progress = Progress::new(shown);
    match fit_into(
        location,
        &file,
        &model,
        &progress,
        RequestedFiles::figures(),
        false,
    ) {
        Ok(_) => Ok(ComparedRun::read(name, &location.path()).map_err(|error| error.to_string())),
        Err(CommandError::Numerical(reason)) => {
            say("failed", format!("{name}: {reason}"));
            Ok(Err(reason))
        }
        Err(failure) => Err(failure),
    }
}

/// Prints a comparison; the exit code is that of success if every run converged or completed.
fn finish(
    comparison: &Comparison,
    folder: &OutputFolder,
    as_json: bool,
) -> Result<u8, CommandError> {
    let written = folder.commit(&comparison.document());
    written.map_err(|error| unwritable(folder.shown(), &error))?;
    match as_json {
        true => print(&json(&comparison.document())),
        false => {
            let page = folder.shown().join("compare.html");
            let text = comparison.text();
            print(&format!("{text}\nPage   {}\n", page.display()));
        }
    }
    Ok(exit_code_of(comparison))
}

/// Exit code of a comparison: success if every run converged or completed.
pub(super) fn exit_code_of(comparison: &Comparison) -> u8 {
    let statuses = || comparison.measures().iter().map(|m| m.status);
    if interrupt::is_asked() || statuses().any(|status| status == Status::Interrupted) {
        return interrupt::exit_code();
    }
    let is_complete = statuses().all(|status| exit_code(status) == OK);
    match is_complete && comparison.left_out().is_empty() {
        true => OK,
        false => NOT_CONVERGED,
    }
}
