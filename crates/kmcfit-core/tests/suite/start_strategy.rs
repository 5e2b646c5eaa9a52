//! Start strategies: growing horizon, truncated start, continued attempts.

use crate::common;

use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Experiment, Weighting};
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Status, Stopping, fit, fit_from};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};

/// Nodes from one sample to the next.
const STRIDE: usize = 20;
const SAMPLES: usize = 121;
const STIFFNESS: f64 = 101.0;

/// 40 periods with three samples each, and only the stiffness estimated. Differences of so few samples underestimate the
/// acceleration by 15 %, so the period by the equation error is wrong by 7 %: a third of a period after an eighth of the record,
/// three periods at its end. The start values are wrong by 13 %.
fn problem() -> Problem {
    let nodes = STRIDE * (SAMPLES - 1) + 1;
    let system = System {
        grid: Grid::new(0.0, common::DURATION, nodes).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; nodes]],
        coefficients: vec![vec![0.05; nodes], vec![STIFFNESS; nodes]],
    };
    let response = system.forward(&truth, &common::initial(), None).unwrap();
    let observed: Vec<f64> = response
        .displacement(0)
        .iter()
        .copied()
        .step_by(STRIDE)
        .collect();
    let step = system.grid.step();
    // The noise is given as zero; a rule that estimates it would treat so few samples as noise.
    let weighting = Weighting::Sigma(1e-8);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
        CoefficientFunction::fixed(CoefficientKind::DAMPING, vec![0.05; nodes]),
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 130.0, nodes),
    ];
    let channel = Channel::displacement_at_nodes(observed, STRIDE, weighting, &system.grid);
    let experiment = Experiment::free("free decay", common::initial(), nodes).with_channel(channel);
    let functions = Parameterization::new(list, nodes, step).unwrap();
    Problem::new(system, functions, vec![experiment]).unwrap()
}

#[test]
fn the_growing_horizon_finds_a_period_that_the_other_starts_miss() {
    common::provide_clock();
    let problem = problem();
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-12),
            ..Stopping::exactly(100)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let start = problem.functions.start();
    let found = fit(&problem, &start, &settings, &mut |_| {}).unwrap();
    let names: Vec<&str> = found
        .attempts
        .iter()
        .map(|attempt| attempt.start.name())
        .collect();
    println!("{:#?}", found.attempts);
    assert_eq!(
        names,
        [
            "start values",
            "equation error",
            "growing part of the record"
        ]
    );
    let silence = problem.zero_response_misfit();
    let costs: Vec<f64> = found.attempts.iter().map(|attempt| attempt.cost).collect();
    // The first two end in minima with residuals of some per cent of the record, the last at the solution.
    assert!(
        costs[0] > 0.05 * silence && costs[1] > 0.05 * silence,
        "{costs:?} {silence}"
    );
    assert!(costs[2] < 1e-12 * silence, "{costs:?} {silence}");
    assert_eq!(found.best.evaluation.cost, costs[2]);
    assert_eq!(found.outcome.status, Status::Converged);
    // Rounding of the response, 2400 steps, over its sensitivity.
    let error = (found.best.parameters[0] / STIFFNESS - 1.0).abs();
    assert!(error < 1e-8, "{error}");
    // Every search takes a gradient at its start and one after each iteration; those of the three parts
    // of the record count as well as those of the three attempts.
    let iterations: u64 = found
        .attempts
        .iter()
        .map(|attempt| attempt.history.len() as u64)
        .sum();
    assert!(
        found.counts.adjoint >= iterations + 3 + 3,
        "{:?}",
        found.counts
    );
    let timings = &found.timings;
    for spent in [
        timings.forward,
        timings.adjoint,
        timings.tangent,
        timings.start,
    ] {
        assert!(!spent.is_zero(), "{timings:?}");
    }
    assert!(
        timings.sum() <= found.elapsed,
        "{timings:?} {:?}",
        found.elapsed
    );
}

