//! `kmcfit fit`

use super::progress::Progress;
use super::{
    Failure, Overrides, announce, exit_code, inputs, interrupt, print, say, stem, unwritable,
};
use crate::config::{Model, ModelFile, Override, Purpose, WeightSearch, build};
use crate::error::InputError;
use crate::report::document::{FailureDocument, Prediction, ResultDocument};
use crate::report::{
    Around, FittedModel, Known, TimingsSummary, charts, fit_claim, json, predict, summary,
};
use crate::results::{FitJournal, Heading, OutputFolder, RESULT};
use console::Term;
use kmcfit_core::internals::simulate::SimulationError;
use kmcfit_core::internals::solvers::{
    CheckpointStore, Fit, IterationEvent, IterationRecord, Observer, Status, WeightPath,
    choose_weight_watched, fit_with_noise_watched, no_response,
};
use kmcfit_core::internals::system::State;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Fit the functions of a model to its data; write result, tables and figures.
#[derive(Debug, clap::Args)]
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
    /// Write no figures and no page.
    #[arg(long)]
    no_report: bool,
    /// Print where the time went.
    #[arg(long)]
    timings: bool,
    /// Draw readings, fit and functions in the terminal.
    #[arg(long, conflicts_with = "json")]
    plot: bool,
    /// Least time between two checkpoints, from which `resume` goes on after the fit was killed [default:
    /// 1 s, and more where they take more than 2 % of the time].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    checkpoint: Option<f64>,
}

/// Columns of a chart where there is no terminal.
const PIPED: usize = 80;

/// What is printed at the end.
pub(super) struct Printed {
    pub json: bool,
    pub timings: bool,
    pub plot: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    if let Some(seconds) = arguments.checkpoint.filter(|s| !(0.0..=1e9).contains(s)) {
        return Err(InputError::argument("--checkpoint", "no time can be this")
            .found(seconds)
            .expected("a number of seconds, 0 (after every iteration) or greater")
            .into());
    }
    let file = arguments.set.read(&arguments.model)?;
    let own = || Path::new("runs").join(stem(&arguments.model));
    let printed = Printed {
        json: arguments.json,
        timings: arguments.timings,
        plot: arguments.plot,
    };
    let heading = Heading::of_model("fit", &file, !arguments.no_report, arguments.checkpoint);
    let out = arguments.out.clone().unwrap_or_else(own);
    fit(&file, &heading, &out, &printed, false)
}

/// Goes on with a fit that did not come to its end.
pub(super) fn go_on(place: &Path, heading: &Heading, printed: &Printed) -> Result<u8, Failure> {
    let path = heading.inputs.first().cloned().unwrap_or_default();
    let file = ModelFile::read_with(path, &Override::parse_all(&heading.overrides)?)?;
    let now = Heading::of_model("fit", &file, heading.figures, heading.checkpoint);
    fit(&file, &now, place, printed, true)
}

fn fit(
    file: &ModelFile,
    heading: &Heading,
    out: &Path,
    printed: &Printed,
    is_resumed: bool,
) -> Result<u8, Failure> {
    let mut model = build(file, Purpose::Fit)?;
    model.settings.interrupt = Some(interrupt::flag());
    let folder = OutputFolder::prepare(out, fit_claim(&model).inputs(inputs(file)))?;
    if !is_resumed {
        note_discarded(&folder, heading)?;
    }
    let journal = open_journal(&folder, heading, is_resumed)?;
    announce(&model);
    let progress = Progress::new(&model.settings.stopping);
    let (document, status) = fit_into(&folder, &model, &progress, heading.figures, journal)?;
    tell(&document, folder.path(), printed);
    if status == Status::Interrupted {
        interrupt::say_resumable(folder.path(), "fit");
    }
    Ok(exit_code(status))
}

/// Says that unfinished work of the same command on the same inputs is discarded.
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

/// The journal of a fit: resumed, which is refused where an input has changed, or begun.
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

/// Prints what a run came to.
pub(super) fn tell(document: &ResultDocument, folder: &Path, printed: &Printed) {
    if printed.json {
        return print(&json(document));
    }
    print(&summary(document));
    if printed.plot {
        let width = Term::stdout()
            .size_checked()
            .map_or(PIPED, |(_, columns)| columns.into());
        match charts(folder, document, width) {
            Ok(text) => print(&text),
            Err(error) => say("warning", format!("nothing could be drawn: {error}")),
        }
    }
    if printed.timings {
        print(&format!("\n{}\n", document.timings.text()));
    }
    print(&format!("results in {}\n", folder.display()));
}

