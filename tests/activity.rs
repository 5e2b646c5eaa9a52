//! Which constraints a report calls active, and how hard it says they are pushed.

mod common;

use kmcfit::constraints::{RowGroup, Statement};
use kmcfit::dynamics::{Device, Method};
use kmcfit::functions::{CoefficientFunction, Functions, Quantity};
use kmcfit::objective::GradientKind;
use kmcfit::problem::Problem;
use kmcfit::solvers::{FitSettings, Initial, Solver, Stopping, active_constraints, fit};

const NODES: usize = 101;

/// m = k = 1 known, a constant c sought from the motion of c = 0.8, its damping ratio capped.
fn capped(cap: f64) -> Problem {
    let oscillator = common::oscillator(NODES, Method::Rk4);
    let truth = Device {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.8; NODES], vec![1.0; NODES]],
    };
    let observed = oscillator.forward(&truth, common::INITIAL, None).unwrap();
    let list = vec![
        CoefficientFunction::fixed(Quantity::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(Quantity::Damping, 0.1, NODES),
        CoefficientFunction::fixed(Quantity::Stiffness, vec![1.0; NODES]),
    ];
    let mut problem = common::problem_of(oscillator, list, observed.displacement, None);
    let statement = Statement::DampingRatio { max: cap };
    let functions: &Functions = &problem.functions;
    problem.constraints = statement
        .build(&problem.oscillator.grid, functions)
        .unwrap();
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
        interrupt: None,
    }
}

/// zeta = c/2 here, so the cap 0.2 stops c at 0.4. The bound of the cone is m + k, against
/// |(c/zeta, m - k)|: where it gives way by d, c grows by zeta d, and J falls by zeta |dJ/dc| d.
#[test]
fn a_cap_on_the_damping_ratio_is_reported_with_its_multiplier() {
    let problem = capped(0.2);
    let found = fit(
        &problem,
        &problem.functions.start(),
        &settings(),
        &mut |_| {},
    )
    .unwrap();
    let theta = &found.best.parameters;
    // To the 1e-9 of the cone's size that constraints hold to.
    assert!((theta[0] - 0.4).abs() < 1e-8, "{theta:?}");
    let active = active_constraints(&problem, &found.best);
    let [cap] = active.as_slice() else {
        panic!("{active:?}");
    };
    assert!(cap.name.contains("damping ratio"), "{}", cap.name);
    assert!(!cap.pushed.is_empty(), "{cap:?}");
    let expected = 0.2 * found.best.gradient.euclidean[0].abs();
    // The accuracy of the quadratic program behind it.
    assert!(
        (cap.multiplier / expected - 1.0).abs() < 1e-6,
        "{} is not {expected}",
        cap.multiplier
    );
}

#[test]
fn a_cap_that_is_not_reached_is_not_reported() {
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

/// `-2 c >= -0.8` stops c at 0.4: where the bound gives way by d, c grows by d/2. The wider bound
/// on the same parameter is not near.
#[test]
fn a_bound_on_one_parameter_is_reported_with_its_multiplier() {
    let mut problem = capped(0.2);
    problem.constraints = Default::default();
    let mut wide = RowGroup::new("c <= 0.5");
    wide.push(
        [(0, 1.0)],
        [f64::NEG_INFINITY, 0.5],
        [0.0, common::DURATION],
    );
    let mut tight = RowGroup::new("-2 c >= -0.8");
    tight.push([(0, -2.0)], [-0.8, f64::INFINITY], [0.0, common::DURATION]);
    problem.constraints.groups = vec![wide, tight];
    let start = problem.functions.start();
    let found = fit(&problem, &start, &settings(), &mut |_| {}).unwrap();
    assert!((found.best.parameters[0] - 0.4).abs() < 1e-12);
    let active = active_constraints(&problem, &found.best);
    let [bound] = active.as_slice() else {
        panic!("{active:?}");
    };
    assert_eq!(bound.name, "-2 c >= -0.8");
    assert!(!bound.pushed.is_empty(), "{bound:?}");
    let expected = 0.5 * found.best.gradient.euclidean[0].abs();
    // Exact but for the distance of the parameter from its bound.
    assert!(
        (bound.multiplier / expected - 1.0).abs() < 1e-10,
        "{bound:?} {expected}"
    );
}
