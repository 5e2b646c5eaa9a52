//! `kmcfit fit`: fits a model to its records and writes the run.

use super::progress::{Activity, Progress};
use super::{
    CommandError, Overrides, announce, exit_code, inputs, interrupt, print, say, stem, unwritable,
};
use crate::config::{BuildMode, Model, ModelFile, Source, Statements, build, is_record, scaffold};
use crate::error::{InputError, Location};
use crate::fitting::{ModelFit, fit_or_no_response};
use crate::report::document::{FailureDocument, ResultDocument};
use crate::report::selection::{Selected, select};
use crate::report::trial::advice;
use crate::report::{
    CompletedFit, MODEL, OverheadTimings, RequestedFiles, TimingsSummary, json, summary,
    summary_plot,
};
use crate::results::{OutputFolder, RESULT};
use console::Term;
use kmcfit_core::assessment::{Doubt, VerdictLevel};
use kmcfit_core::host::Instant;
use kmcfit_core::solvers::{IterationEvent, IterationRecord, Observer};
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};

/// Fit a model to its records, or constants to a record; write results, tables, figures and a report.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit fit model.yaml --out runs/first --set fit.stop.iterations=50"
)]
pub struct Arguments {
    /// Model file (YAML), or a record, for which the model of `kmcfit init` is fitted.
    #[arg(value_name = "MODEL|RECORD")]
    model: PathBuf,
    /// Folder for the results [default: runs/NAME].
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: Overrides,
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Write no figures and no report.
    #[arg(long)]
    no_report: bool,
    /// Write a row for every node into the tables over time.
    #[arg(long)]
    tables: bool,
    /// Add what the model lacks, until nothing is preferred to it (at most five additions).
    #[arg(long)]
    select: bool,
    /// Print all findings, the constraints and the work of the solver.
    #[arg(long, conflicts_with = "json")]
    verbose: bool,
    /// Exit with 4 for the verdict Check, with 5 for Inadequate.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    plots: PlotOptions,
}

/// Options for plots in the terminal.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct PlotOptions {
    /// Leave out the plot of the coefficient that varies.
    #[arg(long, conflicts_with = "json")]
    no_plot: bool,
}

/// Exit codes of the verdicts with `--strict`.
const CHECK: u8 = 4;
const INADEQUATE: u8 = 5;
/// Width of a chart without a terminal, columns.
const PIPED: usize = 80;

/// Options of the final output.
pub(super) struct Printed {
    pub json: bool,
    pub plots: PlotOptions,
    pub verbose: bool,
    /// True where the verdict determines the exit code.
    pub strict: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let requested = RequestedFiles {
        figures: !arguments.no_report,
        tables: arguments.tables,
    };
    let file = match is_record(&arguments.model) {
        true => model_of_record(&arguments.model)?.with_overrides(&arguments.set.parse()?)?,
        false => arguments.set.read(&arguments.model)?,
    };
    let own = || Path::new("runs").join(stem(&arguments.model));
    let printed = Printed {
        json: arguments.json,
        plots: arguments.plots,
        verbose: arguments.verbose,
        strict: arguments.strict,
    };
    let out = arguments.out.clone().unwrap_or_else(own);
    // The model of a record stands in no file yet.
    let of_record = |error: InputError| match &error.location {
        Location::Line { file, .. } if is_record(&arguments.model) && !file.exists() => {
            let made = format!(
                "`kmcfit init {}` writes the model",
                arguments.model.display()
            );
            InputError {
                location: Location::File(arguments.model.clone()),
                ..error.hint(made)
            }
        }
        _ => error,
    };
    let mut model = read(&file).map_err(of_record)?;
    model.settings.interrupt = Some(interrupt::flag());
    let folder = OutputFolder::prepare(&out, "fit", inputs(&file))?;
    announce(&model);
    let progress = Progress::new("");
    let run = RunLocation {
        folder: &folder,
        inside: None,
    };
    let document = fit_into(run, &file, &model, &progress, requested, arguments.select)?;
    print_results(&document, &out, &printed);
    Ok(code(&document, &printed))
}

/// The model that `kmcfit init` writes for a record.
fn model_of_record(path: &Path) -> Result<ModelFile, InputError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let found = scaffold(&[Source::file(path, name)], &Statements::default())?;
    say(
        "note",
        "constants are fitted, as `kmcfit init` writes them; model.yaml in the folder of the results has the model",
    );
    ModelFile::parse(path.with_extension("yaml"), found.text)
}

/// Reads the data of a model for a fit, with a line of progress.
pub(super) fn read(file: &ModelFile) -> Result<Model, InputError> {
    let _reading = Activity::begin(format!("reading the data of {}", file.path.display()));
    build(file, BuildMode::Fit)
}

/// Exit code of a fit: that of its end, or with `--strict` of its verdict where the fit ended well.
pub(super) fn code(document: &ResultDocument, printed: &Printed) -> u8 {
    let mut reasons = document.doubts();
    let by_end = match reasons.any(|reason| matches!(reason, Doubt::Stopped { .. })) {
        true => interrupt::exit_code(),
        false => exit_code(document.outcome.status),
    };
    let level = document.verdict.as_ref().map(|verdict| verdict.level);
    match (by_end, level) {
        (0, Some(VerdictLevel::Inadequate)) if printed.strict => INADEQUATE,
        (0, Some(VerdictLevel::Check)) if printed.strict => CHECK,
        _ => by_end,
    }
}

