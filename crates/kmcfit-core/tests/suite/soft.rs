//! Soft constraints: their violation and cost as the weight of the penalty increases.

use crate::common;

use kmcfit_core::constraints::{RowGroup, TOLERANCE};
use kmcfit_core::functions::{Basis, CoefficientFunction, uniform_knots};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Solver, Status, Stopping, fit};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Method;

const NODES: usize = 201;

/// The paper's mass, which falls from 1 to 0.5, by six knots, with noise; the stiffness is known.
fn problem() -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let grid = system.grid;
    let observed = common::noisy(&system, &common::paper_system(NODES), 0.05, 5);
    let basis = Basis::PiecewiseLinear {
        knots: uniform_knots(&grid, 6),
    };
    let list = vec![
        CoefficientFunction::free(CoefficientKind::MASS, basis, &grid, vec![0.9; 6]),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, NODES),
        CoefficientFunction::fixed(CoefficientKind::STIFFNESS, vec![1.0; NODES]),
    ];
    common::problem_of(system, list, observed, None)
}

/// `mass >= 0.7` at every knot, which the truth violates after 15 s.
fn heavy(soft: Option<f64>) -> RowGroup {
    let mut group = RowGroup::new("mass >= 0.7");
    for j in 0..6 {
        let time = 5.0 * j as f64;
        group.push([(j, 1.0)], [0.7, f64::INFINITY], [time, time]);
    }
    group.soft = soft;
    group
}

fn run(problem: &Problem) -> Fit {
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-13),
            ..Stopping::exactly(200)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let start = problem.functions.start();
    let found = fit(problem, &start, &settings, &mut |_| {}).unwrap();
    assert_eq!(
        found.outcome.status,
        Status::Converged,
        "{:?}",
        found.outcome
    );
    found
}

#[test]
fn a_large_penalty_weight_is_a_hard_constraint() {
    let mut hard = problem();
    hard = hard
        .with(|parts| {
            parts.constraints.groups.push(heavy(None));
        })
        .unwrap();
    let hard = run(&hard);
    let free = run(&problem());
    let prices = [1e0, 1e2, 1e4, 1e6, 1e8];
    let mut excesses = Vec::new();
    let mut costs = Vec::new();
    let mut distances = Vec::new();
    for price in prices {
        let group = heavy(Some(price));
        let mut soft = problem();
        soft = soft
            .with(|parts| {
                parts.soft.push(group.clone());
            })
            .unwrap();
        let found = run(&soft);
        let theta = &found.best.parameters;
        let (rows, largest) = group.slack(theta);
        assert!(!rows.is_empty(), "the data always push");
        // J is the sum of the misfit and the penalty, a mean over the six rows.
        let squares: f64 = (0..6).map(|j| (0.7 - theta[j]).max(0.0).powi(2)).sum();
        let whole = found.best.evaluation.misfit + price * squares / 6.0;
        assert!((found.best.evaluation.cost / whole - 1.0).abs() < 1e-12);
        let pairs = theta.iter().zip(&hard.best.parameters);
        distances.push(pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs())));
        excesses.push(largest);
        costs.push(found.best.evaluation.cost);
    }
    println!("{excesses:?}\n{costs:?}\n{distances:?}");
    // The minimum of J rises with the weight, from that without the constraint to that with it.
    let bounds = [free.best.evaluation.cost, hard.best.evaluation.cost];
    let bracketing = [&bounds[..1], &costs, &bounds[1..]].concat();
    let rounding = 1.0 + 1e-9;
    assert!(
        bracketing.windows(2).all(|w| w[0] <= w[1] * rounding),
        "{bracketing:?}"
    );
    // With a quadratic penalty the violation is the multiplier over twice the weight. It falls as 1/weight, as do the differences of
    // cost and parameters from the constrained solution, once the multiplier is that of the constrained solution.
    assert!(excesses.windows(2).all(|w| w[1] < w[0]), "{excesses:?}");
    let fall = excesses[prices.len() - 2] / excesses[prices.len() - 1];
    assert!((90.0..110.0).contains(&fall), "{excesses:?}");
    let last = distances[prices.len() - 1];
    assert!(
        last < 1e-5 && last < 2e-2 * distances[prices.len() - 2],
        "{distances:?}"
    );
    let left = |i: usize| 1.0 - costs[i] / bounds[1];
    let (before, after) = (left(prices.len() - 2), left(prices.len() - 1));
    assert!(
        (90.0..110.0).contains(&(before / after)),
        "{costs:?} {bounds:?}"
    );
    assert!(heavy(None).slack(&hard.best.parameters).1 <= TOLERANCE);
}

#[test]
fn the_gradient_of_the_penalty_is_its_derivative() {
    let mut group = RowGroup::new("bands of two functions");
    group.push([(0, 0.7), (1, -1.9)], [-0.5, 0.5], [0.0, 0.0]);
    group.push([(1, 2.5), (2, 0.3)], [1.0, f64::INFINITY], [1.0, 1.0]);
    group.push([(0, 1.1), (2, 1.3)], [f64::NEG_INFINITY, 9.0], [2.0, 2.0]);
    group.soft = Some(3.7);
    // Violated from above, violated from below, satisfied.
    let theta = [2.3, -0.4, 1.7];
    let mut gradient = vec![0.25; 3];
    group.add_price_gradient(&theta, &mut gradient);
    for (j, found) in gradient.iter().enumerate() {
        let at = |h: f64| {
            let mut theta = theta;
            theta[j] += h;
            group.price(&theta)
        };
        // A central difference of a parabola has no error but rounding: 1e-16 J/h.
        let slope = (at(1e-3) - at(-1e-3)) / 2e-3;
        assert!((found - 0.25 - slope).abs() < 1e-10, "{j}: {found} {slope}");
    }
}

/// `2 m >= 1.4` is violated by twice as much as `m >= 0.7`, so with a quarter of the weight it is the same
/// constraint at every iteration.
#[test]
fn a_soft_row_does_not_depend_on_units() {
    let found = |factor: f64| {
        let mut group = RowGroup::new("mass >= 0.7");
        for j in 0..6 {
            let lower = 0.7 * factor;
            group.push([(j, factor)], [lower, f64::INFINITY], [0.0, 0.0]);
        }
        group.soft = Some(1e2 / (factor * factor));
        let mut problem = problem();
        problem = problem
            .with(|parts| {
                parts.soft.push(group);
            })
            .unwrap();
        run(&problem)
    };
    // Powers of two, so that all is the same but for the exponents.
    let plain = found(1.0);
    for factor in [4.0, 0.25] {
        let other = found(factor);
        assert_eq!(other.best.parameters, plain.best.parameters, "{factor}");
        assert_eq!(other.history.len(), plain.history.len(), "{factor}");
    }
}
