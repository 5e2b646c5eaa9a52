//! `kmcfit fit`: fits a model to its records and writes the run.

use super::progress::{Activity, Progress};
use super::{
    CommandError, Overrides, announce, exit_code, inputs, interrupt, print, say, stem, unwritable,
};
use crate::config::{BuildMode, Model, ModelFile, Override, build};
use crate::error::InputError;
use crate::fitting::fit_or_no_response;
use crate::report::document::{FailureDocument, ResultDocument};
use crate::report::{
    DRAWS, DisplayUnits, FittedModel, OverheadTimings, RunAssessment, TimingsSummary, charts,
    fit_claim, json, model_predictions, summary, summary_plot,
};
use crate::results::{FitJournal, Heading, OutputFolder, RESULT, RequestedFiles};
use console::Term;
use kmcfit_core::internals::assessment::{NoDraws, VerdictLevel};
use kmcfit_core::internals::solvers::{
    CheckpointStore, Fit, IterationEvent, IterationRecord, Observer, Status, WeightPath,
};
use kmcfit_core::internals::threads;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Fit a model to its records; write results, tables, figures and a report.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit fit model.yaml --out runs/first --set fit.stop.iterations=50"
)]
pub struct Arguments {
    /// Model file (YAML).
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
    /// Write so many draws from the distribution of the estimates to draws.csv.
    #[arg(long, value_name = "NUMBER")]
    draws: Option<usize>,
    /// Print the computing times.
    #[arg(long)]
    timings: bool,
    /// Print all findings, the fit of each channel and the work of the solver.
    #[arg(long, conflicts_with = "json")]
    verbose: bool,
    /// Exit with 4 for the verdict Check, with 5 for Inadequate.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    plots: PlotOptions,
    /// Shortest time between checkpoints for `resume` [default: 1 s, longer if they take over 2 % of the time].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    checkpoint: Option<f64>,
}

/// Options for plots in the terminal.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct PlotOptions {
    /// Plot record, fit and functions in the terminal.
    #[arg(long, conflicts_with = "json")]
    plot: bool,
    /// Leave out the plot of the coefficient that varies.
    #[arg(long, conflicts_with_all = ["json", "plot"])]
    no_plot: bool,
}

/// Exit codes of the verdicts with `--strict`.
const CHECK: u8 = 4;
const INADEQUATE: u8 = 5;
/// Most draws: a table of some hundred megabytes.
const MOST_DRAWS: usize = 1_000_000;
/// Width of a chart without a terminal, columns.
const PIPED: usize = 80;

/// Options of the final output.
pub(super) struct Printed {
    pub json: bool,
    pub timings: bool,
    pub plots: PlotOptions,
    pub verbose: bool,
    /// True where the verdict determines the exit code.
    pub strict: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    if let Some(seconds) = arguments.checkpoint.filter(|s| !(0.0..=1e9).contains(s)) {
        return Err(InputError::argument("--checkpoint", "invalid time")
            .found(seconds)
            .expected("seconds, 0 or greater (0: after every iteration)")
            .into());
    }
    let draws = arguments.draws;
    if let Some(number) = draws.filter(|number| !(1..=MOST_DRAWS).contains(number)) {
        return Err(InputError::argument("--draws", "invalid number of draws")
            .found(number)
            .expected(format!("1 to {MOST_DRAWS}"))
            .into());
    }
    let requested = RequestedFiles {
        figures: !arguments.no_report,
        tables: arguments.tables,
        draws: draws.unwrap_or(0),
    };
    let file = arguments.set.read(&arguments.model)?;
    let own = || Path::new("runs").join(stem(&arguments.model));
    let printed = Printed {
        json: arguments.json,
        timings: arguments.timings,
        plots: arguments.plots,
        verbose: arguments.verbose,
        strict: arguments.strict,
    };
    let heading = || Heading::of_model("fit", &file, requested, arguments.checkpoint);
    let out = arguments.out.clone().unwrap_or_else(own);
    fit(&file, heading, &out, &printed, false)
}