/// Fits a model and writes everything that the run leaves behind into a folder. An older run there
/// stays as it is until the new one is complete.
pub(super) fn fit_into(
    folder: &OutputFolder,
    model: &Model,
    progress: &Progress,
    with_figures: bool,
    mut journal: FitJournal,
) -> Result<(ResultDocument, Status), Failure> {
    let clock = Instant::now();
    let full = |error| unwritable(folder.path(), &error);
    let result = search(model, progress, Some(&mut journal));
    if let Some(trouble) = journal.trouble() {
        say(
            "warning",
            format!("the journal of the fit could not be written: {trouble}"),
        );
    }
    let (weighted, path, found) = match result {
        Ok(found) => found,
        Err(reason) => {
            let document = FailureDocument::new(&model.title, &reason);
            let mut stage = folder.stage().map_err(full)?;
            stage.write(RESULT, &json(&document)).map_err(full)?;
            stage.commit().map_err(full)?;
            FitJournal::clear(folder.path()).map_err(full)?;
            return Err(Failure::Numerical(reason));
        }
    };
    let model = weighted.as_ref().unwrap_or(model);
    let analysis = Instant::now();
    let predictions = predictions(model, &found);
    let known = Known::of(model, &found);
    let analysis = analysis.elapsed();
    let report = Instant::now();
    let run = FittedModel {
        known: &known,
        model,
        fit: &found,
        predictions: &predictions,
        weights: path.as_ref(),
    };
    let mut document = run.document();
    let mut stage = folder.stage().map_err(full)?;
    let writing = run
        .write(&mut stage, &document, with_figures)
        .map_err(full)?;
    let before = &model.preparation;
    let around = Around {
        io: before.reading + writing,
        analysis,
        report: report.elapsed().saturating_sub(writing),
    };
    // A fit that was gone on with took longer than this clock saw.
    let total = (before.total + clock.elapsed()).max(around.sum() + found.elapsed);
    document.timings = TimingsSummary::new(&found, &around, total);
    stage.write(RESULT, &json(&document)).map_err(full)?;
    stage.commit().map_err(full)?;
    let status = found.outcome.status;
    if status != Status::Interrupted {
        FitJournal::clear(folder.path()).map_err(full)?;
    }
    Ok((document, status))
}

/// The fit; where a rule chooses the weight of the smoothness also the model with that weight and
/// the path on which it was chosen.
pub(super) fn search(
    model: &Model,
    progress: &Progress,
    keeper: Option<&mut dyn CheckpointStore>,
) -> Result<(Option<Model>, Option<WeightPath>, Fit), String> {
    let start = model.problem.functions.start();
    let (mut ignore, mut show) = (
        |_: &IterationRecord| {},
        |moment: &IterationEvent| progress.show(moment),
    );
    let mut watch = Observer::new(&mut ignore);
    if progress.is_seen() {
        watch = watch.looking(&mut show);
    }
    if let Some(keeper) = keeper {
        watch = watch.keeping(keeper);
    }
    let (problem, settings) = (&model.problem, &model.settings);
    let result = match &model.weight_rule {
        None => fit_with_noise_watched(problem, &start, settings, &mut watch)
            .map(|(problem, fit)| (None, problem, fit)),
        Some(WeightSearch { rule, penalties }) => {
            choose_weight_watched(problem, &start, settings, *rule, penalties, &mut watch)
                .map(|(path, problem, fit)| (Some(path), problem, fit))
        }
    };
    progress.clear();
    let result = result.map(|(path, problem, fit)| {
        let as_fitted = Model {
            problem,
            ..model.clone()
        };
        (Some(as_fitted), path, fit)
    });
    let result = result.or_else(|breakdown| {
        let fit = no_response(problem, &model.given_start, settings, breakdown)?;
        Ok((None, None, fit))
    });
    result
        .map_err(|breakdown: SimulationError| format!("the start cannot be evaluated: {breakdown}"))
}

/// The predictions that the model asks for; one without a motion says so and harms no other.
fn predictions(model: &Model, found: &Fit) -> Vec<Prediction> {
    let device = &found.best.evaluation.nodal;
    let system = &model.problem.system;
    let one = |state: &State| {
        let motions = predict(system, device, model.truth.as_ref(), &[*state]);
        match motions {
            Ok(motions) => motions.into_iter().map(|m| m.summary).collect(),
            Err(breakdown) => vec![Prediction {
                displacement: state.displacement,
                velocity: state.velocity,
                cost: None,
                energy: None,
                largest: None,
                last: None,
                failure: Some(breakdown.to_string()),
            }],
        }
    };
    model.predictions.iter().flat_map(one).collect()
}
