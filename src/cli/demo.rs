//! `kmcfit demo`

use super::{Failure, compare, print, unwritable};
use crate::results::{Claim, OutputFolder};
use std::path::PathBuf;

/// The files of the demonstration, by their place in its folder.
const FILES: [(&str, &str); 4] = [
    ("models/paper.yaml", include_str!("../../models/paper.yaml")),
    (
        "models/physical.yaml",
        include_str!("../../models/paper-smooth.yaml"),
    ),
    ("data/paper.csv", include_str!("../../data/paper.csv")),
    (
        "data/paper_truth.csv",
        include_str!("../../data/paper_truth.csv"),
    ),
];

/// What is said before the comparison.
const BEFORE: &str = "\
A mass that halves in 25 s, no damping, unit stiffness: this device moved, and its displacement was read.
Two fits of that record: the paper's run, which asks for a small misfit alone, and a physical fit, which
says besides that m, c and k are positive and smooth and that k(0) = 1.

";

/// Fit the paper's record twice, as the paper does and with what physics says, and compare: models and
/// data are built in.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for models, data and results.
    #[arg(long, default_value = "runs/demo")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let out = &arguments.out;
    let folder = OutputFolder::prepare(out, Claim::new("demo").files(FILES.map(|(name, _)| name)))?;
    let results = compare::prepare(&folder, "results")?;
    let write = || {
        let mut stage = folder.stage()?;
        for (name, text) in FILES {
            stage.write(name, text)?;
        }
        stage.commit()
    };
    write().map_err(|error| unwritable(out, &error))?;
    let models = FILES.iter().map(|(name, _)| out.join(name));
    let models: Vec<PathBuf> = models
        .filter(|path| path.extension().is_some_and(|e| e == "yaml"))
        .collect();
    print(BEFORE);
    let code = compare::run_in(&results, &models)?;
    let place = out.display();
    print(&format!(
        "\nthe models are in {place}/models: change one, and `kmcfit fit {place}/models/physical.yaml` fits it\n"
    ));
    Ok(code)
}
