//! Small problems with few parameters.

use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{
    Basis, CoefficientFunction, Parameterization, Prior, ScalarParameter, ScalarValue,
};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Experiment, Sensor, Weighting};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};

pub const SIGMA: f64 = 0.05;
pub fn rest() -> State {
    State::one(1.0, 0.0)
}

pub fn system(duration: f64, nodes: usize) -> System {
    System {
        grid: Grid::new(0.0, duration, nodes).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

/// One value for each function.
pub fn nodal(nodes: usize, [m, c, k]: [f64; 3]) -> NodalCoefficients {
    NodalCoefficients {
        inertias: vec![vec![m; nodes]],
        coefficients: vec![vec![c; nodes], vec![k; nodes]],
    }
}

/// Constants: estimated from the value where it is `Some`, else known to be the number beside it.
pub fn constants(
    nodes: usize,
    starts: [Option<f64>; 3],
    known: [f64; 3],
) -> Vec<CoefficientFunction> {
    let quantities = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
    ];
    let each = quantities.into_iter().zip(starts).zip(known);
    each.map(|((quantity, estimated), known)| match estimated {
        Some(start) => CoefficientFunction::constant(quantity, start, nodes),
        None => CoefficientFunction::fixed(quantity, vec![known; nodes]),
    })
    .collect()
}

/// Samples of `truth` at every `stride`-th node with noise of the seed.
pub fn samples(
    system: &System,
    truth: &NodalCoefficients,
    excitation: Option<&Excitation>,
    stride: usize,
    sigma: f64,
    seed: u64,
) -> Vec<f64> {
    let response = system.forward(truth, &rest(), excitation).unwrap();
    let every: Vec<f64> = response
        .displacement(0)
        .iter()
        .step_by(stride)
        .copied()
        .collect();
    crate::common::synthetic::with_noise(&every, sigma, seed)
}

/// Samples from rest at one metre, every `stride` nodes, sigma `SIGMA` unless none is asked for.
pub fn problem(
    system: System,
    list: Vec<CoefficientFunction>,
    scalars: Vec<ScalarParameter>,
    record: Record,
) -> Problem {
    let grid = system.grid;
    let functions = Parameterization::new(list, grid.nodes(), grid.step()).unwrap();
    let channel =
        Channel::displacement_at_nodes(record.samples, record.stride, record.weighting, &grid)
            .with_sensor(record.sensor);
    let mut experiment = Experiment::free("record", rest(), grid.nodes()).with_channel(channel);
    experiment.excitation = record.excitation;
    experiment.initial_parameters = record.initial_parameters.to_vec();
    Problem::new(system, functions.with_scalars(scalars), vec![experiment]).unwrap()
}

pub struct Record {
    pub samples: Vec<f64>,
    pub stride: usize,
    pub weighting: Weighting,
    pub sensor: Sensor,
    pub excitation: Option<Excitation>,
    pub initial_parameters: [Option<usize>; 2],
}

impl Record {
    pub fn of(samples: Vec<f64>, stride: usize) -> Self {
        Self {
            samples,
            stride,
            weighting: Weighting::Sigma(SIGMA),
            sensor: Sensor::default(),
            excitation: None,
            initial_parameters: [None; 2],
        }
    }
}

pub fn scalar(name: &str, start: f64, prior: Option<Prior>) -> ScalarParameter {
    ScalarParameter {
        name: name.into(),
        unit: "m".into(),
        start,
        size: 1.0,
        prior,
    }
}

/// Initial displacement and velocity and the offset of the sensor are estimated, the system is known:
/// the predictions are linear in all three.
pub fn linear(seed: u64) -> Problem {
    let system = system(10.0, 201);
    let truth = [1.0, 0.1, 2.0];
    let values = samples(&system, &nodal(201, truth), None, 4, SIGMA, seed);
    let sensor = Sensor {
        offset: ScalarValue::Estimated(2),
        ..Sensor::default()
    };
    let record = Record {
        sensor,
        initial_parameters: [Some(0), Some(1)],
        ..Record::of(values, 4)
    };
    let names = ["displacement", "velocity", "offset"];
    let scalars = names.map(|name| scalar(name, 0.5, None)).to_vec();
    problem(system, constants(201, [None; 3], truth), scalars, record)
}

/// Damping and stiffness of a known mass.
pub fn regular(seed: u64) -> Problem {
    let system = system(10.0, 101);
    let truth = nodal(101, [1.0, 0.2, 2.0]);
    let values = samples(&system, &truth, None, 2, SIGMA, seed);
    let list = constants(101, [None, Some(0.1), Some(1.9)], [1.0, 0.0, 0.0]);
    problem(system, list, Vec::new(), Record::of(values, 2))
}

/// `low <= parameter j <= high`.
pub fn bound(problem: &mut Problem, name: &str, j: usize, bounds: [f64; 2]) {
    let mut group = RowGroup::new(name);
    group.push([(j, 1.0)], bounds, [0.0, 0.0]);
    *problem = problem
        .clone()
        .with(|parts| parts.constraints.groups.push(group))
        .unwrap();
}

/// Stiffness linear between knots, damping constant, mass known.
pub fn knots(truth: &dyn Fn(f64) -> f64, knots: usize, sigma: f64, seed: u64) -> Problem {
    let system = system(10.0, 201);
    let grid = system.grid;
    let mut moving = nodal(201, [1.0, 0.1, 2.0]);
    moving.coefficients[1] = grid.times().iter().map(|t| truth(*t)).collect();
    let values = samples(&system, &moving, None, 2, sigma, seed);
    let times = (0..knots).map(|i| 10.0 * i as f64 / (knots - 1) as f64);
    let basis = Basis::PiecewiseLinear {
        knots: times.collect(),
    };
    let start = basis.constant(&grid, 2.0);
    let mut list = constants(201, [None, Some(0.1), None], [1.0, 0.0, 2.0]);
    list[2] = CoefficientFunction::free(CoefficientKind::STIFFNESS, basis, &grid, start);
    let record = Record {
        weighting: Weighting::Sigma(sigma),
        ..Record::of(values, 2)
    };
    problem(system, list, Vec::new(), record)
}
