//! Records in model files, from the YAML text to the estimated constants.

use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::solvers::{Fit, Status, fit_with_noise};
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, Method, NodalCoefficients, StageSamples, State, System,
};
use std::f64::consts::TAU;
use std::fmt::Write;
use tempfile::TempDir;

const MASS: f64 = 1.5;
const DAMPING: f64 = 0.6;
const STIFFNESS: f64 = 240.0;
/// Steps of the simulation between two samples.
const FINE: usize = 20;

/// Displacements at `rate` from a state at rest at 0.02 m, under force and base acceleration.
fn motion(
    rate: f64,
    count: usize,
    force: &dyn Fn(f64) -> f64,
    base: &dyn Fn(f64) -> f64,
) -> Vec<f64> {
    let nodes = FINE * (count - 1) + 1;
    let grid = Grid::new(0.0, (count - 1) as f64 / rate, nodes).unwrap();
    let device = NodalCoefficients {
        inertias: vec![vec![MASS; nodes]],
        coefficients: vec![vec![DAMPING; nodes], vec![STIFFNESS; nodes]],
    };
    let system = System {
        grid,
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    // The right end of a step is evaluated just before a jump at the node.
    let steps = |f: &dyn Fn(f64) -> f64| {
        let step = |i: usize| {
            let (a, b) = (grid.time(i), grid.time(i + 1));
            let inside = b - 1e-9 * (b - a);
            [f(a + 1e-9 * (b - a)), f(0.5 * (a + b)), f(inside)]
        };
        StageSamples::new((0..nodes - 1).map(step))
    };
    let excitation = Excitation::one(Some(steps(force)), Some(steps(base)));
    let initial = State::one(0.02, 0.0);
    let motion = system
        .forward(&device, &initial, Some(&excitation))
        .unwrap();
    motion
        .displacement(0)
        .iter()
        .step_by(FINE)
        .copied()
        .collect()
}

/// A model with `experiment` as its only one, mass known or estimated; the folder has `file`.
fn fitted(text: &str, experiment: &str, mass: &str) -> (Model, Fit) {
    fitted_on(text, experiment, mass, "")
}

/// [`fitted`] on another grid.
fn fitted_on(text: &str, experiment: &str, mass: &str, grid: &str) -> (Model, Fit) {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("record.csv"), text).unwrap();
    let yaml = format!(
        "
format: 1
experiments:
  - data: record.csv
{experiment}
{grid}
functions:
  mass: {mass}
  damping: {{basis: constant, start: 0.1}}
  stiffness: {{basis: constant, start: 100.0}}
"
    );
    let file = ModelFile::parse(folder.path().join("model.yaml"), yaml).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let start = model.problem.start();
    let (_, run) = fit_with_noise(&model.problem, &start, &model.settings, &mut |_| {}).unwrap();
    assert_eq!(run.outcome.status, Status::Converged, "{:?}", run.outcome);
    (model, run)
}

const KNOWN: &str = "{fixed: 1.5}";

/// The largest relative error of the constants that are fitted.
fn error(run: &Fit) -> f64 {
    let device = &run.best.evaluation.nodal;
    let found = [
        device.inertias[0][0],
        device.coefficients[0][0],
        device.coefficients[1][0],
    ];
    let pairs = found.into_iter().zip([MASS, DAMPING, STIFFNESS]);
    pairs.fold(0.0, |most, (f, t)| most.max((f / t - 1.0).abs()))
}

fn nothing(_t: f64) -> f64 {
    0.0
}

/// Without names, by number, at a rate, from 5 s into the file, with a lost sample.
#[test]
fn a_window_of_a_file_without_names() {
    let y = motion(200.0, 801, &nothing, &nothing);
    let mut text = String::new();
    for i in 0..1801 {
        // Before the release the sensor has another value.
        let reading = if i < 1000 { 0.7 } else { 1e3 * y[i - 1000] };
        match i {
            1300 => text += "1\t\n",
            _ => _ = writeln!(text, "1\t{reading}"),
        }
    }
    let experiment = "    columns: {displacement: 2}
    sample_rate: 200
    units: {displacement: mm}
    window: {min: 5.0}
    time_zero: 5.0
    initial: {displacement: 0.02, velocity: 0.0}
    sigma: {displacement: 1e-6}";
    let (model, run) = fitted(&text, experiment, KNOWN);
    // The samples are printed with all digits; the error is that of the step of 5 ms, (w h)^4 w T / 120.
    assert!(error(&run) < 1e-5, "{}", error(&run));
    let ignored = &model.notes[0][0].ignored;
    assert_eq!(ignored[0], (1000, "outside the window".to_owned()));
    assert_eq!(ignored[1], (1, "missing".to_owned()));
    assert_eq!(model.problem.sample_count(), 800);
}