/// Resumes an unfinished fit.
pub(super) fn resume(
    place: &Path,
    heading: &Heading,
    printed: &Printed,
) -> Result<u8, CommandError> {
    let path = heading.inputs.first().cloned().unwrap_or_default();
    let file = ModelFile::read_with_overrides(path, &Override::parse_all(&heading.overrides)?)?;
    let now = || Heading::of_model("fit", &file, heading.requested, heading.checkpoint);
    fit(&file, now, place, printed, true)
}

/// Fits a record of a fleet, and prints the summary of a fit.
pub(super) fn fit_record_page(
    file: &ModelFile,
    heading: &Heading,
    out: &Path,
) -> Result<u8, CommandError> {
    let printed = Printed {
        json: false,
        timings: false,
        plots: PlotOptions {
            plot: false,
            no_plot: false,
        },
        verbose: false,
        strict: false,
    };
    fit(file, || heading.clone(), out, &printed, false)
}

fn fit(
    file: &ModelFile,
    heading: impl FnOnce() -> Heading,
    out: &Path,
    printed: &Printed,
    is_resumed: bool,
) -> Result<u8, CommandError> {
    let mut model = read(file)?;
    // The digests of the data are known by now.
    let heading = &heading();
    model.settings.interrupt = Some(interrupt::flag());
    let folder = OutputFolder::prepare(out, fit_claim(&model).inputs(inputs(file)))?;
    if !is_resumed {
        note_discarded(&folder, heading)?;
    }
    let journal = open_journal(&folder, heading, is_resumed)?;
    announce(&model);
    let progress = Progress::new(&model.settings.stopping);
    let (document, status) = fit_into(&folder, &model, &progress, heading.requested, journal)?;
    print_results(&document, folder.path(), printed);
    if status == Status::Interrupted {
        interrupt::say_resumable(folder.path(), "fit");
    }
    Ok(code(&document, printed))
}

/// Reads the data of a model for a fit, with a line of progress.
pub(super) fn read(file: &ModelFile) -> Result<Model, InputError> {
    let _reading = Activity::begin(format!("reading the data of {}", file.path.display()));
    std::thread::scope(|scope| {
        // Without a free thread they are computed when they are asked for.
        let _ = threads::spawn_scoped(scope, || file.digest_data());
        build(file, BuildMode::Fit)
    })
}

/// Exit code of a fit: that of its end, or with `--strict` of its verdict where the fit ended well.
pub(super) fn code(document: &ResultDocument, printed: &Printed) -> u8 {
    let by_end = exit_code(document.outcome.status);
    let level = document.verdict.as_ref().map(|verdict| verdict.level);
    match (by_end, level) {
        (0, Some(VerdictLevel::Inadequate)) if printed.strict => INADEQUATE,
        (0, Some(VerdictLevel::Check)) if printed.strict => CHECK,
        _ => by_end,
    }
}

/// Notes that unfinished work of the same command on the same inputs is discarded.
///
/// # Errors
/// If the folder holds unfinished work on other inputs.
pub(super) fn note_discarded(folder: &OutputFolder, heading: &Heading) -> Result<(), InputError> {
    if folder.discards(heading)? {
        say(
            "note",
            format!(
                "Discarding the unfinished {} in this folder and starting over; use `kmcfit resume` to continue one.",
                match heading.command.as_str() {
                    "compare" => "comparison",
                    command => command,
                }
            ),
        );
    }
    Ok(())
}

/// Opens the journal of a fit: a new one, or to resume an older one, which is refused if an input has changed.
pub(super) fn open_journal(
    folder: &OutputFolder,
    heading: &Heading,
    is_resumed: bool,
) -> Result<FitJournal, InputError> {
    match is_resumed {
        true => FitJournal::resume(folder.path(), heading),
        false => FitJournal::begin(folder.path(), heading)
            .map_err(|error| unwritable(folder.path(), &error)),
    }
}

