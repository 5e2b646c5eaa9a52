//! `kmcfit demo`

use super::{Failure, compare, print, unwritable};
use crate::report::{OutputFolder, write_whole};
use std::path::{Path, PathBuf};

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
    let mut models = Vec::new();
    for (name, text) in FILES {
        let path = out.join(name);
        let folder = path.parent().unwrap_or(Path::new(""));
        // A folder that is in use, or no folder, is refused.
        OutputFolder::prepare(folder)?;
        write_whole(&path, text).map_err(|error| unwritable(&path, &error))?;
        if name.starts_with("models/") {
            models.push(path);
        }
    }
    print(BEFORE);
    let code = compare::run(&compare::Arguments::of(models, out.join("results")))?;
    let place = out.display();
    print(&format!(
        "\nthe models are in {place}/models: change one, and `kmcfit fit {place}/models/physical.yaml` fits it\n"
    ));
    Ok(code)
}
