//! `kmcfit demo`: compares the paper's fit with a constrained one on built-in models and a simulated record.

use super::{CommandError, compare, print, unwritable};
use crate::report::CsvTable;
use crate::results::{Claim, OutputFolder};
use kmcfit_core::internals::system::{Grid, Method, NodalCoefficients, State, System, Term};
use std::path::PathBuf;

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
        mass: mass.collect(),
        coefficients: vec![damping.clone(), stiffness.clone()],
    };
    let system = System {
        grid,
        method: Method::Midpoint,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let initial = State {
        displacement: 3.3,
        velocity: 1.0,
    };
    let response = system.forward(&coefficients, initial, None);
    let response =
        response.map_err(|error| CommandError::Numerical(format!("no response: {error}")))?;
    let record = CsvTable::new()
        .column("t_s", grid.times())
        .column("y_m", response.displacement);
    let truth = CsvTable::new()
        .column("t_s", grid.times())
        .column("mass_kg", coefficients.mass)
        .column("damping_N_s_per_m", damping)
        .column("stiffness_N_per_m", stiffness);
    Ok([record.to_csv(), truth.to_csv()])
}

/// Introduction, printed before the comparison.
const BEFORE: &str = "\
Record: displacement of a free response; the mass halves within 25 s, no damping, k = 1 N/m.
Two fits: the paper's, by the misfit alone, and a physical one, in which m, c and k are positive and smooth
and k(0) = 1 N/m.

";

/// Compare the paper's fit of its record with a physically constrained fit; models are built in, the record is simulated.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit demo --out runs/demo")]
pub struct Arguments {
    /// Folder for models, data and results.
    #[arg(long, default_value = "runs/demo")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let out = &arguments.out;
    let names = MODELS.iter().map(|(name, _)| *name).chain(DATA);
    let folder = OutputFolder::prepare(out, Claim::new("demo").files(names))?;
    let tables = tables()?;
    let results = compare::prepare(&folder, "results")?;
    let write = || {
        let stage = folder.stage()?;
        for (name, text) in MODELS {
            stage.write(name, text)?;
        }
        for (name, text) in DATA.iter().zip(&tables) {
            stage.write(name, text)?;
        }
        stage.commit()
    };
    write().map_err(|error| unwritable(out, &error))?;
    let models = MODELS.map(|(name, _)| out.join(name));
    print(BEFORE);
    let code = compare::run_in(&results, &models)?;
    let place = out.display();
    print(&format!(
        "Models {place}/models; edit one and fit it with `kmcfit fit {place}/models/physical.yaml`\n"
    ));
    Ok(code)
}