/// Prints the results of a fit.
pub(super) fn print_results(document: &ResultDocument, folder: &Path, printed: &Printed) {
    if printed.json {
        return print(&json(document));
    }
    let width = || {
        let size = Term::stdout().size_checked();
        size.map_or(PIPED, |(_, columns)| columns.into())
    };
    // A table that cannot be read is an error of `--plot` only.
    let is_small = !printed.plots.plot && !printed.plots.no_plot && draws_small_plots();
    let small = is_small.then(|| summary_plot(folder, document, width()).ok());
    let small = small.flatten().flatten();
    print(&summary(document, printed.verbose, small.as_deref()));
    if printed.plots.plot {
        match charts(folder, document, width()) {
            Ok(text) => print(&text),
            Err(error) => say("warning", format!("no plot: {error}")),
        }
    }
    if printed.timings {
        print(&format!("\n{}\n", document.timings.text()));
    }
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

/// Fits a model and writes all files of the run. An older run in the folder stays unchanged until the new one is complete.
pub(super) fn fit_into(
    folder: &OutputFolder,
    model: &Model,
    progress: &Progress,
    requested: RequestedFiles,
    mut journal: FitJournal,
) -> Result<(ResultDocument, Status), CommandError> {
    let clock = Instant::now();
    let full = |error| unwritable(folder.path(), &error);
    let result = search(model, progress, Some(&mut journal));
    if let Some(trouble) = journal.trouble() {
        say(
            "warning",
            format!("the journal of the fit could not be written: {trouble}"),
        );
    }
    let (model, path, found) = match result {
        Ok(found) => found,
        Err(reason) => {
            let document = FailureDocument::new(&model.title, &reason);
            let stage = folder.stage().map_err(full)?;
            stage.write(RESULT, json(&document)).map_err(full)?;
            stage.commit().map_err(full)?;
            FitJournal::clear(folder.path()).map_err(full)?;
            return Err(CommandError::Numerical(reason));
        }
    };
    let model = &model;
    let activity = Activity::begin(progress.named_stage("assessing the fit"));
    let analysis = Instant::now();
    let predictions = model_predictions(model, &found);
    let run_assessment = RunAssessment::of(model, &found);
    let analysis = analysis.elapsed();
    let report = Instant::now();
    let run = FittedModel {
        run_assessment: &run_assessment,
        model,
        fit: &found,
        predictions: &predictions,
        weights: path.as_ref(),
        requested,
        display: DisplayUnits::default(),
        computed: Default::default(),
    };
    let mut document = run.document_and_figures();
    let draws = run.draws();
    let stage = folder.stage().map_err(full)?;
    activity.stage(progress.named_stage("writing the results"));
    let writing = run.write(&stage, &document).map_err(full)?;
    drop(activity);
    match draws {
        Some(Ok(table)) => stage.write(DRAWS, table.to_csv()).map_err(full)?,
        Some(Err(reason)) => say("warning", no_draws(reason)),
        None => {}
    }
    let before = &model.preparation;
    let overhead = OverheadTimings {
        io: before.reading + writing,
        analysis,
        report: report.elapsed().saturating_sub(writing),
    };
    // The time of a resumed fit includes its earlier parts.
    let total = (before.total + clock.elapsed()).max(overhead.sum() + found.elapsed);
    document.timings = TimingsSummary::new(&found, &overhead, total);
    stage.write(RESULT, json(&document)).map_err(full)?;
    stage.commit().map_err(full)?;
    let status = found.outcome.status;
    if status != Status::Interrupted {
        FitJournal::clear(folder.path()).map_err(full)?;
    }
    Ok((document, status))
}

/// The reason for a run without draws.
fn no_draws(reason: NoDraws) -> String {
    match reason {
        NoDraws::NoCovariance => {
            "no draws: the estimates have no covariance, or more than 64 parameters"
        }
        NoDraws::Constraints => "no draws: fewer than one in a thousand satisfies the constraints",
    }
    .to_owned()
}

/// Runs the fit. Also returns the model as fitted, with the path of weights if a rule chose one.
pub(super) fn search(
    model: &Model,
    progress: &Progress,
    store: Option<&mut dyn CheckpointStore>,
) -> Result<(Model, Option<WeightPath>, Fit), String> {
    let (mut ignore, mut show) = (
        |_: &IterationRecord| {},
        |moment: &IterationEvent| progress.show(moment),
    );
    let mut watch = Observer::new(&mut ignore);
    if progress.is_visible() {
        watch = watch.with_events(&mut show);
    }
    if let Some(store) = store {
        watch = watch.with_checkpoints(store);
    }
    let result = fit_or_no_response(model, &mut watch);
    progress.clear();
    result
        .map(|found| (found.model, found.weights, found.fit))
        .map_err(|breakdown| format!("the start cannot be evaluated: {breakdown}"))
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