/// Prints the results of a fit.
pub(super) fn print_results(document: &ResultDocument, folder: &Path, printed: &Printed) {
    if printed.json {
        let path = folder.join(RESULT);
        let text = std::fs::read_to_string(path).unwrap_or_else(|_| json(document));
        return print(&text);
    }
    let width = || {
        let size = Term::stdout().size_checked();
        size.map_or(PIPED, |(_, columns)| columns.into())
    };
    let is_small = !printed.plots.no_plot && draws_small_plots();
    let small = is_small.then(|| summary_plot(folder, document, width()).ok());
    let small = small.flatten().flatten();
    print(&summary(document, printed.verbose, small.as_deref()));
    print(&format!("results in {}\n", folder.display()));
}

/// True if standard output is a terminal with colours (no `NO_COLOR`, no `TERM=dumb`) and an encoding in UTF-8.
fn draws_small_plots() -> bool {
    let term = Term::stdout();
    term.is_term() && term.features().colors_supported() && is_utf8(|name| std::env::var(name).ok())
}

/// True if the locale of characters is in UTF-8: the first of `LC_ALL`, `LC_CTYPE` and `LANG` that is set and not empty. Terminals of
/// Windows show Unicode without them.
fn is_utf8(variable: impl Fn(&str) -> Option<String>) -> bool {
    let mut names = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter();
    let locale = names.find_map(|name| variable(name).filter(|value| !value.is_empty()));
    let is_of_utf8 = |locale: String| {
        let locale = locale.to_ascii_lowercase();
        locale.contains("utf-8") || locale.contains("utf8")
    };
    locale.map_or(cfg!(windows), is_of_utf8)
}

/// Where the files of a run are written: into a folder of its own, or `inside` that of another command.
#[derive(Clone, Copy)]
pub(super) struct RunLocation<'a> {
    pub folder: &'a OutputFolder,
    pub inside: Option<&'a str>,
}

impl RunLocation<'_> {
    fn write(&self, name: &str, contents: &[u8]) -> io::Result<()> {
        match self.inside {
            Some(inside) => self.folder.write(&format!("{inside}/{name}"), contents),
            None => self.folder.write(name, contents),
        }
    }

    /// Where the files stand until the run takes its place.
    pub fn path(&self) -> PathBuf {
        self.folder.staged(self.inside.unwrap_or_default())
    }

    /// Ends the run with its document.
    fn end(&self, document: &impl Serialize) -> io::Result<()> {
        match self.inside {
            Some(inside) => self.folder.write_document(inside, RESULT, document),
            None => self.folder.commit(document),
        }
    }
}

/// Fits a model and writes all files of the run.
///
/// # Errors
/// If no starting point has a response, a data file has changed since it was read, or a file cannot be written.
pub(super) fn fit_into(
    run: RunLocation,
    file: &ModelFile,
    model: &Model,
    progress: &Progress,
    requested: RequestedFiles,
    selects: bool,
) -> Result<ResultDocument, CommandError> {
    let clock = Instant::now();
    let full = |error| unwritable(run.folder.shown(), &error);
    run.write(MODEL, file.text.as_bytes()).map_err(full)?;
    let found = match search(model, progress) {
        Ok(found) => found,
        Err(reason) => {
            run.end(&FailureDocument::new(&model.title, &reason))
                .map_err(full)?;
            return Err(CommandError::Numerical(reason));
        }
    };
    file.read_files().check()?;
    let activity = Activity::begin(progress.named_stage("assessing the fit"));
    let analysis = Instant::now();
    let found = CompletedFit::of(found);
    let Selected {
        file,
        fit: found,
        mut document,
    } = match selects {
        true => select(file, found, requested),
        false => Selected::of(file, found, requested),
    };
    let analysis = analysis.elapsed();
    let report = Instant::now();
    let (model, fit, fitted) = (&found.model, &found.fit, found.fitted(requested));
    document.advice = advice(&file, model, fit, &document);
    document.model.folder = run.folder.path_to(run.inside, file.path.parent());
    activity.stage(progress.named_stage("writing the results"));
    let writing = fitted
        .write(&|name, bytes| run.write(name, bytes), &document)
        .map_err(full)?;
    drop(activity);
    let before = &model.preparation;
    let overhead = OverheadTimings {
        io: before.reading + writing,
        analysis,
        report: report.elapsed().saturating_sub(writing),
    };
    let total = (before.total + clock.elapsed()).max(overhead.sum() + fit.elapsed);
    document.timings = TimingsSummary::new(fit, &overhead, total);
    run.end(&document).map_err(full)?;
    Ok(document)
}

/// Runs the fit. Also returns the model as fitted, with the path of weights if a rule chose one.
pub(super) fn search(model: &Model, progress: &Progress) -> Result<ModelFit, String> {
    let (mut ignore, mut show) = (
        |_: &IterationRecord| {},
        |moment: &IterationEvent| progress.show(moment),
    );
    let mut watch = Observer::new(&mut ignore);
    if progress.is_visible() {
        watch = watch.with_events(&mut show);
    }
    let result = fit_or_no_response(model, &mut watch);
    progress.clear();
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `setlocale(3)`: `LC_ALL` precedes `LC_CTYPE`, which precedes `LANG`; empty ones count as unset.
    #[test]
    fn the_encoding_is_that_of_the_first_locale_set() {
        let of = |set: &[(&str, &str)]| {
            is_utf8(|name| {
                let found = set.iter().find(|(of, _)| *of == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        assert!(of(&[("LANG", "de_DE.UTF-8")]) && of(&[("LC_CTYPE", "C.utf8")]));
        assert!(!of(&[("LC_ALL", "C"), ("LANG", "de_DE.UTF-8")]));
        assert!(of(&[("LC_ALL", ""), ("LANG", "de_DE.UTF-8")]));
        assert!(!of(&[("LANG", "de_DE.ISO-8859-1")]));
        assert_eq!(of(&[]), cfg!(windows));
    }
}
