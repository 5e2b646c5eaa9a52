//! `kmcfit simulate`: simulates a model and writes the response, with noise if asked, as a record.

use super::progress::Activity;
use super::{CommandError, OK, Overrides, inputs, print, say, unwritable};
use crate::config::{BuildMode, ModelFile, build};
use crate::digest::{digest, digest_of_file};
use crate::error::InputError;
use crate::report::{CsvTable, json};
use crate::results::write_together;
use crate::text_io::{quote, read_text};
use kmcfit_core::record::Experiment;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use serde_json::Value;
use std::io;
use std::path::{Path, PathBuf};

/// Simulate a model with its fixed and start values; write the response as a record.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit simulate model.yaml --noise 0.01 --seed 1 --out record.csv"
)]
pub struct Arguments {
    /// Model file (YAML).
    model: PathBuf,
    /// CSV file for the record; OUT.json has its origin [default: standard output].
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: Overrides,
    /// Number of nodes instead of the model's.
    #[arg(long)]
    nodes: Option<usize>,
    /// Standard deviation of added Gaussian noise, m.
    #[arg(
        long,
        value_name = "SIGMA",
        requires = "seed",
        allow_negative_numbers = true
    )]
    noise: Option<f64>,
    /// Seed of the noise (ChaCha8).
    #[arg(long, requires = "noise")]
    seed: Option<u64>,
    /// Name of the experiment to simulate [default: the first].
    #[arg(long)]
    experiment: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let file = arguments.set.read(&arguments.model)?;
    let mode = BuildMode::Simulate {
        nodes: arguments.nodes,
    };
    let reading = Activity::begin(format!("reading the data of {}", file.path.display()));
    let problem = build(&file, mode)?.problem;
    drop(reading);
    let noise = noise(arguments)?;
    if let Some(out) = &arguments.out {
        check_location(out, &file)?;
    }
    let experiment = chosen(arguments, &problem.experiments)?;
    if !experiment.begins_known() {
        return Err(file
            .error_at(
                "experiments",
                "the initial state is estimated; a simulation needs its values",
            )
            .found(format!("`estimate` in `{}`", experiment.name))
            .expected("an experiment with an initial state in numbers")
            .into());
    }
    let (functions, start) = (&problem.functions, problem.start());
    let mut coefficients = functions.empty_nodal();
    functions.nodal_into(&start, experiment.coefficient_set, &mut coefficients);
    let simulating = Activity::begin("simulating");
    let response = problem
        .system
        .forward(
            &coefficients,
            &experiment.initial,
            experiment.excitation.as_ref(),
        )
        .map_err(|breakdown| CommandError::Numerical(format!("no response: {breakdown}")))?;
    let mut samples = response.displacement(0).to_vec();
    if let Some(noise) = &noise {
        let mut random = ChaCha8Rng::seed_from_u64(noise.seed);
        for y in &mut samples {
            let z: f64 = StandardNormal.sample(&mut random);
            *y += noise.sigma * z;
        }
    }
    let table = CsvTable::new()
        .column("t_s", problem.system.grid.times())
        .column("y_m", samples)
        .to_csv();
    drop(simulating);
    let record = Provenance {
        made_by: MADE_BY,
        version: env!("CARGO_PKG_VERSION"),
        sha256: digest(table.as_bytes()),
        model: arguments.model.display().to_string(),
        overrides: file.override_texts(),
        experiment: &experiment.name,
        nodes: problem.system.grid.nodes(),
        duration: problem.system.grid.duration(),
        stepper: problem.system.method.name(),
        noise,
    };
    match &arguments.out {
        None => {
            print(&table);
            if let Some(Noise { sigma, seed, .. }) = record.noise {
                say("noise", format!("sigma {sigma} m, seed {seed}"));
            }
        }
        Some(path) => {
            // The provenance first, so that samples with noise never exist without their seed.
            let files = [(&*record_path(path), &*json(&record)), (path, &table)];
            write_together(&files).map_err(|error| unwritable(path, &error))?;
        }
    }
    Ok(OK)
}

/// Name of the command in the provenance file of each record.
const MADE_BY: &str = "kmcfit simulate";