/// A tone far above the response, which aliasing would fold into it.
#[test]
fn decimation_and_band() {
    let y = motion(1000.0, 4001, &nothing, &nothing);
    let hum = |i: usize| 0.01 * (TAU * 187.0 * i as f64 / 1000.0).sin();
    let mut text = String::from("t_s,y_m\n");
    for (i, y) in y.iter().enumerate() {
        let _ = writeln!(text, "{},{}", i as f64 / 1000.0, y + hum(i));
    }
    let plain = "    initial: estimate
    sigma: {displacement: estimate}";
    // 187 Hz sampled at 100 Hz aliases to 13 Hz. The edges of the filter leave errors of some 1e-3 of the response at the ends of
    // the record.
    let decimated = format!("{plain}\n    decimate: 10");
    let (model, run) = fitted(&text, &decimated, KNOWN);
    assert!(error(&run) < 5e-3, "{}", error(&run));
    assert_eq!(model.problem.sample_count(), 401);
    // The band filters the model in the same way, edges included; of the hum only the transients at its beginning and end are
    // within the band.
    let band = format!("{plain}\n    band: {{max: 20.0}}");
    let (_, run) = fitted(&text, &band, KNOWN);
    assert!(error(&run) < 2e-3, "{}", error(&run));
}

/// A column of sigmas: half of the samples are useless and have a large sigma.
#[test]
fn sigmas_from_a_column() {
    let y = motion(200.0, 801, &nothing, &nothing);
    let mut text = String::from("t_s,y_m,s_m\n");
    for (i, y) in y.iter().enumerate() {
        let t = i as f64 / 200.0;
        let (off, sigma) = if i % 2 == 0 { (0.0, 1e-6) } else { (0.05, 1e3) };
        let _ = writeln!(text, "{t},{},{sigma}", y + off);
    }
    let experiment = "    initial: {displacement: 0.02, velocity: 0.0}
    sigma: {displacement: s_m}";
    let (_, run) = fitted(&text, experiment, KNOWN);
    assert!(error(&run) < 1e-5, "{}", error(&run));
}

/// The shapes of forces, against a simulation with their formulas; mass, damping and stiffness.
#[test]
fn shapes_of_forces() {
    let hammer = |t: f64| match (0.5..0.8).contains(&t) {
        true => 20.0 * (std::f64::consts::PI * (t - 0.5) / 0.3).sin(),
        false => 0.0,
    };
    let sweep = |t: f64| 5.0 * (TAU * (1.0 * t + (3.0 - 1.0) * t * t / (2.0 * 4.0))).sin();
    type Force<'a> = &'a dyn Fn(f64) -> f64;
    let cases: [(&str, Force); 5] = [
        ("{shape: constant, amplitude: 3.0}", &|_| 3.0),
        (
            "{shape: sine, amplitude: 4.0, frequency: 1.5, phase: 0.3}",
            &|t| 4.0 * (TAU * 1.5 * t + 0.3).sin(),
        ),
        ("{shape: step, amplitude: 5.0, at: 1.0}", &|t| {
            if t < 1.0 { 0.0 } else { 5.0 }
        }),
        (
            "{shape: half-sine, amplitude: 20.0, at: 0.5, duration: 0.3}",
            &hammer,
        ),
        (
            "{shape: sweep, amplitude: 5.0, from: 1.0, to: 3.0, duration: 4.0}",
            &sweep,
        ),
    ];
    for (shape, force) in cases {
        let y = motion(200.0, 801, force, &nothing);
        let mut text = String::from("t_s,y_m\n");
        for (i, y) in y.iter().enumerate() {
            let _ = writeln!(text, "{},{y}", i as f64 / 200.0);
        }
        let experiment = format!(
            "    force: {shape}
    sigma: {{displacement: 1e-6}}
    initial: {{displacement: 0.02, velocity: 0.0}}"
        );
        let (_, run) = fitted(&text, &experiment, "{basis: constant, start: 3.0}");
        // The step of 5 ms, as above; the kinks of the force lie on nodes.
        assert!(error(&run) < 1e-4, "{shape}: {}", error(&run));
    }
}

