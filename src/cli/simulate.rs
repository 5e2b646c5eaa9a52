//! `kmcfit simulate`

use super::{Failure, OK, print, unwritable};
use crate::config::{ModelFile, Purpose, build};
use crate::error::{InputError, Place};
use crate::problem::Experiment;
use crate::report::{CsvTable, write_whole};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::path::PathBuf;

/// Compute the motion of a model's device (its fixed and start values) and write it as readings.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file (YAML).
    model: PathBuf,
    /// CSV file for the readings [default: standard output].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Number of nodes instead of the model's.
    #[arg(long)]
    nodes: Option<usize>,
    /// Standard deviation of Gaussian noise on the readings, m.
    #[arg(long, value_name = "SIGMA", requires = "seed")]
    noise: Option<f64>,
    /// Seed of the noise (ChaCha8).
    #[arg(long, requires = "noise")]
    seed: Option<u64>,
    /// Name of the experiment to simulate [default: the first].
    #[arg(long)]
    experiment: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let file = ModelFile::read(&arguments.model)?;
    let purpose = Purpose::Simulate {
        nodes: arguments.nodes,
    };
    let problem = build(&file, purpose)?.problem;
    let noise = noise(arguments)?;
    let experiment = chosen(arguments, &problem.experiments)?;
    let device = problem.functions.device(&problem.functions.start());
    let motion = problem
        .oscillator
        .forward(&device, experiment.initial, experiment.force.as_deref())
        .map_err(|breakdown| Failure::Numerical(format!("no motion: {breakdown}")))?;
    let mut readings = motion.displacement;
    if let Some((sigma, mut random)) = noise {
        for y in &mut readings {
            *y += sigma * standard_normal(&mut random);
        }
    }
    let table = CsvTable::new()
        .column("t_s", problem.oscillator.grid.times())
        .column("y_m", readings)
        .to_csv();
    match &arguments.out {
        None => print(&table),
        Some(path) => write_whole(path, &table).map_err(|error| unwritable(path, &error))?,
    }
    Ok(OK)
}

fn standard_normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

fn noise(arguments: &Arguments) -> Result<Option<(f64, ChaCha8Rng)>, InputError> {
    match (arguments.noise, arguments.seed) {
        (Some(sigma), _) if !(sigma.is_finite() && sigma >= 0.0) => Err(InputError::new(
            Place::Argument("--noise".into()),
            "a standard deviation cannot be this",
        )
        .found(sigma)
        .expected("a finite number, 0 or greater, in m")),
        (Some(sigma), Some(seed)) => Ok(Some((sigma, ChaCha8Rng::seed_from_u64(seed)))),
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
        let names: Vec<&str> = experiments.iter().map(|e| e.name.as_str()).collect();
        InputError::new(
            Place::Argument("--experiment".into()),
            "the model has no such experiment",
        )
        .found(arguments.experiment.clone().unwrap_or_default())
        .expected(format!("one of {}", names.join(", ")))
    })
}
