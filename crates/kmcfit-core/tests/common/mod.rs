//! Problems with known solutions for the tests of all modules.
#![allow(dead_code)]

pub mod closed_form;
pub mod counts;
pub mod forced;
pub mod lacking;
pub mod properties;
pub mod reference;
pub mod selected;
pub mod sensed;
pub mod synthetic;

use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::host::{self, Host};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Experiment, Weighting};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Grid, Method, NodalCoefficients, State, System};

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Instant;

pub const DURATION: f64 = 25.0;
pub fn initial() -> State {
    State::one(3.3, 1.0)
}

pub fn system(nodes: usize, method: Method) -> System {
    System {
        grid: Grid::new(0.0, DURATION, nodes).unwrap(),
        method,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

/// The system that made the paper's data: m_i = 1 - 0.5 (i+1)/N, c = 0, k = 1.
pub fn paper_system(nodes: usize) -> NodalCoefficients {
    let mass: Vec<f64> = (0..nodes)
        .map(|i| 1.0 - 0.5 * (i + 1) as f64 / nodes as f64)
        .collect();
    NodalCoefficients {
        inertias: vec![mass],
        coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
    }
}

/// The paper's problem: one value per node, starting from constant `(m, c, k)`.
pub fn paper_problem(nodes: usize, start: [f64; 3]) -> Problem {
    let system = system(nodes, Method::Midpoint);
    let step = system.grid.step();
    let observed = system
        .forward(&paper_system(nodes), &initial(), None)
        .unwrap()
        .displacement(0)
        .to_vec();
    let quantities = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
    ];
    let list = quantities
        .into_iter()
        .zip(start)
        .map(|(q, value)| CoefficientFunction::nodal(q, vec![value; nodes]))
        .collect();
    let weighting = Weighting::Integral { spacing: step };
    let channel = Channel::displacement_at_nodes(observed, 1, weighting, &system.grid);
    let experiment = Experiment::free("free decay", initial(), nodes).with_channel(channel);
    let functions = Parameterization::new(list, nodes, step).unwrap();
    Problem::new(system, functions, vec![experiment]).unwrap()
}

/// Provides the clock of the process, without which timings are zero.
pub fn provide_clock() {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    host::set_host(Host {
        clock: || START.elapsed(),
        progress: |_, _| {},
        is_interrupted: || false,
    });
}

/// A file or folder of the repository.
pub fn repository(path: &str) -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = package
        .ancestors()
        .find(|folder| folder.join("models").is_dir());
    root.expect("the repository").join(path)
}

/// A folder of shared reference data (`KMCFIT_SHARED`, by default `../shared`); `None` with a
/// note if it is absent.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let root =
        std::env::var_os("KMCFIT_SHARED").map_or_else(|| repository("../shared"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("SKIPPED: no shared `{folder}`; set KMCFIT_SHARED to check against it");
    None
}

/// The numbers of a CSV file without its header.
pub fn csv(path: &std::path::Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

/// Simulated displacement of `system` with Gaussian noise.
pub fn noisy(system: &System, nodal: &NodalCoefficients, sigma: f64, seed: u64) -> Vec<f64> {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let response = system.forward(nodal, &initial(), None).unwrap();
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    response
        .displacement(0)
        .iter()
        .map(|y| y + sigma * noise())
        .collect()
}

/// A problem over `DURATION` from `initial()` with the given functions and samples at all nodes.
pub fn problem_of(
    system: System,
    list: Vec<CoefficientFunction>,
    observed: Vec<f64>,
    sigma: Option<f64>,
) -> Problem {
    let (nodes, step) = (system.grid.nodes(), system.grid.step());
    let weighting = match sigma {
        Some(sigma) => Weighting::Sigma(sigma),
        None => Weighting::Integral { spacing: step },
    };
    let channel = Channel::displacement_at_nodes(observed, 1, weighting, &system.grid);
    let experiment = Experiment::free("free decay", initial(), nodes).with_channel(channel);
    let functions = Parameterization::new(list, nodes, step).unwrap();
    Problem::new(system, functions, vec![experiment]).unwrap()
}

/// Adds the smoothness of the paper's recovery, weight on the curvature of m and the slopes of c
/// and k, and `k(0) = 1`; with bounds `m >= 0.05, c >= 0, k >= 0` at every parameter of a nodal or
/// piecewise linear basis if asked for.
pub fn add_physics(problem: &mut Problem, weight: f64, positive: bool) {
    use kmcfit_core::constraints::RowGroup;
    use kmcfit_core::functions::Penalty;
    let grid = problem.system.grid;
    let orders = [2, 1, 1];
    let ranges = problem.functions.ranges().to_vec();
    let bases: Vec<_> = problem.functions.iter().map(|f| f.basis.clone()).collect();
    for (f, basis) in bases.iter().enumerate() {
        let Some(basis) = basis else { continue };
        let rows = basis.roughness(&grid, orders[f]);
        problem
            .penalize(Penalty::new(f, orders[f], weight, rows))
            .unwrap();
        if positive {
            let low = if f == 0 { 0.05 } else { 0.0 };
            let mut group = RowGroup::new(format!("function {f} >= {low}"));
            for j in ranges[f].clone() {
                group.push([(j, 1.0)], [low, f64::INFINITY], [0.0, DURATION]);
            }
            *problem = problem
                .clone()
                .with(|parts| {
                    parts.constraints.groups.push(group);
                })
                .unwrap();
        }
    }
    let mut group = RowGroup::new("k(0) = 1");
    group.push([(ranges[2].start, 1.0)], [1.0, 1.0], [0.0, 0.0]);
    *problem = problem
        .clone()
        .with(|parts| {
            parts.constraints.groups.push(group);
        })
        .unwrap();
}

/// Largest distance of each function from the truth over the nodes, mass first.
pub fn errors(found: &NodalCoefficients, truth: &NodalCoefficients) -> Vec<f64> {
    let largest = |(a, b): (&[f64], &[f64])| {
        a.iter()
            .zip(b)
            .fold(0.0f64, |most, (a, b)| most.max((a - b).abs()))
    };
    found
        .functions()
        .zip(truth.functions())
        .map(largest)
        .collect()
}
