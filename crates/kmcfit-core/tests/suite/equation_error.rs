//! The equation-error start: information that determines the common scale of m, c and k, and information that does
//! not.

use crate::common;

use crate::common::synthetic::Truth;
use kmcfit_core::internals::constraints::RowGroup;
use kmcfit_core::internals::functions::basis::uniform_knots;
use kmcfit_core::internals::functions::{
    Basis, CoefficientFunction, CoefficientKind, Parameterization, Penalty,
};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::record::{Channel, ChannelKind, Experiment, Weighting};
use kmcfit_core::internals::solvers::{FitSettings, Measurements, Solver, equation_error, fit};
use kmcfit_core::internals::system::{
    Excitation, Grid, Method, NodalCoefficients, State, System, Term,
};
use std::f64::consts::TAU;

const NODES: usize = 401;
const START: f64 = 2.0;

/// Free response of m = 1, c = 0, k = 1.5, a force of zero if asked for; m and k are constants to be
/// found from a mass of 2, c is fixed at `damping`, or estimated if that is `None`.
fn problem(damping: Option<f64>, silent_force: bool) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let truth = NodalCoefficients {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![damping.unwrap_or(0.0); NODES], vec![1.5; NODES]],
    };
    let response = system.forward(&truth, common::INITIAL, None).unwrap();
    let damping = match damping {
        Some(value) => CoefficientFunction::fixed(CoefficientKind::Damping, vec![value; NODES]),
        None => CoefficientFunction::constant(CoefficientKind::Damping, 0.5, NODES),
    };
    let list = vec![
        CoefficientFunction::constant(CoefficientKind::Mass, START, NODES),
        damping,
        CoefficientFunction::constant(CoefficientKind::Stiffness, 1.0, NODES),
    ];
    let mut problem = common::problem_of(system, list, response.displacement, None);
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

/// A system need not have a damping, nor a stiffness in any place of its list.
#[test]
fn systems_without_damping_have_an_equation_error() {
    let mut system = common::system(NODES, Method::Rk4);
    system.terms = vec![Term::Stiffness];
    let truth = NodalCoefficients {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![1.5; NODES]],
    };
    let response = system.forward(&truth, common::INITIAL, None).unwrap();
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Stiffness, 1.0, NODES),
    ];
    let problem = common::problem_of(system, list, response.displacement, None);
    let found = equation_error(&problem, &problem.functions.start()).unwrap();
    close(found[0], 1.5);
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
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.1; NODES], vec![1.5; NODES]],
    };
    let maker = Truth {
        system: &problem.system,
        nodal: &truth,
        excitation: None,
        initial: common::INITIAL,
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

/// Mass, stiffness and samples in other units, and the penalty with them: the weight of the
/// samples is unchanged, so the start is the same up to the unit.
#[test]
fn the_start_does_not_depend_on_units_of_mass_and_length() {
    let plain = problem(Some(0.0), false);
    let observed = plain.experiments[0].channels[0].observed().to_vec();
    let observed = common::synthetic::with_noise(&observed, 0.05, 4);
    let start = |unit: f64, length: f64, weight: f64| -> Vec<f64> {
        let basis = Basis::PiecewiseLinear {
            knots: uniform_knots(&plain.system.grid, 6),
        };
        let rows = basis.roughness(&plain.system.grid, 1);
        let stiffness = vec![unit; 6];
        let list = vec![
            CoefficientFunction::fixed(CoefficientKind::Mass, vec![unit; NODES]),
            CoefficientFunction::fixed(CoefficientKind::Damping, vec![0.0; NODES]),
            CoefficientFunction::free(
                CoefficientKind::Stiffness,
                basis,
                &plain.system.grid,
                stiffness,
            ),
        ];
        let observed = observed.iter().map(|y| y * length).collect();
        let mut problem = common::problem_of(plain.system.clone(), list, observed, None);
        let weight = weight * (length / unit).powi(2);
        problem.penalize(Penalty::new(2, 1, weight, rows)).unwrap();
        let found = equation_error(&problem, &problem.functions.start()).unwrap();
        found.iter().map(|k| k / unit).collect()
    };
    let most = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        pairs.fold(0.0, f64::max)
    };
    let smoothed = start(1.0, 1.0, 1e2);
    // The penalty has its part in it.
    let free = start(1.0, 1.0, 1e-6);
    assert!(most(&smoothed, &free) > 1e-3, "{smoothed:?} {free:?}");
    for (unit, length) in [(1e-3, 1.0), (1e3, 1.0), (1.0, 1e-3), (1.0, 1e3)] {
        let other = start(unit, length, 1e2);
        assert!(most(&other, &smoothed) < 1e-6, "{other:?} {smoothed:?}");
    }
}

