//! `kmcfit predict`: simulates an identified system under another force or motion of the base, or its free response from other initial
//! states.

use super::progress::Activity;
use super::{CommandError, OK, print, unwritable};
use crate::config::NewRecord;
use crate::error::InputError;
use crate::report::{CsvTable, Figure, ForcedPredictions, FreePredictions, Run, json, render};
use crate::results::{OutputFolder, read_lock};
use kmcfit_core::record::ChannelKind;
use kmcfit_core::system::State;
use serde::Serialize;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Predict the response of an identified system to another force, motion of the base or initial state.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit predict runs/model --force new.csv\n  kmcfit predict runs/model --initial 3.3,1.0 --initial 0,2"
)]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
    /// Table of a force over time; measured responses in it score the prediction.
    #[arg(long, value_name = "FILE")]
    force: Option<PathBuf>,
    /// Table of the acceleration or displacement of the base over time.
    #[arg(long, value_name = "FILE")]
    base: Option<PathBuf>,
    /// Initial displacement (m or rad) and velocity (m/s or rad/s); may be repeated [default under a force: at rest].
    #[arg(
        long,
        value_name = "Y,V",
        required_unless_present_any = ["force", "base"],
        allow_hyphen_values = true
    )]
    initial: Vec<String>,
    /// Predicted quantity; may be repeated [default: those measured in the files, or the first channel of the run].
    #[arg(long, value_name = "CHANNEL", value_parser = ["displacement", "velocity", "acceleration"])]
    channel: Vec<String>,
    /// Folder for the table and the figure of the responses.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the predictions as JSON.
    #[arg(long)]
    json: bool,
}

/// Stage shown while responses are computed.
const PREDICTING: &str = "predicting";

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let states: Vec<State> = arguments
        .initial
        .iter()
        .map(|text| state(text))
        .collect::<Result<_, _>>()?;
    let reading = Activity::begin(format!("reading {}", arguments.run.display()));
    // All that is read belongs to one run.
    let lock = read_lock(&arguments.run);
    let run = open(&arguments.run)?;
    drop(reading);
    super::note_changes(&run);
    let files = || arguments.force.iter().chain(&arguments.base).cloned();
    let prepare = || {
        let out = arguments.out.as_deref();
        out.map(|out| OutputFolder::prepare(out, "predict", files()))
            .transpose()
    };
    if files().next().is_some() {
        return forced(arguments, &run, lock, states, prepare);
    }
    if !arguments.channel.is_empty() {
        return Err(InputError::argument(
            "--channel",
            "a free response is predicted as a displacement",
        )
        .found(arguments.channel.join(", "))
        .expected("`--force FILE` or `--base FILE` with `--channel`")
        .into());
    }
    let predicting = Activity::begin(PREDICTING);
    let predictions = FreePredictions::of(&run, &states).map_err(|breakdown| {
        CommandError::Numerical(format!("--initial: no response: {breakdown}"))
    })?;
    drop((predicting, lock));
    let (summaries, table) = (predictions.summaries(), predictions.table());
    let curves = || (predictions.csv(), predictions.figure());
    finish(arguments, prepare()?, curves, &summaries, &table)
}

/// Opens a run; a model file in its place is answered with the commands that make one.
fn open(path: &Path) -> Result<Run, InputError> {
    let extension = path.extension().and_then(|e| e.to_str());
    if path.is_file() && matches!(extension, Some("yaml" | "yml")) {
        let model = path.display();
        let stem = super::stem(path);
        return Err(InputError::file(path, "a model file in place of a run")
            .expected("the folder of a finished run, as written by `kmcfit fit`")
            .hint(format!(
                "fit it first: `kmcfit fit {model}`, then `kmcfit predict runs/{stem} …`"
            )));
    }
    Run::open(path)
}

/// Predicts the response under the inputs of files.
fn forced(
    arguments: &Arguments,
    run: &Run,
    lock: Option<File>,
    mut states: Vec<State>,
    prepare: impl Fn() -> Result<Option<OutputFolder>, InputError>,
) -> Result<u8, CommandError> {
    if run.document.model.mass_unknown
        && let Some(force) = &arguments.force
    {
        return Err(InputError::argument("--force", "the mass of the fitted system is unknown")
            .found(force.display())
            .expected("a motion of the base: `--base FILE`; the response to a force depends on the mass")
            .hint("fit with the mass: `--set functions.mass.fixed=4.5` (kg)")
            .into());
    }
    let (force, base) = (arguments.force.as_deref(), arguments.base.as_deref());
    let record = NewRecord::read(force, base, &run.own_model()?)?;
    if states.is_empty() {
        states.push(State::one(0.0, 0.0));
    }
    let wanted = |kind: &ChannelKind| arguments.channel.iter().any(|name| name == kind.name());
    let kinds: Vec<ChannelKind> = ChannelKind::ALL.into_iter().filter(wanted).collect();
    let predicting = Activity::begin(PREDICTING);
    let found = ForcedPredictions::of(run, &record, &states, &kinds)?;
    drop((predicting, lock));
    let folder = prepare()?;
    let predictions = found.map_err(CommandError::Numerical)?;
    let (summaries, table) = (predictions.summaries(), predictions.table());
    let curves = || (predictions.csv(), predictions.figure());
    finish(arguments, folder, curves, &summaries, &table)
}

fn state(text: &str) -> Result<State, InputError> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .filter(|x: &f64| x.is_finite())
        .collect();
    match numbers.as_slice() {
        &[displacement, velocity] if text.split(',').count() == 2 => {
            Ok(State::one(displacement, velocity))
        }
        _ => Err(InputError::argument("--initial", "invalid initial state")
            .found(format!("`{text}`"))
            .expected("two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1")),
    }
}

/// Writes predictions into the folder, if one is asked for, and prints them.
fn finish(
    arguments: &Arguments,
    folder: Option<OutputFolder>,
    curves: impl FnOnce() -> (CsvTable, Figure),
    summaries: &impl Serialize,
    table: &str,
) -> Result<u8, CommandError> {
    if let Some(folder) = folder {
        let write = || {
            let (curves, figure) = curves();
            folder.write("predictions.csv", curves.to_csv())?;
            folder.write("figures/predictions.svg", render(&figure))?;
            folder.commit(&serde_json::json!({"format": 1, "predictions": summaries}))
        };
        write().map_err(|error| unwritable(folder.shown(), &error))?;
    }
    match arguments.json {
        true => print(&json(summaries)),
        false => print(table),
    }
    Ok(OK)
}
