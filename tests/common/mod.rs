//! Problems with known answers, met by the tests of every layer.
#![allow(dead_code)]

pub mod closed_form;
pub mod reference;

use kmcfit::dynamics::{Device, Grid, Method, Oscillator, State, Term};
use kmcfit::functions::{CoefficientFunction, Functions, Quantity};
use kmcfit::objective::{Readings, Weighting};
use kmcfit::problem::{Experiment, Problem};

pub const DURATION: f64 = 25.0;
pub const INITIAL: State = State {
    displacement: 3.3,
    velocity: 1.0,
};

pub fn oscillator(nodes: usize, method: Method) -> Oscillator {
    Oscillator {
        grid: Grid::new(0.0, DURATION, nodes).unwrap(),
        method,
        terms: vec![Term::Damping, Term::Stiffness],
    }
}

/// The device that made the paper's data: m_i = 1 - 0.5 (i+1)/N, c = 0, k = 1.
pub fn paper_device(nodes: usize) -> Device {
    let mass = (0..nodes)
        .map(|i| 1.0 - 0.5 * (i + 1) as f64 / nodes as f64)
        .collect();
    Device {
        mass,
        coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
    }
}

/// The paper's problem: one value per node, starting from constant `(m, c, k)`.
pub fn paper_problem(nodes: usize, start: [f64; 3]) -> Problem {
    let oscillator = oscillator(nodes, Method::Midpoint);
    let step = oscillator.grid.step();
    let observed = oscillator
        .forward(&paper_device(nodes), INITIAL, None)
        .unwrap()
        .displacement;
    let quantities = [Quantity::Mass, Quantity::Damping, Quantity::Stiffness];
    let list = quantities
        .into_iter()
        .zip(start)
        .map(|(q, value)| CoefficientFunction::nodal(q, vec![value; nodes]))
        .collect();
    let weighting = Weighting::Integral { spacing: step };
    let experiment = Experiment {
        name: "free decay".into(),
        initial: INITIAL,
        force: None,
        readings: Some(Readings::new(observed, 1, weighting)),
    };
    let functions = Functions::new(list, nodes, step).unwrap();
    Problem::new(oscillator, functions, vec![experiment])
}

/// A folder of shared reference data (`KMCFIT_SHARED`, by default `../shared`); `None`, loudly,
/// where it is absent.
pub fn shared(folder: &str) -> Option<std::path::PathBuf> {
    let root = std::env::var_os("KMCFIT_SHARED").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"),
        std::path::PathBuf::from,
    );
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