/// A base whose displacement was measured, and the absolute displacement of the mass.
#[test]
fn a_base_that_moves() {
    let base = |t: f64| 0.01 * (TAU * 1.1 * t).sin();
    let curvature = |t: f64| -0.01 * (TAU * 1.1).powi(2) * (TAU * 1.1 * t).sin();
    let y = motion(200.0, 801, &nothing, &curvature);
    let mut text = String::from("t_s,x_m,b_m\n");
    for (i, y) in y.iter().enumerate() {
        let t = i as f64 / 200.0;
        let _ = writeln!(text, "{t},{},{}", y + base(t), base(t));
    }
    let experiment = "    columns: {displacement: x_m, base_displacement: b_m}
    sensors: {displacement: {absolute: true}}
    sigma: {displacement: 1e-6}
    initial: {displacement: 0.02, velocity: 0.0}";
    let (_, run) = fitted(&text, experiment, KNOWN);
    // The relative error of the spline's second derivative is (w h)^2 / 12 = 1e-4.
    assert!(error(&run) < 2e-4, "{}", error(&run));
}

/// The continuous adjoint of nonlinear terms, a moving base and an unknown initial state agrees with
/// the discrete one up to the step.
#[test]
fn the_continuous_adjoint_carries_every_term() {
    let difference = |nodes: usize| -> f64 {
        let text = {
            let grid = Grid::new(0.0, 4.0, nodes).unwrap();
            let mut text = String::from("t_s,y_m,b\n");
            for t in grid.times() {
                let _ = writeln!(text, "{t},{},{}", (9.0 * t).cos(), (5.0 * t).sin());
            }
            text
        };
        let folder = TempDir::new().unwrap();
        std::fs::write(folder.path().join("record.csv"), text).unwrap();
        let yaml = "
format: 1
experiments:
  - data: record.csv
    columns: {displacement: y_m, base_acceleration: b}
    initial: estimate
grid: {method: midpoint}
functions:
  mass: {basis: constant, start: 1.0}
  damping: {basis: constant, start: 0.3}
  stiffness: {basis: constant, start: 60.0}
  cubic_stiffness: {basis: constant, start: 10.0}
  quadratic_damping: {basis: constant, start: 0.2}
  coulomb_friction: {basis: constant, start: 0.3, width: 0.5}
  static_force: {basis: constant, start: 0.4}
fit: {method: lbfgs, gradient: continuous}
";
        let file = ModelFile::parse(folder.path().join("model.yaml"), yaml).unwrap();
        let problem = build(&file, BuildMode::Fit).unwrap().problem;
        let theta = problem.start();
        let evaluation = problem.evaluate(&theta).unwrap();
        let [a, b] = [GradientKind::Discrete, GradientKind::Continuous]
            .map(|kind| problem.gradient(&theta, &evaluation, kind).euclidean);
        let size = a.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
        off.fold(0.0, f64::max) / size
    };
    let [coarse, fine] = [1001, 4001].map(difference);
    // Of order 1 at worst: four times the nodes, a quarter of the difference or less.
    assert!(fine < 1e-3 && fine < 0.3 * coarse, "{coarse} {fine}");
}

/// The initial state is that of the first row, also where its sample is missing: at 0 s.
#[test]
fn samples_that_are_missing_at_the_ends() {
    let y = motion(200.0, 801, &nothing, &nothing);
    let mut text = String::from("t_s,y_m\n");
    for (i, y) in y.iter().enumerate() {
        let t = i as f64 / 200.0;
        match (80..700).contains(&i) {
            true => _ = writeln!(text, "{t},{y}"),
            false => _ = writeln!(text, "{t},"),
        }
    }
    let experiment = "    initial: {displacement: 0.02, velocity: 0.0}";
    let (model, run) = fitted(&text, experiment, KNOWN);
    assert_eq!(model.problem.system.grid.start(), 0.0);
    assert_eq!(model.problem.system.grid.duration(), 4.0);
    assert!(error(&run) < 1e-5, "{}", error(&run));
}
