//! Active constraints of a fit and their multipliers.

use crate::common;

use kmcfit_core::constraints::{Constraint, RowGroup};
use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Stopping, active_constraints, fit};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};

const NODES: usize = 101;

/// m = k = 1 known, a constant c estimated from the response of c = 0.8, with an upper bound of its damping ratio.
fn capped(cap: f64) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; NODES]],
        coefficients: vec![vec![0.8; NODES], vec![1.0; NODES]],
    };
    let observed = system.forward(&truth, &common::initial(), None).unwrap();
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, NODES),
        CoefficientFunction::fixed(CoefficientKind::STIFFNESS, vec![1.0; NODES]),
    ];
    let mut problem = common::problem_of(system, list, observed.displacement(0).to_vec(), None);
    let statement = Constraint::DampingRatio { max: cap };
    let rows = statement.build(&problem.system.grid, &problem.functions);
    problem.constrain(rows.unwrap()).unwrap();
    problem
}

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-12),
            ..Stopping::exactly(30)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

/// zeta = c/2 here, so the bound 0.2 limits c to 0.4. The bound of the cone is m + k, against
/// |(c/zeta, m - k)|: if it is relaxed by d, c grows by zeta d, and J falls by zeta |dJ/dc| d.
#[test]
fn an_active_bound_on_the_damping_ratio_is_reported_with_its_multiplier() {
    let problem = capped(0.2);
    let found = fit(
        &problem,
        &problem.functions.start(),
        &settings(),
        &mut |_| {},
    )
    .unwrap();
    let theta = &found.best.parameters;
    // To the tolerance of constraints, 1e-9 of the size of the cone.
    assert!((theta[0] - 0.4).abs() < 1e-8, "{theta:?}");
    let active = active_constraints(&problem, &found.best);
    let [cap] = active.as_slice() else {
        panic!("{active:?}");
    };
    assert!(cap.name.contains("damping ratio"), "{}", cap.name);
    assert!(!cap.binding.is_empty(), "{cap:?}");
    let expected = 0.2 * found.best.gradient.euclidean[0].abs();
    // The accuracy of the quadratic program.
    assert!(
        (cap.multiplier / expected - 1.0).abs() < 1e-6,
        "{} is not {expected}",
        cap.multiplier
    );
}

#[test]
fn an_inactive_bound_on_the_damping_ratio_is_not_reported() {
    let problem = capped(0.5);
    let found = fit(
        &problem,
        &problem.functions.start(),
        &settings(),
        &mut |_| {},
    )
    .unwrap();
    assert!((found.best.parameters[0] - 0.8).abs() < 1e-9);
    assert!(active_constraints(&problem, &found.best).is_empty());
}

/// `-2 c >= -0.8` limits c to 0.4: if the bound is relaxed by d, c grows by d/2. The wider bound on the same parameter
/// is inactive.
#[test]
fn a_bound_on_one_parameter_is_reported_with_its_multiplier() {
    let mut problem = capped(0.2);
    problem = problem
        .with(|parts| {
            parts.constraints = Default::default();
        })
        .unwrap();
    let mut wide = RowGroup::new("c <= 0.5");
    wide.push(
        [(0, 1.0)],
        [f64::NEG_INFINITY, 0.5],
        [0.0, common::DURATION],
    );
    let mut tight = RowGroup::new("-2 c >= -0.8");
    tight.push([(0, -2.0)], [-0.8, f64::INFINITY], [0.0, common::DURATION]);
    for groups in [[wide.clone(), tight.clone()], [tight, wide]] {
        problem = problem
            .with(|parts| {
                parts.constraints.groups = groups.to_vec();
            })
            .unwrap();
        let start = problem.functions.start();
        let found = fit(&problem, &start, &settings(), &mut |_| {}).unwrap();
        assert!((found.best.parameters[0] - 0.4).abs() < 1e-12);
        let active = active_constraints(&problem, &found.best);
        let [bound] = active.as_slice() else {
            panic!("{active:?}");
        };
        assert_eq!(bound.name, "-2 c >= -0.8");
        assert!(!bound.binding.is_empty(), "{bound:?}");
        let expected = 0.5 * found.best.gradient.euclidean[0].abs();
        // Exact up to the distance of the parameter from its bound.
        assert!(
            (bound.multiplier / expected - 1.0).abs() < 1e-10,
            "{bound:?} {expected}"
        );
    }
}

/// m = 1 known, c = 0.8 and k = 1 estimated, their sum at most `cap`.
fn with_sum_below(cap: f64) -> Problem {
    let mut problem = capped(0.2);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.4, NODES),
        CoefficientFunction::constant(CoefficientKind::STIFFNESS, 0.4, NODES),
    ];
    problem = problem
        .with(|parts| {
            parts.functions = Parameterization::new(list, NODES, parts.system.grid.step()).unwrap();
        })
        .unwrap();
    let mut group = RowGroup::new("sum");
    let times = [0.0, common::DURATION];
    group.push([(0, 1.0), (1, 1.0)], [f64::NEG_INFINITY, cap], times);
    problem = problem
        .with(|parts| {
            parts.constraints = Default::default();
        })
        .unwrap();
    problem = problem
        .with(|parts| {
            parts.constraints.groups = vec![group];
        })
        .unwrap();
    problem
}

/// The multiplier is the decrease of the minimum of J per unit by which the bound is relaxed.
#[test]
fn a_bound_on_a_sum_is_reported_with_its_multiplier() {
    let best = |cap: f64| {
        let problem = with_sum_below(cap);
        let start = problem.functions.start();
        let found = fit(&problem, &start, &settings(), &mut |_| {}).unwrap();
        (problem, found.best)
    };
    let (problem, found) = best(1.5);
    let active = active_constraints(&problem, &found);
    let [sum] = active.as_slice() else {
        panic!("{active:?}");
    };
    assert!(!sum.binding.is_empty(), "{sum:?}");
    let cost = |cap: f64| best(cap).1.evaluation.cost;
    let h = 1e-3;
    let expected = (cost(1.5 - h) - cost(1.5 + h)) / (2.0 * h);
    // Central differences: h^2.
    assert!(
        (sum.multiplier / expected - 1.0).abs() < 1e-4,
        "{sum:?} {expected}"
    );
}