/// Refuses to write over an input of the model, or over a file that this command did not write.
fn check_location(out: &Path, file: &ModelFile) -> Result<(), InputError> {
    let target = out.canonicalize().ok();
    for input in inputs(file) {
        if target.is_some() && input.canonicalize().ok() == target {
            return Err(
                InputError::argument("--out", "this file is an input of the model")
                    .found(out.display())
                    .expected("another file, so that no measurement is lost"),
            );
        }
    }
    if out.is_dir() {
        let error = io::Error::other("this is a folder, not a file");
        return Err(unwritable(out, &error));
    }
    let beside = record_path(out);
    let taken = [out, &beside]
        .into_iter()
        .find(|path| path.symlink_metadata().is_ok());
    match taken.filter(|_| !is_own(out, &beside)) {
        Some(taken) => Err(InputError::argument(
            "--out",
            "the file exists, and is not an unchanged output of `kmcfit simulate`",
        )
        .found(taken.display())
        .expected("a new file, or an unchanged output of this command with its OUT.json")),
        None => Ok(()),
    }
}

/// True if this command wrote the table and its provenance file, which has the digest of the table; the table may be missing.
fn is_own(out: &Path, beside: &Path) -> bool {
    let known = read_text(
        beside,
        "the record of simulated measurements",
        LONGEST_RECORD,
    )
    .ok();
    let known: Option<Value> = known.and_then(|text| serde_json::from_str(&text).ok());
    known.is_some_and(|known| {
        let is_same = |found: String| known["sha256"] == *found;
        known["made_by"] == MADE_BY
            && (out.symlink_metadata().is_err() || digest_of_file(out).is_ok_and(is_same))
    })
}

/// Longest provenance file that is read, bytes; one has some hundred bytes besides its paths and values.
const LONGEST_RECORD: u64 = 1 << 20;

/// Path of the provenance file of a table.
fn record_path(out: &Path) -> PathBuf {
    let mut beside = out.as_os_str().to_owned();
    beside.push(".json");
    beside.into()
}

/// Provenance of a simulated record: `OUT.json` beside `OUT`.
#[derive(Debug, Serialize)]
struct Provenance<'a> {
    made_by: &'static str,
    version: &'static str,
    /// Digest of the table: the proof that this command wrote it.
    sha256: String,
    /// Path of the model file as given on the command line.
    model: String,
    /// Overrides.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    overrides: Vec<String>,
    experiment: &'a str,
    nodes: usize,
    /// s.
    duration: f64,
    stepper: &'static str,
    /// `null` for samples without noise.
    noise: Option<Noise>,
}

/// Reproducible Gaussian noise.
#[derive(Debug, Serialize)]
struct Noise {
    /// Standard deviation, m.
    sigma: f64,
    seed: u64,
    generator: &'static str,
}

fn noise(arguments: &Arguments) -> Result<Option<Noise>, InputError> {
    match (arguments.noise, arguments.seed) {
        (Some(sigma), _) if !(sigma.is_finite() && sigma >= 0.0) => Err(InputError::argument(
            "--noise",
            "invalid standard deviation",
        )
        .found(sigma)
        .expected("a finite number, 0 or greater, in m")),
        (Some(sigma), Some(seed)) => Ok(Some(Noise {
            sigma,
            seed,
            generator: "ChaCha8, standard normal by the ziggurat method",
        })),
        _ => Ok(None),
    }
}

fn chosen<'a>(
    arguments: &Arguments,
    experiments: &'a [Experiment],
) -> Result<&'a Experiment, InputError> {
    let found = match &arguments.experiment {
        None => experiments.first(),
        Some(name) => experiments.iter().find(|e| e.name == *name),
    };
    found.ok_or_else(|| {
        let names = experiments.iter().map(|e| e.name.as_str());
        InputError::argument("--experiment", "no such experiment in the model")
            .found(quote(arguments.experiment.as_deref().unwrap_or_default()))
            .expected(format!(
                "one of the experiments of the model: {}",
                names.map(quote).collect::<Vec<_>>().join(", ")
            ))
    })
}