/// The smoothing by a penalty depends on the spring force and the inertia force at the start, whatever a
/// damping that is estimated begins with.
#[test]
fn the_start_of_a_damping_has_no_part_in_the_smoothing() {
    let plain = problem(Some(0.0), false);
    let observed = plain.experiments[0].channels[0].observed().to_vec();
    let observed = common::synthetic::with_noise(&observed, 0.05, 4);
    let start = |damping: f64, weight: f64| {
        let grid = plain.system.grid;
        let basis = Basis::PiecewiseLinear {
            knots: uniform_knots(&grid, 6),
        };
        let rows = basis.roughness(&grid, 1);
        let list = vec![
            CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
            CoefficientFunction::constant(CoefficientKind::Damping, damping, NODES),
            CoefficientFunction::free(CoefficientKind::Stiffness, basis, &grid, vec![1.0; 6]),
        ];
        let observed = observed.clone();
        let mut problem = common::problem_of(plain.system.clone(), list, observed, None);
        problem.penalize(Penalty::new(2, 1, weight, rows)).unwrap();
        equation_error(&problem, &problem.functions.start()).unwrap()
    };
    let most = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        pairs.fold(0.0, f64::max)
    };
    let smoothed = start(0.01, 1e2);
    let free = start(0.01, 1e-6);
    assert!(most(&smoothed, &free) > 1e-3, "{smoothed:?} {free:?}");
    let other = start(10.0, 1e2);
    // The pull towards the start, which is 1e-9 of the equation.
    assert!(most(&other, &smoothed) < 1e-5, "{other:?} {smoothed:?}");
}

/// Two records of cosines with a known mass and constant damping and stiffness: amplitudes 0.7 and 1.1, periods of 100 and 50
/// samples of 0.01 s. Without the two at each end, from which no derivatives follow, the samples are whole periods.
const COSINES: [(f64, f64); 2] = [(0.7, 1.0), (1.1, 0.5)];

fn cosines() -> Problem {
    let nodes = 504;
    let grid = Grid::new(0.0, 5.03, nodes).unwrap();
    let list = vec![
        CoefficientFunction::constant(CoefficientKind::Mass, 1.0, nodes),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.5, nodes),
        CoefficientFunction::constant(CoefficientKind::Stiffness, 50.0, nodes),
    ];
    let functions = Parameterization::new(list, nodes, grid.step()).unwrap();
    let record = |(amplitude, period): (f64, f64)| {
        let cosine = |t: &f64| amplitude * (TAU * t / period).cos();
        let samples = grid.times().iter().map(cosine).collect();
        // Samples without noise are not smoothed.
        let weighting = Weighting::Sigma(1e-9);
        let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
        Experiment::free("cosine", State::default(), nodes).with_channel(channel)
    };
    let system = System {
        grid,
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
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

/// Accelerations `a` of a cosine, between nodes, of a system with a stiffness `1 + DELTA` times that of the cosine: the equation of
/// motion predicts `(1 + DELTA) a` of the part `H` of the sample that passes the filter, and the rest of the sample.
#[test]
fn an_acceleration_is_predicted_by_the_equation_of_motion() {
    const DELTA: f64 = 0.3;
    const MASS: f64 = 2.5;
    let (nodes, frequency) = (4001, TAU);
    let grid = Grid::new(0.0, 40.0, nodes).unwrap();
    let stiffness = MASS * frequency * frequency * (1.0 + DELTA);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![MASS; nodes]),
        CoefficientFunction::fixed(CoefficientKind::Damping, vec![0.0; nodes]),
        CoefficientFunction::constant(CoefficientKind::Stiffness, stiffness, nodes),
    ];
    let functions = Parameterization::new(list, nodes, grid.step()).unwrap();
    let times: Vec<f64> = grid.times()[..nodes - 1]
        .iter()
        .map(|t| t + 0.003)
        .collect();
    let samples: Vec<f64> = times.iter().map(|t| (frequency * t).cos()).collect();
    let weighting = Weighting::Integral { spacing: 0.01 };
    let kind = ChannelKind::Acceleration;
    let channel = Channel::new(kind, times, samples.clone(), weighting, &grid, nodes).unwrap();
    let record = Experiment::free("cosine", State::default(), nodes).with_channel(channel);
    let system = System {
        grid,
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let mut problem = Problem::new(system, functions, vec![record]).unwrap();
    let mut group = RowGroup::new("stiffness");
    group.push([(0, 1.0)], [stiffness; 2], [0.0, 40.0]);
    problem = problem
        .with(|parts| parts.constraints.groups.push(group))
        .unwrap();
    let settings = FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    };
    let fit = fit(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let predicted = &fit.best.evaluation.predictions[0][0];
    // The first and the last sample have no state and are their own predictions.
    let last = samples.len() - 1;
    assert_eq!(predicted[0], samples[0]);
    assert_eq!(predicted[last], samples[last]);
    let squares: f64 = predicted
        .iter()
        .zip(&samples)
        .map(|(p, s)| (p - s).powi(2))
        .sum();
    // The misfit is that of averages by bump functions of 0.7 periods, 71 samples, of a cosine with 100 samples per period; those at
    // the ends, half a period of forty, have less weight.
    let bump = |k: f64| (1.0 - (k / 36.0).powi(2)).powi(3);
    let offsets = || (-35..=35).map(f64::from);
    let sum: f64 = offsets().map(bump).sum();
    let average: f64 = offsets().map(|k| bump(k) * (TAU * k / 100.0).cos()).sum();
    let misfit = (average / sum).powi(2) * 0.01 * MASS * MASS * squares;
    let ratio = misfit / fit.best.evaluation.misfit;
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    // The corner is at half the dominant frequency, which the ends of the record change by less than a per mille, and H by a
    // fifth of that.
    let passed = 1.0 / (1.0 + 0.5f64.powi(4));
    // Ten periods from both ends, where the transients of the filter have decayed to 1e-10.
    for i in 1000..3000 {
        let expected = samples[i] * (1.0 + passed * DELTA);
        let off = (predicted[i] - expected).abs();
        assert!(off < 1e-4, "{i}: {} {expected}", predicted[i]);
    }
}
