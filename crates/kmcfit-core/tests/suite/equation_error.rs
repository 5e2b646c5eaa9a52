//! The equation-error start: information that determines the common scale of m, c and k, and information that does
//! not.

use crate::common;

use crate::common::synthetic::Truth;
use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Measurements, Weighting};
use kmcfit_core::solvers::equation_error;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use std::f64::consts::TAU;

const NODES: usize = 401;
const START: f64 = 2.0;

/// Free response of m = 1, c = 0, k = 1.5, a force of zero if asked for; m and k are constants to be
/// found from a mass of 2, c is fixed at `damping`, or estimated if that is `None`.
fn problem(damping: Option<f64>, silent_force: bool) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; NODES]],
        coefficients: vec![vec![damping.unwrap_or(0.0); NODES], vec![1.5; NODES]],
    };
    let response = system.forward(&truth, &common::initial(), None).unwrap();
    let damping = match damping {
        Some(value) => CoefficientFunction::fixed(CoefficientKind::DAMPING, vec![value; NODES]),
        None => CoefficientFunction::constant(CoefficientKind::DAMPING, 0.5, NODES),
    };
    let list = vec![
        CoefficientFunction::constant(CoefficientKind::MASS, START, NODES),
        damping,
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 1.0, NODES),
    ];
    let mut problem = common::problem_of(system, list, response.displacement(0).to_vec(), None);
    if silent_force {
        problem = problem
            .with(|parts| {
                parts.experiments[0].excitation =
                    Some(Excitation::force_at_nodes(&vec![0.0; NODES]));
            })
            .unwrap();
    }
    problem
}

/// `value` as the only value of parameter `j`.
fn fixed(j: usize, value: f64) -> RowGroup {
    let mut group = RowGroup::new("fixed");
    group.push([(j, 1.0)], [value, value], [0.0, 0.0]);
    group
}

/// The differences are of order 4 and the smoothing is as rough as the noise that it estimates: the
/// ratio of k to m is found to per mille.
fn close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 5e-3 * expected.abs().max(1.0),
        "{found} {expected}"
    );
}

/// Without information about the scale the mass keeps its start value; otherwise zero coefficients would minimise the equation
/// error.
#[test]
fn the_mass_keeps_its_mean_where_nothing_fixes_the_scale() {
    let mut with_zero = problem(None, false);
    with_zero = with_zero
        .with(|parts| {
            parts.constraints.groups.push(fixed(1, 0.0));
        })
        .unwrap();
    let mut bounded = problem(None, false);
    let mut group = RowGroup::new("mass > 0");
    group.push([(0, 1.0)], [0.05, f64::INFINITY], [0.0, 0.0]);
    bounded = bounded
        .with(|parts| {
            parts.constraints.groups.push(group);
        })
        .unwrap();
    let cases = [
        ("nothing", problem(None, false)),
        ("a function fixed at zero", problem(Some(0.0), false)),
        ("a force that is zero", problem(None, true)),
        ("an equality with zero", with_zero),
        ("an inequality", bounded),
    ];
    for (name, problem) in cases {
        let found = equation_error(&problem, &problem.functions.start()).unwrap();
        println!("{name}: {found:?}");
        close(found[0], START);
        close(*found.last().unwrap(), 1.5 * START);
    }
}

#[test]
fn a_fixed_function_or_value_sets_the_scale() {
    // c = 0.1 is known, so m is 1, not 2.
    let known = problem(Some(0.1), false);
    let found = equation_error(&known, &known.functions.start()).unwrap();
    assert!((found[0] - 1.0).abs() < 0.1, "{found:?}");
    // k = 3 is imposed, so m is 2 k/m apart from it; an equality far smaller than the start as well.
    for value in [3.0, 3e-7] {
        let mut demanded = problem(None, false);
        demanded = demanded
            .with(|parts| {
                parts.constraints.groups.push(fixed(2, value));
            })
            .unwrap();
        let found = equation_error(&demanded, &demanded.functions.start()).unwrap();
        assert!(
            (found[0] / (value / 1.5) - 1.0).abs() < 5e-3,
            "{value}: {found:?}"
        );
    }
}

