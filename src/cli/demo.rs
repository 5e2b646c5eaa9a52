//! `kmcfit demo`: compares the paper's fit with a constrained one on models and data that are built into the program.

use super::{CommandError, compare, print, unwritable};
use crate::results::{Claim, OutputFolder};
use std::path::PathBuf;

/// Files of the demonstration, by path in its folder.
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

/// Introduction, printed before the comparison.
const BEFORE: &str = "\
Record: displacement of a free response; the mass halves within 25 s, no damping, k = 1 N/m.
Two fits: the paper's, by the misfit alone, and a physical one, in which m, c and k are positive and smooth
and k(0) = 1 N/m.

";

/// Compare the paper's fit of its record with a physically constrained fit; models and data are built in.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit demo --out runs/demo")]
pub struct Arguments {
    /// Folder for models, data and results.
    #[arg(long, default_value = "runs/demo")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
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
        "Models {place}/models; edit one and fit it with `kmcfit fit {place}/models/physical.yaml`\n"
    ));
    Ok(code)
}
