//! `kmcfit fit`

use super::progress::Progress;
use super::{Failure, exit_code, interrupt, print, unwritable};
use crate::config::{Model, ModelFile, Purpose, WeightSearch, build};
use crate::dynamics::{Breakdown, State};
use crate::report::document::{FailureDocument, Prediction, ResultDocument};
use crate::report::{Known, OutputFolder, Run, TimingsSummary, json, predict, summary};
use crate::solvers::{Fit, Row, Status, WeightPath, choose_weight, fit_with_noise, without_motion};
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
    /// Print the result document instead of the summary.
    #[arg(long)]
    json: bool,
    /// Write no figures and no page.
    #[arg(long)]
    no_report: bool,
    /// Print where the time went.
    #[arg(long)]
    timings: bool,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let file = ModelFile::read(&arguments.model)?;
    let mut model = build(&file, Purpose::Fit)?;
    model.settings.interrupt = Some(interrupt::flag());
    let folder = OutputFolder::prepare(&output_path(arguments))?;
    for remark in &model.remarks {
        eprintln!("note: {remark}");
    }
    for warning in &model.warnings {
        eprintln!("warning: {warning}");
    }
    let progress = Progress::new(model.settings.stopping.iterations);
    let (document, status) = fit_into(&folder, &model, &progress, !arguments.no_report)?;
    if arguments.json {
        print(&json(&document));
    } else {
        print(&summary(&document));
        if arguments.timings {
            print(&format!("\n{}\n", document.timings.text()));
        }
        print(&format!("results in {}\n", folder.path().display()));
    }
    Ok(exit_code(status))
}

/// Fits a model and writes everything that the run leaves behind into a folder.
pub(super) fn fit_into(
    folder: &OutputFolder,
    model: &Model,
    progress: &Progress,
    with_figures: bool,
) -> Result<(ResultDocument, Status), Failure> {
    let clock = Instant::now();
    // A folder holds a result only of the run that wrote the rest of it.
    folder
        .begin()
        .map_err(|error| unwritable(folder.path(), &error))?;
    let (weighted, path, found) = match search(model, progress) {
        Ok(found) => found,
        Err(reason) => {
            let document = FailureDocument::new(&model.title, &reason);
            folder
                .write("result.json", &json(&document))
                .map_err(|error| unwritable(folder.path(), &error))?;
            return Err(Failure::Numerical(reason));
        }
    };
    let model = weighted.as_ref().unwrap_or(model);
    let predictions = predictions(model, &found);
    let known = Known::of(model, &found);
    let run = Run {
        known: &known,
        model,
        fit: &found,
        predictions: &predictions,
        weights: path.as_ref(),
    };
    let full = |error| unwritable(folder.path(), &error);
    let mut document = run.document();
    let writing = run.write(folder, &document, with_figures).map_err(full)?;
    let before = &model.preparation;
    document.timings = TimingsSummary::new(
        &found,
        before.reading + writing,
        before.total + clock.elapsed(),
    );
    folder
        .write("result.json", &json(&document))
        .map_err(full)?;
    Ok((document, found.outcome.status))
}

/// The fit; where a rule chooses the weight of the smoothness also the model with that weight and
/// the path on which it was chosen.
pub(super) fn search(
    model: &Model,
    progress: &Progress,
) -> Result<(Option<Model>, Option<WeightPath>, Fit), String> {
    let start = model.problem.functions.start();
    let mut observe = |row: &Row| progress.show(row);
    let (problem, settings) = (&model.problem, &model.settings);
    let result = match &model.weight_rule {
        None => fit_with_noise(problem, &start, settings, &mut observe).map(|(problem, fit)| {
            let with_sigmas = Model {
                problem,
                ..model.clone()
            };
            (Some(with_sigmas), None, fit)
        }),
        Some(WeightSearch { rule, penalties }) => {
            choose_weight(problem, &start, settings, *rule, penalties, &mut observe).map(
                |(path, problem, fit)| {
                    let weighted = Model {
                        problem,
                        ..model.clone()
                    };
                    (Some(weighted), Some(path), fit)
                },
            )
        }
    };
    progress.clear();
    let result = result.or_else(|breakdown| {
        let fit = without_motion(problem, &model.given_start, settings, breakdown)?;
        Ok((None, None, fit))
    });
    result.map_err(|breakdown: Breakdown| format!("the start cannot be evaluated: {breakdown}"))
}

/// The predictions that the model asks for; one without a motion says so and harms no other.
fn predictions(model: &Model, found: &Fit) -> Vec<Prediction> {
    let device = &found.best.evaluation.device;
    let oscillator = &model.problem.oscillator;
    let one = |state: &State| {
        let motions = predict(oscillator, device, model.truth.as_ref(), &[*state]);
        match motions {
            Ok(motions) => motions.into_iter().map(|m| m.summary).collect(),
            Err(breakdown) => vec![Prediction {
                displacement: state.displacement,
                velocity: state.velocity,
                cost: None,
                energy: None,
                failure: Some(breakdown.to_string()),
            }],
        }
    };
    model.predictions.iter().flat_map(one).collect()
}

/// `runs/NAME` with the name of the model file.
fn output_path(arguments: &Arguments) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| {
        let name = arguments.model.file_stem().unwrap_or_default();
        Path::new("runs").join(name)
    })
}