/// Velocities at irregular times, almost without noise: they are integrated to the displacement although their spectrum differs from that
/// of equally spaced samples.
#[test]
fn irregular_velocities_are_integrated() {
    let mut problem = problem(Some(0.1), false);
    let grid = problem.system.grid;
    let late = |i: usize| 0.4 * (1.0 + (1.7 * i as f64).sin() * (0.3 * i as f64).cos());
    let times: Vec<f64> = (0..100).map(|i| 0.25 * (i as f64 + late(i))).collect();
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; NODES]],
        coefficients: vec![vec![0.1; NODES], vec![1.5; NODES]],
    };
    let maker = Truth {
        system: &problem.system,
        nodal: &truth,
        excitation: None,
        initial: common::initial(),
    };
    let kind = ChannelKind::Velocity;
    let values = maker.seen(kind, &times, &[]);
    let weighting = Weighting::Sigma(1e-3);
    let channel = Channel::new(kind, times, values, weighting, &grid, NODES).unwrap();
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels = vec![channel];
        })
        .unwrap();
    let found = equation_error(&problem, &problem.functions.start()).unwrap();
    // The damping is known, so the scale is: to the few per cent of a start.
    let ratio = found[1] / found[0];
    assert!((ratio / 1.5 - 1.0).abs() < 0.05, "{found:?}");
}

/// Two records of cosines with a known mass and constant damping and stiffness: amplitudes 0.7 and 1.1, periods of 100 and 50
/// samples of 0.01 s. Without the two at each end, from which no derivatives follow, the samples are whole periods.
const COSINES: [(f64, f64); 2] = [(0.7, 1.0), (1.1, 0.5)];

fn cosines() -> Problem {
    let nodes = 504;
    let grid = Grid::new(0.0, 5.03, nodes).unwrap();
    let list = vec![
        CoefficientFunction::constant(CoefficientKind::MASS, 1.0, nodes),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.5, nodes),
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 50.0, nodes),
    ];
    let functions = Parameterization::new(list, nodes, grid.step()).unwrap();
    let record = |(amplitude, period): (f64, f64)| {
        let cosine = |t: &f64| amplitude * (TAU * t / period).cos();
        let samples = grid.times().iter().map(cosine).collect();
        // Samples without noise are not smoothed.
        let weighting = Weighting::Sigma(1e-9);
        let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
        Experiment::free("cosine", State::rest(1), nodes).with_channel(channel)
    };
    let system = System {
        grid,
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    Problem::new(system, functions, COSINES.map(record).to_vec()).unwrap()
}

/// `sum_i mean(phi_i^2) T^(2 order)` with the mean period T, where `phi` is y'', y' and y for m, c and k.
#[test]
fn the_weight_of_the_rule_period_is_that_of_harmonic_responses() {
    let problem = cosines();
    let measurements = Measurements::of(&problem).unwrap();
    let mean_period = COSINES.iter().map(|(_, period)| period).sum::<f64>() / 2.0;
    for (index, derivative) in [2, 1, 0].into_iter().enumerate() {
        let square = |(amplitude, period): &(f64, f64)| {
            0.5 * (amplitude * (TAU / period).powi(derivative)).powi(2)
        };
        let squares: f64 = COSINES.iter().map(square).sum();
        for order in 0..3 {
            let expected = squares * mean_period.powi(2 * order);
            let found = measurements.period_weight(&problem, index, order as usize);
            // Differences of order 4 of 50 samples per period, (TAU/50)^4/30 = 8e-6, in up to six factors.
            assert!(
                (found / expected - 1.0).abs() < 6.0 * 8.4e-6,
                "{found} {expected}"
            );
        }
    }
}