/// A hardening spring under two sines that set in at node `first`, in a record twenty times as long as the truncated
/// one, with a sample at every fourth step.
fn long_record(first: usize) -> (Problem, [f64; 4]) {
    let nodes = 40_001;
    let system = System {
        grid: Grid::new(0.0, 40.0, nodes).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness, Law::CubicStiffness]),
    };
    let truth = [1.0, 1.2, 20.0, 15.0];
    let nodal = NodalCoefficients {
        inertias: vec![vec![truth[0]; nodes]],
        coefficients: truth[1..].iter().map(|p| vec![*p; nodes]).collect(),
    };
    let drive = |(i, t): (usize, f64)| match i < first {
        true => 0.0,
        false => 4.0 * (3.1 * t).sin() + 3.0 * (5.3 * t + 1.0).sin(),
    };
    let force: Vec<f64> = (system.grid.times().into_iter().enumerate())
        .map(drive)
        .collect();
    let excitation = Excitation::force_at_nodes(&force);
    let rest = State::one(0.0, 0.0);
    let response = system.forward(&nodal, &rest, Some(&excitation)).unwrap();
    let observed = response
        .displacement(0)
        .iter()
        .copied()
        .step_by(4)
        .collect();
    let weighting = Weighting::Sigma(1e-4);
    let channel = Channel::displacement_at_nodes(observed, 4, weighting, &system.grid);
    let experiment = Experiment::free("two sines", rest, nodes)
        .with_excitation(excitation)
        .with_channel(channel);
    let quantities = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
        CoefficientKind::CUBIC_STIFFNESS,
    ];
    let list = quantities.into_iter().zip([1.2, 1.0, 18.0, 12.0]);
    let list = list.map(|(quantity, start)| CoefficientFunction::constant(quantity, start, nodes));
    let step = system.grid.step();
    let functions = Parameterization::new(list.collect(), nodes, step).unwrap();
    (
        Problem::new(system, functions, vec![experiment]).unwrap(),
        truth,
    )
}

#[test]
fn constants_of_a_long_record_start_from_its_truncated_fit() {
    let (problem, truth) = long_record(0);
    let settings = FitSettings::default();
    let start = problem.start();
    let found = fit(&problem, &start, &settings, &mut |_| {}).unwrap();
    let alone = fit_from(&problem, &start, &settings).unwrap();
    let names: Vec<&str> = found
        .attempts
        .iter()
        .map(|attempt| attempt.start.name())
        .collect();
    assert_eq!(names, ["beginning of the record"]);
    // Without noise the truncated record determines the constants to its tolerance, and one step on the whole record gives the rest.
    assert!(
        found.history.len() * 2 < alone.history.len(),
        "{} {}",
        found.history.len(),
        alone.history.len()
    );
    // Both are compared to the start values.
    assert_eq!(found.initial_cost, alone.initial_cost);
    // One by an adjoint, the other from tangents: sums of 40,000 parts in another order.
    let relative = found.initial_norm_squared / alone.initial_norm_squared - 1.0;
    assert!(relative.abs() <= 1e-12, "{relative}");
    for ((p, q), truth) in (found.best.parameters.iter())
        .zip(&alone.best.parameters)
        .zip(truth)
    {
        // Rounding of 40,000 steps.
        assert!((p - truth).abs() <= 1e-9 * truth, "{p} {truth}");
        assert!((q - truth).abs() <= 1e-9 * truth, "{q} {truth}");
    }
}

/// A record that starts at rest has no information in its first steps: the fit starts from the start values.
#[test]
fn a_record_with_a_rest_at_its_start_is_fitted_as_a_whole() {
    let (problem, truth) = long_record(5000);
    let start = problem.start();
    let found = fit(&problem, &start, &FitSettings::default(), &mut |_| {}).unwrap();
    assert_eq!(found.attempts[0].start.name(), "start values");
    for (p, truth) in found.best.parameters.iter().zip(truth) {
        assert!((p - truth).abs() <= 1e-9 * truth, "{p} {truth}");
    }
}

/// Parts of a record have no sample at every node of the grid, which the continuous gradient needs: the fits of parts have
/// the discrete one.
#[test]
fn a_fit_by_the_continuous_gradient_tries_all_starting_points() {
    let nodes = 401;
    let system = System {
        grid: Grid::new(0.0, 20.0, nodes).unwrap(),
        method: Method::Midpoint,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    // A response that no oscillator has.
    let observed = (0..nodes).map(|i| ((i * i) as f64).sin()).collect();
    let weighting = Weighting::Integral {
        spacing: system.grid.step(),
    };
    let channel = Channel::displacement_at_nodes(observed, 1, weighting, &system.grid);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, nodes),
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 2.0, nodes),
    ];
    let functions = Parameterization::new(list, nodes, system.grid.step()).unwrap();
    let experiment = Experiment::free("rubbish", common::initial(), nodes).with_channel(channel);
    let problem = Problem::new(system, functions, vec![experiment]).unwrap();
    assert!(problem.supports_continuous() && !problem.truncated(0.5).supports_continuous());
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Continuous,
        stopping: Stopping {
            tolerance: Some(1e-10),
            ..Stopping::exactly(20)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let found = fit(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let names: Vec<&str> = found.attempts.iter().map(|r| r.start.name()).collect();
    assert!(names.contains(&"growing part of the record"), "{names:?}");
}
