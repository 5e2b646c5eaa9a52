//! Every basis with every term, channel and method: a fit with a named outcome, or a refusal that says why.

use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::dynamics::{Device, Excitation, Grid, Method, Oscillator, State, Term};
use kmcfit::solvers::{Status, fit};
use std::collections::BTreeMap;
use std::fmt::Write;

const NODES: usize = 61;

const BASES: [&str; 6] = [
    "basis: nodal",
    "basis: constant",
    "basis: piecewise-constant, knots: 4",
    "basis: piecewise-linear, knots: 4",
    "basis: polynomial, degree: 2",
    "basis: b-spline, knots: 4",
];
const TERMS: [&str; 5] = [
    "",
    "cubic_stiffness: {basis: constant, start: 0.1}",
    "quadratic_damping: {basis: constant, start: 0.1}",
    "coulomb_friction: {basis: constant, start: 0.05, width: 0.1}",
    "offset: {basis: constant, start: 0.1}",
];
const CHANNELS: [&str; 3] = ["displacement", "velocity", "acceleration"];
const METHODS: [&str; 6] = [
    "steepest-descent",
    "steepest-descent, gradient: continuous",
    "lbfgs",
    "projected-gradient",
    "gauss-newton",
    "equation-error",
];

/// A forced record of all channels.
fn readings() -> String {
    let grid = Grid::new(0.0, 9.0, NODES).unwrap();
    let oscillator = Oscillator {
        grid,
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let device = Device {
        mass: vec![1.2; NODES],
        coefficients: vec![vec![0.2; NODES], vec![2.0; NODES]],
    };
    let force: Vec<f64> = grid.times().iter().map(|t| 0.5 * (0.9 * t).cos()).collect();
    let excitation = Excitation::force_at_nodes(&force);
    let start = State {
        displacement: 1.0,
        velocity: 0.0,
    };
    let motion = oscillator
        .forward(&device, start, Some(&excitation))
        .unwrap();
    let mut csv = String::from("t_s,f_N,displacement,velocity,acceleration\n");
    for (i, f) in force.iter().enumerate() {
        let (y, v) = (motion.displacement[i], motion.velocity[i]);
        let a = (f - 0.2 * v - 2.0 * y) / 1.2;
        writeln!(csv, "{},{f},{y},{v},{a}", grid.time(i)).unwrap();
    }
    csv
}

#[test]
fn every_combination_ends_by_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.csv"), readings()).unwrap();
    let mut outcomes: BTreeMap<(&str, String), usize> = BTreeMap::new();
    for basis in BASES {
        for term in TERMS {
            for channel in CHANNELS {
                for method in METHODS {
                    let model = format!(
                        "format: 1
experiments:
  - data: data.csv
    columns: {{{channel}: {channel}, force: f_N}}
    initial: {{displacement: 1.0, velocity: 0.0}}
    {}
functions:
  mass: {{fixed: 1.2}}
  damping: {{basis: constant, start: 0.3}}
  stiffness: {{{basis}, start: 2.2}}
  {term}
fit: {{method: {method}{}}}
",
                        // The paper's gradient and the equation error know no sigma.
                        match method {
                            "equation-error" | "steepest-descent, gradient: continuous" =>
                                String::new(),
                            _ => format!("sigma: {{{channel}: 0.01}}"),
                        },
                        match method {
                            "equation-error" => "",
                            _ => ", stop: {iterations: 3}",
                        }
                    );
                    let here = format!("{basis} | {term} | {channel} | {method}");
                    let outcome = ended(&folder.path().join("model.yaml"), &model, &here);
                    *outcomes.entry((method, outcome)).or_default() += 1;
                }
            }
        }
    }
    let table: Vec<String> = outcomes
        .iter()
        .map(|((method, outcome), count)| format!("{count:3} {method}: {outcome}"))
        .collect();
    insta::assert_snapshot!(table.join("\n"));
}

/// How a model ends; what is found is looked at.
fn ended(path: &std::path::Path, text: &str, here: &str) -> String {
    let file = ModelFile::parse(path, text).unwrap_or_else(|e| panic!("{here}: {e}"));
    let model = match build(&file, Purpose::Fit) {
        Ok(model) => model,
        Err(error) => return format!("refused: {}", error.problem),
    };
    let start = model.problem.start();
    let found = fit(&model.problem, &start, &model.settings, &mut |_| {})
        .unwrap_or_else(|breakdown| panic!("{here}: {breakdown}"));
    let best = &found.best.evaluation;
    assert!(best.cost.is_finite(), "{here}");
    assert!(
        best.device.functions().flatten().all(|p| p.is_finite()),
        "{here}"
    );
    assert!(best.device.mass.iter().all(|m| *m > 0.0), "{here}");
    if found.outcome.status != Status::Failed && !text.contains("equation-error") {
        assert!(best.cost <= found.initial_cost, "{here}");
    }
    found.outcome.status.name().into()
}
