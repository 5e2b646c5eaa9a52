//! Every basis with every term, channel and method: each fit ends with a status or is rejected with a reason.

use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::internals::solvers::{Status, fit};
use kmcfit_core::internals::system::{
    Excitation, Grid, Method, NodalCoefficients, State, System, Term,
};
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
const TERMS: [&str; 7] = [
    "",
    "quadratic_stiffness: {basis: constant, start: 0.1}",
    "cubic_stiffness: {basis: constant, start: 0.1}",
    "quintic_stiffness: {basis: constant, start: 0.1}",
    "quadratic_damping: {basis: constant, start: 0.1}",
    "coulomb_friction: {basis: constant, start: 0.05, width: 0.1}",
    "static_force: {basis: constant, start: 0.1}",
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
fn sample_table() -> String {
    let grid = Grid::new(0.0, 9.0, NODES).unwrap();
    let system = System {
        grid,
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let device = NodalCoefficients {
        mass: vec![1.2; NODES],
        coefficients: vec![vec![0.2; NODES], vec![2.0; NODES]],
    };
    let force: Vec<f64> = grid.times().iter().map(|t| 0.5 * (0.9 * t).cos()).collect();
    let excitation = Excitation::force_at_nodes(&force);
    let start = State {
        displacement: 1.0,
        velocity: 0.0,
    };
    let motion = system.forward(&device, start, Some(&excitation)).unwrap();
    let mut csv = String::from("t_s,f_N,displacement,velocity,acceleration\n");
    for (i, f) in force.iter().enumerate() {
        let (y, v) = (motion.displacement[i], motion.velocity[i]);
        let a = (f - 0.2 * v - 2.0 * y) / 1.2;
        writeln!(csv, "{},{f},{y},{v},{a}", grid.time(i)).unwrap();
    }
    csv
}

/// A model of one channel with these functions, one per line.
fn model(functions: &[String], channel: &str, method: &str) -> String {
    // The continuous adjoint and the equation error do not support sigma.
    let sigma = match method {
        "equation-error" | "steepest-descent, gradient: continuous" => String::new(),
        _ => format!("sigma: {{{channel}: 0.01}}"),
    };
    let stop = match method {
        "equation-error" => "",
        _ => ", stop: {iterations: 3}",
    };
    format!(
        "format: 1
experiments:
  - data: data.csv
    columns: {{{channel}: {channel}, force: f_N}}
    initial: {{displacement: 1.0, velocity: 0.0}}
    {sigma}
functions:
  {}
fit: {{method: {method}{stop}}}
",
        functions.join("\n  ")
    )
}

/// Number of fits by status, for all these functions with every channel and method.
fn outcomes(all: impl Iterator<Item = Vec<String>>) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.csv"), sample_table()).unwrap();
    let mut outcomes: BTreeMap<(&str, String), usize> = BTreeMap::new();
    for functions in all {
        for channel in CHANNELS {
            for method in METHODS {
                let text = model(&functions, channel, method);
                let here = format!("{} | {channel} | {method}", functions.join(" | "));
                let outcome = ended(&folder.path().join("model.yaml"), &text, &here);
                *outcomes.entry((method, outcome)).or_default() += 1;
            }
        }
    }
    let lines = outcomes
        .iter()
        .map(|((method, outcome), count)| format!("{count:3} {method}: {outcome}"));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn every_combination_ends_by_name() {
    let all = BASES.into_iter().flat_map(|basis| {
        TERMS.into_iter().map(move |term| {
            [
                "mass: {fixed: 1.2}",
                "damping: {basis: constant, start: 0.3}",
                &format!("stiffness: {{{basis}, start: 2.2}}"),
                term,
            ]
            .map(str::to_owned)
            .to_vec()
        })
    });
    insta::assert_snapshot!(outcomes(all));
}

/// Every basis for each of the other functions, while the rest is constant.
#[test]
fn every_basis_of_every_function_ends_by_name() {
    let functions = [
        ("mass", "1.3", ""),
        ("damping", "0.3", ""),
        ("quadratic_stiffness", "0.1", ""),
        ("cubic_stiffness", "0.1", ""),
        ("quintic_stiffness", "0.1", ""),
        ("quadratic_damping", "0.1", ""),
        ("coulomb_friction", "0.05", ", width: 0.1"),
        ("static_force", "0.1", ""),
    ];
    let all = BASES.into_iter().flat_map(|basis| {
        functions.map(|(changing, start, more)| {
            let mut lines = vec![format!("{changing}: {{{basis}, start: {start}{more}}}")];
            for (name, start) in [("mass", 1.3), ("damping", 0.3), ("stiffness", 2.2)] {
                if name != changing {
                    lines.push(format!("{name}: {{basis: constant, start: {start}}}"));
                }
            }
            lines
        })
    });
    insta::assert_snapshot!(outcomes(all));
}

/// Status of the fit of a model, whose estimates must be finite.
fn ended(path: &std::path::Path, text: &str, here: &str) -> String {
    let file = ModelFile::parse(path, text).unwrap_or_else(|e| panic!("{here}: {e}"));
    let model = match build(&file, BuildMode::Fit) {
        Ok(model) => model,
        Err(error) => return format!("refused: {}", error.problem),
    };
    let start = model.problem.start();
    let found = fit(&model.problem, &start, &model.settings, &mut |_| {})
        .unwrap_or_else(|breakdown| panic!("{here}: {breakdown}"));
    let best = &found.best.evaluation;
    assert!(best.cost.is_finite(), "{here}");
    assert!(
        best.nodal.functions().flatten().all(|p| p.is_finite()),
        "{here}"
    );
    // A minimum of the equation error without a positive mass is reported.
    let has_mass = best.nodal.mass.iter().all(|m| *m > 0.0);
    let is_infeasible = found.outcome.status == Status::Infeasible;
    assert!(has_mass || is_infeasible, "{here}");
    if found.outcome.status != Status::Failed && !text.contains("equation-error") {
        assert!(best.cost <= found.initial_cost, "{here}");
    }
    found.outcome.status.name().into()
}
