//! Measured records that are not part of the project; without them the tests are skipped with a note.

use crate::common;
use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::assessment::{Doubt, FitAssessment, verdict_reasons};
use kmcfit_core::solvers::{Status, fit, fit_with_noise};

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
    let model = build(&file, BuildMode::Fit).unwrap();
    let start = model.problem.functions.start();
    let run = fit(&model.problem, &start, &model.settings, &mut |_| {}).unwrap();
    assert_eq!(run.outcome.status, Status::Converged, "{:?}", run.outcome);
    let [mass, damping] = run.best.parameters.as_slice() else {
        panic!("two parameters");
    };
    assert!((mass / 134.46 - 1.0).abs() < 5e-3, "{mass}");
    assert!((damping / 4.238 - 1.0).abs() < 5e-3, "{damping}");
    let samples = &model.problem.experiments[0].channels[0];
    let motion = &run.best.evaluation.predictions[0][0];
    let squares: f64 = samples.residuals(motion).map(|r| r * r).sum();
    let rms = (squares / samples.len() as f64).sqrt().to_degrees();
    assert!((rms - 0.337).abs() < 5e-4, "{rms}");
}

/// A model of the roll decay: the stiffness is known, the other coefficients and the initial state are estimated.
fn roll_decay(functions: &str) -> Option<(kmcfit::config::Model, kmcfit_core::solvers::Fit)> {
    let data = common::shared("data")?.join("kvlcc2_21337_decay_25Hz.csv");
    let text = format!(
        "
format: 1
experiments:
  - data: {}
    columns: {{time: t_s, displacement: phi_rad}}
    initial: estimate
functions:
  mass: {{basis: constant, start: 100.0}}
  stiffness: {{fixed: 821.96}}
  cubic_stiffness: {{basis: constant, start: 0.0}}
{functions}
",
        data.canonicalize().unwrap().display()
    );
    let file = ModelFile::parse("roll.yaml", text).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let run = fit(
        &model.problem,
        &model.problem.start(),
        &model.settings,
        &mut |_| {},
    )
    .unwrap();
    assert_eq!(run.outcome.status, Status::Converged, "{:?}", run.outcome);
    Some((model, run))
}

/// Root-mean-square residual in degrees.
fn rms_degrees(model: &kmcfit::config::Model, run: &kmcfit_core::solvers::Fit) -> f64 {
    let channel = &model.problem.experiments[0].channels[0];
    let residuals: Vec<f64> = channel
        .residuals(&run.best.evaluation.predictions[0][0])
        .collect();
    kmcfit_core::diagnostics::rms(&residuals).to_degrees()
}

/// Published linear and quadratic damping give an equivalent damping of 3.26 N m s at 5 degrees; the
/// inertia with added mass is 135.75 kg m^2. Published fits have residuals of 0.0254 degrees rms, or 0.0233 with a constant
/// offset.
#[test]
fn the_roll_decay_with_nonlinear_damping() {
    let damping = "  damping: {basis: constant, start: 1.0}
  quadratic_damping: {basis: constant, start: 0.0}";
    let Some((model, run)) = roll_decay(damping) else {
        return;
    };
    let rms = rms_degrees(&model, &run);
    assert!(rms <= 0.026, "{rms}");
    let device = &run.best.evaluation.nodal;
    let [linear, _, _, quadratic] = [0, 1, 2, 3].map(|j| device.coefficients[j][0]);
    let inertia = device.inertias[0][0];
    assert!((inertia / 135.75 - 1.0).abs() <= 0.01, "{inertia}");
    let omega = (821.96 / inertia).sqrt();
    let amplitude = 5f64.to_radians();
    let equivalent = linear + 8.0 / (3.0 * std::f64::consts::PI) * omega * amplitude * quadratic;
    assert!((equivalent / 3.26 - 1.0).abs() <= 0.03, "{equivalent}");

    let with_offset = format!("{damping}\n  static_force: {{basis: constant, start: 0.0}}");
    let Some((model, run)) = roll_decay(&with_offset) else {
        return;
    };
    let rms = rms_degrees(&model, &run);
    assert!(rms <= 0.0235, "{rms}");
}

/// The same decay with a time-varying damping instead: 4.8 N m s at 10 s, 3.15 at 55 s.
#[test]
fn the_roll_decay_with_damping_over_time() {
    for knots in [3, 4] {
        let damping = format!("  damping: {{basis: piecewise-linear, knots: {knots}, start: 1.0}}");
        let Some((model, run)) = roll_decay(&damping) else {
            return;
        };
        let rms = rms_degrees(&model, &run);
        assert!(rms <= 0.026, "{knots} knots: {rms}");
        let grid = &model.problem.system.grid;
        let damping = &run.best.evaluation.nodal.coefficients[0];
        let at = |t: f64| damping[(t / grid.step()).round() as usize];
        assert!((at(10.0) - 4.8).abs() <= 0.3, "{knots} knots: {}", at(10.0));
        assert!(
            (at(55.0) - 3.15).abs() <= 0.2,
            "{knots} knots: {}",
            at(55.0)
        );
    }
}

/// The residuals of the decay stay autocorrelated, which the verdict states.
#[test]
fn the_residuals_of_the_ship_are_autocorrelated() {
    let Some(folder) = common::shared("data") else {
        return;
    };
    let text = format!(
        "
format: 1
experiments:
  - data: {}
    columns: {{time: t_s, displacement: phi_rad}}
    initial: estimate
    sigma: {{displacement: estimate}}
functions:
  mass: {{basis: constant, start: 100.0}}
  stiffness: {{fixed: 821.96}}
  cubic_stiffness: {{basis: constant, start: 0.0}}
  damping: {{basis: constant, start: 1.0}}
  quadratic_damping: {{basis: constant, start: 0.0}}
  static_force: {{basis: constant, start: 0.0}}
",
        folder
            .join("kvlcc2_21337_decay_25Hz.csv")
            .canonicalize()
            .unwrap()
            .display()
    );
    let file = ModelFile::parse("roll.yaml", text).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let start = model.problem.functions.start();
    let (problem, found) =
        fit_with_noise(&model.problem, &start, &model.settings, &mut |_| {}).unwrap();
    let assessment = FitAssessment::of(&problem, &found, true);
    let reasons = verdict_reasons(&problem, &found, Some(&assessment));
    let is_coloured = |reason: &Doubt| matches!(reason, Doubt::Coloured { .. });
    assert!(reasons.iter().any(is_coloured), "{reasons:?}");
}
