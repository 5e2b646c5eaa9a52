//! `kmcfit demo`: the paper's record, fitted without constraints and with physical ones, side by side.

use super::compare::{Entry, compared, exit_code_of};
use super::{CommandError, print, unwritable};
use crate::config::ModelFile;
use crate::error::InputError;
use crate::report::compare::{Comparison, Measures};
use crate::report::document::{Verdict, level_in_words};
use crate::report::{CsvTable, Run};
use crate::results::OutputFolder;
use kmcfit_core::number_format::significant;
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{Grid, Method, NodalCoefficients, State, System};
use std::path::PathBuf;
use std::sync::Arc;

/// Models of the demonstration, by path in its folder.
const MODELS: [(&str, &str); 2] = [
    ("models/paper.yaml", include_str!("../../models/paper.yaml")),
    (
        "models/physical.yaml",
        include_str!("../../models/paper-smooth.yaml"),
    ),
];

/// Record and system of the demonstration, by path in its folder.
const DATA: [&str; 2] = ["data/paper.csv", "data/paper_truth.csv"];

/// Number of nodes and duration (s) of the record.
const NODES: usize = 2000;
const DURATION: f64 = 25.0;

/// The tables [`DATA`], as they stand in the sources: `m_i = 1 - 0.5 (i + 1)/2000` kg, `c = 0`, `k = 1` N/m, and the response from
/// `y(0) = 3.3` m, `v(0) = 1` m/s by the midpoint rule.
fn tables() -> Result<[String; 2], CommandError> {
    let grid = Grid::new(0.0, DURATION, NODES).expect("a grid of these constants");
    let mass = (0..NODES).map(|i| 1.0 - 0.5 * (i + 1) as f64 / NODES as f64);
    let (damping, stiffness) = (vec![0.0; NODES], vec![1.0; NODES]);
    let coefficients = NodalCoefficients {
        inertias: vec![mass.collect()],
        coefficients: vec![damping.clone(), stiffness.clone()],
    };
    let system = System {
        grid,
        method: Method::Midpoint,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let initial = State::one(3.3, 1.0);
    let response = system.forward(&coefficients, &initial, None);
    let response =
        response.map_err(|error| CommandError::Numerical(format!("no response: {error}")))?;
    let record = CsvTable::new()
        .column("t_s", grid.times())
        .column("y_m", response.displacement(0).to_vec());
    let truth = CsvTable::new()
        .column("t_s", grid.times())
        .column("mass_kg", coefficients.inertias[0].clone())
        .column("damping_N_s_per_m", damping)
        .column("stiffness_N_per_m", stiffness);
    Ok([record.to_csv(), truth.to_csv()])
}

/// Introduction, printed above the results.
const INTRODUCTION: &str = "\
Record: displacement of a free response over 25 s, 2000 samples without noise. In the system that was simulated
the mass falls from 1 to 0.5 kg, k = 1 N/m, and there is no damping. Two fits of m, c and k at every sample:
  paper     by the misfit alone, as in the paper
  physical  m, c and k positive and smooth, k(0) = 1 N/m
";

/// Fit the paper's record without constraints and with physical ones, side by side; needs no files.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit demo --out runs/demo")]
pub struct Arguments {
    /// Folder for models, data and results.
    #[arg(long, default_value = "runs/demo")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let out = &arguments.out;
    let folder = OutputFolder::prepare(out, "demo", [])?;
    let tables = DATA.into_iter().zip(tables()?);
    let models = MODELS
        .into_iter()
        .map(|(name, text)| (name, text.to_owned()));
    let files: Vec<(&str, String)> = models.chain(tables).collect();
    let full = |error| unwritable(out, &error);
    for (name, text) in &files {
        folder.write(name, text).map_err(full)?;
    }
    // The paths in the models lead from their folder to the data.
    let data = files
        .iter()
        .map(|(name, text)| (format!("../{name}"), Arc::from(text.as_bytes())));
    let data: Vec<(String, Arc<[u8]>)> = data.collect();
    let entry = |(name, text): (&str, &str)| {
        let path = out.join(name);
        let stem = super::stem(&path);
        let file = ModelFile::parse(path, text)?.with_files(data.clone());
        Ok((stem, Entry::of_model(file)?))
    };
    let entries = MODELS
        .into_iter()
        .map(entry)
        .collect::<Result<Vec<_>, InputError>>()?;
    let comparison = compared(entries, &folder, "results/")?;
    folder.commit(&comparison.document()).map_err(full)?;
    print(INTRODUCTION);
    print(&screen(&comparison));
    let location = out.display();
    print(&format!(
        "\nPage   {location}/results/compare.html\n\
         Next   change a key: `kmcfit fit {location}/models/physical.yaml --set functions.damping.penalty.weight=0.01`\n"
    ));
    Ok(exit_code_of(&comparison))
}

/// The verdicts and a table of numbers beside those of the true system.
fn screen(comparison: &Comparison) -> String {
    let runs = comparison.runs();
    let mut text = String::from("\n");
    for run in runs {
        let verdict = run.finished.document.verdict.as_ref();
        let verdict = verdict.map_or_else(String::new, first_reason);
        text += &format!("{:<9} {verdict}\n", run.name);
    }
    let names = runs.iter().map(|run| run.name.clone());
    let mut rows = vec![row("", "true", names)];
    for (label, truth, of) in QUANTITIES {
        let numbers = runs.iter().zip(comparison.measures());
        let numbers = numbers.map(|(run, measures)| match of(&run.finished, measures) {
            None => "–".to_owned(),
            Some(x) if x != 0.0 && x.abs() < EXACT => format!("< {EXACT:e}"),
            Some(x) => significant(x, 3),
        });
        rows.push(row(label, truth, numbers));
    }
    text + "\n" + &rows.concat()
}

fn first_reason(verdict: &Verdict) -> String {
    let reason = verdict
        .reasons
        .first()
        .map_or(&verdict.passed, |r| &r.sentence);
    let reason = reason.split([';', ':']).next().unwrap_or_default();
    format!("{}: {reason}", level_in_words(verdict.level))
}

fn row(label: &str, truth: &str, numbers: impl Iterator<Item = String>) -> String {
    let numbers: String = numbers.map(|number| format!("{number:>12}")).collect();
    format!("{label:<38}{truth:>6}{numbers}\n")
}

/// Numbers below this are rounding errors.
const EXACT: f64 = 1e-6;

/// A row of the table: quantity with its unit, that of the true system, and that of a fit.
type TableRow = (
    &'static str,
    &'static str,
    fn(&Run, &Measures) -> Option<f64>,
);

const QUANTITIES: [TableRow; 8] = [
    ("fit of the displacement (%)", "100", |_, m| m.worst_fit),
    ("mass at 0 s (kg)", "1", |run, _| {
        run.coefficients.inertias[0].first().copied()
    }),
    ("mass at 25 s (kg)", "0.5", |run, _| {
        run.coefficients.inertias[0].last().copied()
    }),
    ("smallest damping (N s/m)", "0", |run, _| {
        run.coefficients.coefficients[0]
            .iter()
            .copied()
            .reduce(f64::min)
    }),
    ("largest damping (N s/m)", "0", |run, _| {
        run.coefficients.coefficients[0]
            .iter()
            .copied()
            .reduce(f64::max)
    }),
    ("largest error of k/m (%)", "", |_, m| {
        Some(100.0 * m.errors?.k_over_m_relative)
    }),
    ("largest error of the mass (%)", "", |_, m| {
        Some(100.0 * m.errors?.mass_relative)
    }),
    ("error from y = -3.3 m, v = 1 m/s (%)", "", |run, _| {
        let mut all = run.document.predictions.iter();
        let prediction = all.find(|p| p.displacement == -3.3)?;
        Some(100.0 * prediction.cost? / prediction.energy?)
    }),
];
