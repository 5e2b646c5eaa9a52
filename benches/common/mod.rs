//! Problems of the benchmarks.
#![allow(dead_code, reason = "each benchmark needs some of them")]

use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Solver, Stopping, fit};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::study::{Multistart, Ranges};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use std::fmt::Write;
use std::path::Path;

/// Length of the paper's record, s.
const DURATION: f64 = 25.0;
/// The paper's initial state, m and m/s.
fn initial() -> State {
    State::one(3.3, 1.0)
}
/// Starts of a study lie within this factor of the start values: the default of `kmcfit study`.
const SPREAD: f64 = 3.0;

/// The paper's problem on `nodes` nodes: one free value per node for mass, damping and stiffness, the
/// midpoint rule, the start (2, 1, 1), and samples that the same stepper made.
pub fn paper(nodes: usize) -> Problem {
    let system = System {
        grid: Grid::new(0.0, DURATION, nodes).expect("a grid"),
        method: Method::Midpoint,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let grid = system.grid;
    let weighting = Weighting::Integral {
        spacing: grid.step(),
    };
    let samples = paper_readings(&system);
    let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
    let list = vec![
        CoefficientFunction::nodal(CoefficientKind::MASS, vec![2.0; nodes]),
        CoefficientFunction::nodal(CoefficientKind::DAMPING, vec![1.0; nodes]),
        CoefficientFunction::nodal(CoefficientKind::STIFFNESS, vec![1.0; nodes]),
    ];
    let functions = Parameterization::new(list, nodes, grid.step()).expect("independent functions");
    let record = Experiment::free("free decay", initial(), nodes).with_channel(channel);
    Problem::new(system, functions, vec![record]).unwrap()
}

fn paper_readings(system: &System) -> Vec<f64> {
    let nodes = system.grid.nodes();
    let truth = NodalCoefficients {
        inertias: vec![
            (1..=nodes)
                .map(|i| 1.0 - 0.5 * i as f64 / nodes as f64)
                .collect(),
        ],
        coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
    };
    let response = system.forward(&truth, &initial(), None);
    response.expect("a motion").displacement(0).to_vec()
}

/// A model of `models/`, with some of its text replaced.
///
/// # Panics
/// If the model is not there, or a text to replace is not in it.
pub fn model(name: &str, changes: &[(&str, &str)]) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("models/{name}.yaml"));
    let mut text = std::fs::read_to_string(&path).expect("a model file");
    for (old, new) in changes {
        assert!(text.contains(old), "{name}.yaml has no `{old}`");
        text = text.replace(old, new);
    }
    let file = ModelFile::parse(&path, text).expect("a model");
    build(&file, BuildMode::Fit).expect("a model")
}

/// `models/paper-smooth.yaml` on `nodes` nodes.
pub fn smooth(nodes: usize) -> Model {
    let system = paper(nodes).system.clone();
    let mut table = String::from("t_s,y_m\n");
    for (t, y) in system.grid.times().iter().zip(paper_readings(&system)) {
        writeln!(table, "{t},{y}").expect("a string has room");
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("paper-{nodes}.csv"));
    std::fs::write(&path, table).expect("a folder for temporary files");
    let data = format!("data: {:?}", path.display().to_string());
    model(
        "paper-smooth",
        &[
            ("data: ../data/paper.csv", &data),
            ("nodes: 2000", &format!("nodes: {nodes}")),
            ("truth:", "# truth:"),
        ],
    )
}

/// Fits a model from its start.
pub fn fitted(model: &Model) -> Fit {
    fit_problem(&model.problem, &model.settings)
}

/// Fits a problem from its start.
pub fn fit_problem(problem: &Problem, settings: &FitSettings) -> Fit {
    fit(problem, &problem.start(), settings, &mut |_| {}).expect("a motion")
}

/// A multistart study of a model with `starts` starting points and no start strategy, as in `kmcfit study`.
pub fn many_starts(model: &Model, starts: usize, threads: usize) -> Multistart {
    let level = |parameters: &[f64]| parameters.iter().sum::<f64>() / parameters.len() as f64;
    let start = model.problem.start();
    let ranges = model.problem.functions.ranges().iter();
    let around = |at: f64| [at / SPREAD, at * SPREAD];
    Multistart {
        ranges: Ranges::Constants(ranges.map(|r| around(level(&start[r.clone()]))).collect()),
        starts,
        seed: 1,
        threads,
        settings: model.settings.clone(),
    }
}

/// A hardening spring under three sines, measured by a displacement and an acceleration sensor with
/// `samples` samples each; mass, damping, stiffness and cubic stiffness are estimated.
pub fn duffing(samples: usize) -> (Problem, FitSettings) {
    let grid = Grid::new(0.0, 0.001 * (samples - 1) as f64, samples).expect("a grid");
    let times = grid.times();
    let force: Vec<f64> = times
        .iter()
        .map(|t| 4.0 * (3.1 * t).sin() + 3.0 * (5.3 * t + 1.0).sin() + 2.0 * (9.7 * t + 2.0).sin())
        .collect();
    let excitation = Excitation::force_at_nodes(&force);
    let system = System {
        grid,
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness, Law::CubicStiffness]),
    };
    let rest = State::one(0.0, 0.0);
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; samples]],
        coefficients: [1.2, 20.0, 15.0].map(|p| vec![p; samples]).to_vec(),
    };
    let response = system.forward(&truth, &rest, Some(&excitation));
    let response = response.expect("a motion");
    let acceleration: Vec<f64> = (0..samples)
        .map(|i| {
            let (y, v) = (response.displacement(0)[i], response.velocity(0)[i]);
            force[i] - 1.2 * v - 20.0 * y - 15.0 * y * y * y
        })
        .collect();
    let list = vec![
        CoefficientFunction::constant(CoefficientKind::MASS, 1.2, samples),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 1.0, samples),
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 18.0, samples),
        CoefficientFunction::constant(CoefficientKind::CUBIC_STIFFNESS, 12.0, samples),
    ];
    let functions =
        Parameterization::new(list, samples, grid.step()).expect("independent functions");
    let channel = |kind, values, sigma| {
        let weighting = Weighting::Sigma(sigma);
        Channel::new(kind, times.clone(), values, weighting, &grid, samples).expect("samples")
    };
    let record = Experiment::free("three sines", rest, samples)
        .with_excitation(excitation)
        .with_channel(channel(
            ChannelKind::Displacement,
            response.displacement(0).to_vec(),
            0.01,
        ))
        .with_channel(channel(ChannelKind::Acceleration, acceleration, 0.05));
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping::default(),
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    (
        Problem::new(system, functions, vec![record]).unwrap(),
        settings,
    )
}
