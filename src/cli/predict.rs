//! `kmcfit predict`: simulates the free response of an identified system from other initial states.

use super::{CommandError, OK, print, unwritable};
use crate::error::InputError;
use crate::report::{
    CsvTable, PredictedResponse, Run, figures, json, predict, prediction_table, render,
};
use crate::results::{Claim, OutputFolder};
use kmcfit_core::internals::system::State;
use std::path::PathBuf;

/// Predict the free response of an identified system from other initial states.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit predict runs/model --initial 3.3,1.0 --initial 0,2")]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
    /// Initial displacement (m or rad) and velocity (m/s or rad/s); may be repeated.
    #[arg(long, value_name = "Y,V", required = true, allow_hyphen_values = true)]
    initial: Vec<String>,
    /// Folder for the table and the figure of the responses.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the predictions as JSON.
    #[arg(long)]
    json: bool,
}

/// The files in the output folder.
const FILES: [&str; 2] = ["predictions.csv", "figures/predictions.svg"];

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let states: Vec<State> = arguments
        .initial
        .iter()
        .map(|text| state(text))
        .collect::<Result<_, _>>()?;
    let run = Run::open(&arguments.run)?;
    let folder = (arguments.out.as_deref())
        .map(|out| {
            let claim = Claim::new("predict").files(FILES);
            OutputFolder::prepare(out, claim)
        })
        .transpose()?;
    let responses = predict(&run.system, &run.coefficients, run.truth.as_ref(), &states).map_err(
        |breakdown| CommandError::Numerical(format!("--initial: no response: {breakdown}")),
    )?;
    if let Some(folder) = folder {
        let unit = if run.document.is_rotation() {
            "rad"
        } else {
            "m"
        };
        write(&folder, &run.system.grid.times(), &responses, unit)
            .map_err(|error| unwritable(folder.path(), &error))?;
    }
    let summaries: Vec<_> = responses.into_iter().map(|m| m.summary).collect();
    match arguments.json {
        true => print(&json(&summaries)),
        false => print(&prediction_table(&summaries, run.document.is_rotation())),
    }
    Ok(OK)
}

fn state(text: &str) -> Result<State, InputError> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .filter(|x: &f64| x.is_finite())
        .collect();
    match numbers.as_slice() {
        &[displacement, velocity] if text.split(',').count() == 2 => Ok(State {
            displacement,
            velocity,
        }),
        _ => Err(InputError::argument("--initial", "invalid initial state")
            .found(format!("`{text}`"))
            .expected("two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1")),
    }
}

fn write(
    folder: &OutputFolder,
    times: &[f64],
    responses: &[PredictedResponse],
    unit: &str,
) -> std::io::Result<()> {
    let mut table = CsvTable::new().column("t_s", times.to_vec());
    for (i, predicted) in responses.iter().enumerate() {
        let header = format!("y_{unit}_{}", i + 1);
        table = table.column(header, predicted.response.displacement.clone());
        if let Some(truth) = &predicted.truth {
            table = table.column(
                format!("true_y_{unit}_{}", i + 1),
                truth.displacement.clone(),
            );
        }
    }
    let figure = figures::predictions(times, responses);
    let mut stage = folder.stage()?;
    let [table_name, figure_name] = FILES;
    stage.write(table_name, &table.to_csv())?;
    stage.write(figure_name, &render(&figure))?;
    stage.commit()
}
