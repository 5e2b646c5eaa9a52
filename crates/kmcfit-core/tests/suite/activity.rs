//! Active constraints of a fit and their multipliers.

use crate::common;

use kmcfit_core::internals::constraints::{Constraint, RowGroup};
use kmcfit_core::internals::functions::{CoefficientFunction, CoefficientKind, Parameterization};
use kmcfit_core::internals::objective::GradientKind;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{
    ActiveGroup, FitSettings, Initial, Solver, Status, Stopping, active_constraints, fit, fit_from,
};
use kmcfit_core::internals::system::{Method, NodalCoefficients};

const NODES: usize = 101;

/// m = k = 1 known, a constant c estimated from the response of c = 0.8, with an upper bound of its damping ratio.
fn capped(cap: f64) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let truth = NodalCoefficients {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.8; NODES], vec![1.0; NODES]],
    };
    let observed = system.forward(&truth, common::INITIAL, None).unwrap();
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.1, NODES),
        CoefficientFunction::fixed(CoefficientKind::Stiffness, vec![1.0; NODES]),
    ];
    let mut problem = common::problem_of(system, list, observed.displacement, None);
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
        qp: kmcfit_core::QpSolver::Auto,
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

/// m = 1 known, c and k estimated from samples of sigma `sigma`, by a fit without iterations.
fn resting(c: f64, k: f64, sigma: f64, groups: Vec<RowGroup>) -> Vec<ActiveGroup> {
    let plain = capped(0.2);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, c, NODES),
        CoefficientFunction::constant(CoefficientKind::Stiffness, k, NODES),
    ];
    let observed = plain.experiments[0].channels[0].observed().to_vec();
    let mut problem = common::problem_of(plain.system.clone(), list, observed, Some(sigma));
    problem = problem
        .with(|parts| {
            parts.constraints.groups = groups;
        })
        .unwrap();
    let settings = FitSettings {
        stopping: Stopping::exactly(0),
        ..settings()
    };
    let found = fit_from(&problem, &problem.start(), &settings).unwrap();
    assert_eq!(found.best.parameters, [c, k]);
    active_constraints(&problem, &found.best)
}

/// Multipliers of bounds on single parameters, against those of the program that rows of several
/// parameters need: with a row that is far from active, which has no other effect. J falls with c below 0.8, and with
/// k above 1. The point lies as near to its bounds as a program comes, for J in any unit.
#[test]
fn multipliers_of_bounds_on_one_parameter_are_those_of_a_program() {
    let (c, k) = (0.4, 1.3);
    let all = f64::INFINITY;
    let row = |name: &str, entries: &[(usize, f64)], bounds: [f64; 2]| {
        let mut group = RowGroup::new(name);
        group.push(entries.iter().copied(), bounds, [0.0, common::DURATION]);
        group
    };
    let near = 5e-7;
    let mut groups = vec![
        row(
            "-2 c from below",
            &[(0, -2.0)],
            [-2.0 * c * (1.0 + near), all],
        ),
        row(
            "c from above, less near",
            &[(0, 1.0)],
            [-all, c * (1.0 + 1.8 * near)],
        ),
        row(
            "3 k from below",
            &[(1, 3.0)],
            [3.0 * k * (1.0 - near), 100.0],
        ),
        row("-k far below", &[(1, -1.0)], [-100.0, -0.1]),
    ];
    let apart = row("sum", &[(0, 1.0), (1, 1.0)], [-all, 100.0]);
    for sigma in [1e-3, 1.0, 1e3, 1e6] {
        for _ in 0..2 {
            let simple = resting(c, k, sigma, groups.clone());
            let others = groups.iter().chain([&apart]).cloned().collect();
            let program = resting(c, k, sigma, others);
            assert_eq!(simple.len(), 3, "{simple:?}");
            assert_eq!(program.len(), 3, "{program:?}");
            let most = program.iter().fold(0.0f64, |m, g| m.max(g.multiplier));
            assert!(most > 0.0);
            for (one, other) in simple.iter().zip(&program) {
                // The accuracy of the program.
                let off = (one.multiplier - other.multiplier).abs();
                assert!(off < 1e-4 * most, "{sigma}: {one:?} {other:?}");
                assert_eq!((&one.name, &one.spans), (&other.name, &other.spans));
                assert_eq!(one.binding, other.binding, "{sigma}: {one:?} {other:?}");
                let is_nearest = !one.name.contains("less near");
                assert_eq!(!one.binding.is_empty(), is_nearest, "{one:?}");
            }
            groups.reverse();
        }
    }
}

/// J falls away from the active bound, towards the inactive bound of the same row.
#[test]
fn a_bound_with_a_gradient_away_from_it_is_not_active() {
    for a in [1.0, -2.0] {
        let mut group = RowGroup::new("c");
        let mut bounds = [0.4 * a, 0.5 * a];
        bounds.sort_by(f64::total_cmp);
        group.push([(0, a)], bounds, [0.0, common::DURATION]);
        for sigma in [1e-6, 1.0] {
            let active = resting(0.4, 1.0, sigma, vec![group.clone()]);
            let [touched] = active.as_slice() else {
                panic!("{active:?}");
            };
            assert_eq!((touched.rows, touched.multiplier), (1, 0.0), "{touched:?}");
            assert!(touched.binding.is_empty());
        }
    }
}

