//! Measured records that are not part of the project; skipped, loudly, where they are absent.

mod common;

use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::solvers::{Status, fit};

/// Roll decay of the ship model KVLCC2 (Alexandersson and Kjellberg 2021, doi
/// 10.17632/2stvkyngj9.1, CC BY 4.0): the best constant inertia and damping.
#[test]
fn roll_decay_with_constant_coefficients() {
    let Some(folder) = common::shared("data") else {
        return;
    };
    let data = folder.join("kvlcc2_21337_decay_25Hz.csv");
    let text = format!(
        "
format: 1
experiments:
  - data: {}
    columns: {{time: t_s, displacement: phi_rad}}
    initial: {{displacement: -0.167021, velocity: 0.0}}
grid: {{method: rk4}}
functions:
  mass:      {{basis: constant, start: 135.0}}
  damping:   {{basis: constant, start: 4.0}}
  stiffness: {{fixed: 821.96}}
fit: {{method: lbfgs, stop: {{iterations: 200, tolerance: 1e-9}}}}
",
        data.canonicalize().unwrap().display()
    );
    let file = ModelFile::parse("roll.yaml", text).unwrap();
    let model = build(&file, Purpose::Fit).unwrap();
    let start = model.problem.functions.start();
    let run = fit(&model.problem, &start, &model.settings, &mut |_| {}).unwrap();
    assert_eq!(run.outcome.status, Status::Converged, "{:?}", run.outcome);
    let [mass, damping] = run.best.parameters.as_slice() else {
        panic!("two parameters");
    };
    assert!((mass / 134.46 - 1.0).abs() < 5e-3, "{mass}");
    assert!((damping / 4.238 - 1.0).abs() < 5e-3, "{damping}");
    let readings = &model.problem.experiments[0].channels[0];
    let motion = &run.best.evaluation.predictions[0][0];
    let squares: f64 = readings.residuals(motion).map(|r| r * r).sum();
    let rms = (squares / readings.len() as f64).sqrt().to_degrees();
    assert!((rms - 0.337).abs() < 5e-4, "{rms}");
}
