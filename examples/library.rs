// A fit from Rust: a model file is built into a problem and fitted.

use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::fit;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let file = ModelFile::read("models/paper-lbfgs.yaml")?;
    let model = build(&file, BuildMode::Fit)?;
    let start = model.problem.functions.start();
    let found = fit(&model.problem, &start, &model.settings, &mut |_| {})
        .map_err(|error| error.to_string())?;
    let (nodal, response) = (
        &found.best.evaluation.nodal,
        &found.best.evaluation.trajectories[0],
    );
    println!(
        "{}, J/J0 = {:.1e}",
        found.outcome.reason,
        found.cost_ratio()
    );
    println!(
        "m(0) = {:.3} kg, y(25) = {:.3} m",
        nodal.inertias[0][0],
        response.displacement(0)[1999]
    );
    Ok(())
}