/// m = 1 known, c = 0.8 and k = 1 estimated, their sum at most `cap`.
fn with_sum_below(cap: f64) -> Problem {
    let mut problem = capped(0.2);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.4, NODES),
        CoefficientFunction::constant(CoefficientKind::Stiffness, 0.4, NODES),
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

/// [`capped`] with noise, and with m, c and k times `unit`: the responses are the same.
fn capped_in_units(unit: f64, cap: f64) -> Problem {
    let mut problem = capped(cap);
    let observed = problem.experiments[0].channels[0].observed().to_vec();
    let observed = common::synthetic::with_noise(&observed, 0.5, 3);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![unit; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.1 * unit, NODES),
        CoefficientFunction::fixed(CoefficientKind::Stiffness, vec![unit; NODES]),
    ];
    problem = common::problem_of(problem.system.clone(), list, observed, None);
    let statement = Constraint::DampingRatio { max: cap };
    let built = statement.build(&problem.system.grid, &problem.functions);
    problem = problem
        .with(|parts| {
            parts.constraints = built.unwrap();
        })
        .unwrap();
    problem
}

/// A constraint counts as active if relaxing it by one per cent would lower J by more than 1e-6 of J, to first order. The bound
/// m + k is relaxed by one per cent if c = zeta (m + k) is.
#[test]
fn the_significance_of_a_multiplier_does_not_depend_on_units() {
    let best = |unit: f64, cap: f64| {
        let problem = capped_in_units(unit, cap);
        let start = problem.functions.start();
        let found = fit(&problem, &start, &settings(), &mut |_| {}).unwrap();
        (problem, found.best)
    };
    let (free, at) = best(1.0, 10.0);
    let (c, cost) = (at.parameters[0], at.evaluation.cost);
    let slope_at = |c: f64| free.euclidean_gradient(&[c], &free.evaluate(&[c]).unwrap())[0];
    let h = 1e-3;
    let bend = (slope_at(c + h) - slope_at(c - h)) / (2.0 * h);
    for (share, counts) in [(20.0, true), (0.05, false)] {
        // At this distance below the best c the slope is this share of the smallest that counts.
        let distance = share * 1e-6 * cost / (0.01 * c * bend);
        assert!(distance < 0.05 * c, "{distance}");
        for unit in [1e-3, 1.0, 1e3] {
            let (problem, found) = best(unit, 0.5 * (c - distance));
            let active = active_constraints(&problem, &found);
            let [cap] = active.as_slice() else {
                panic!("{active:?}");
            };
            assert_eq!(!cap.binding.is_empty(), counts, "{share} {unit} {cap:?}");
        }
    }
}

/// The bound m + k of a cone is partly known and partly estimated. The constraint counts as active if relaxing it by one per
/// cent would lower J by more than 1e-6 of J, to first order.
#[test]
fn the_significance_of_a_cone_is_relative_to_its_whole_bound() {
    let mut problem = capped_in_units(1.0, 10.0);
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.5, NODES),
        CoefficientFunction::constant(CoefficientKind::Stiffness, 0.9, NODES),
    ];
    let (grid, observed) = (problem.system.grid, &problem.experiments[0].channels[0]);
    let observed = observed.observed().to_vec();
    problem = common::problem_of(problem.system.clone(), list, observed, None);
    let best = |problem: &Problem| {
        let start = problem.functions.start();
        fit(problem, &start, &settings(), &mut |_| {}).unwrap().best
    };
    let free = best(&problem).parameters;
    let ratio = free[0] / (2.0 * free[1].sqrt());
    let mut seen = [0; 2];
    for exponent in 6..18 {
        let max = ratio * (1.0 - 0.5f64.powi(exponent));
        let statement = Constraint::DampingRatio { max };
        problem = problem
            .with(|parts| {
                parts.constraints = statement.build(&grid, &parts.functions).unwrap();
            })
            .unwrap();
        let at = best(&problem);
        let active = active_constraints(&problem, &at);
        let [cap] = active.as_slice() else {
            panic!("{active:?}");
        };
        let gain = 0.01 * (1.0 + at.parameters[1]) * cap.multiplier;
        let counts = gain > 1e-6 * at.evaluation.cost;
        assert_eq!(!cap.binding.is_empty(), counts, "{max} {gain} {cap:?}");
        seen[usize::from(counts)] += 1;
    }
    assert!(seen.iter().all(|n| *n > 2), "{seen:?}");
}

/// If the bound prevents any step, the start is the minimum.
#[test]
fn a_start_at_an_active_bound_is_the_minimum() {
    let mut problem = capped(0.2);
    let mut group = RowGroup::new("c <= 0.1");
    let times = [0.0, common::DURATION];
    group.push([(0, 1.0)], [f64::NEG_INFINITY, 0.1], times);
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
    let settings = FitSettings {
        solver: Solver::ProjectedGradient,
        ..settings()
    };
    let start = problem.functions.start();
    let found = fit(&problem, &start, &settings, &mut |_| {}).unwrap();
    assert_eq!(
        found.outcome.status,
        Status::Converged,
        "{:?}",
        found.outcome
    );
    assert_eq!(found.best.parameters, [0.1]);
    assert!(found.best.gradient.euclidean[0] < 0.0);
}
