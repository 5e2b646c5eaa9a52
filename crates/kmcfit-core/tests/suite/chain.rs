//! Subproblems with an elimination order along a chain: elimination against a factorisation without order, and the work of a fit
//! with tens of thousands of parameters.

use crate::common::properties::properties;
use crate::common::{add_physics, errors, paper_problem, paper_system};
use kmcfit_core::constraints::Rows;
use kmcfit_core::objective::GradientKind;
use kmcfit_core::qp::Subproblem;
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Status, Stopping, fit};
use proptest::prelude::*;

/// Rows that couple neighbours, a few equalities, and a variable in all rows.
fn chain(length: usize, width: usize, a: &[f64], exponents: &[i32]) -> Subproblem {
    let mut sub = Subproblem::new(length + 1);
    let mut numbers = a.iter().cycle().copied();
    let mut next = || numbers.next().unwrap();
    for i in 0..2 * length {
        let first = i / 2;
        let scale = 10f64.powi(exponents[i % exponents.len()]);
        let near = first..(first + width).min(length);
        let own: Vec<(usize, f64)> = near.chain([length]).map(|j| (j, scale * next())).collect();
        sub.residuals.push(own, scale * next());
    }
    for first in (0..length - 1).step_by(3) {
        let row = [(first, 1.0 + next()), (first + 1, 2.0 + next())];
        sub.equalities.push(row, next());
    }
    sub.proximal.fill(1e-3);
    sub
}

proptest! {
    #![proptest_config(properties(200, 2))]

    #[test]
    fn the_order_of_elimination_does_not_matter(
        length in 4usize..30,
        width in 1usize..5,
        a in prop::collection::vec(-1.0..1.0f64, 97),
        exponents in prop::collection::vec(-1..=1i32, 5),
    ) {
        let plain = chain(length, width, &a, &exponents);
        let expected = plain.solve_equality_constrained().unwrap();
        let rising: Vec<u32> = (0..length as u32).collect();
        let falling: Vec<u32> = rising.iter().rev().copied().collect();
        let pairs: Vec<u32> = rising.iter().map(|i| i / 2).collect();
        for mut elimination_order in [rising, falling, pairs] {
            elimination_order.push(0);
            let mut sub = plain.clone();
            sub.elimination_order = elimination_order;
            let found = sub.solve_equality_constrained().unwrap();
            for (found, expected) in found.iter().zip(&expected) {
                prop_assert!((found - expected).abs() <= 1e-6 * (1.0 + expected.abs()), "{found} {expected}");
            }
        }
    }
}

proptest! {
    #![proptest_config(properties(200, 3))]

    /// Variables with one place in the order, some of them fixed, and rows a million times as large as others: more than one block
    /// of rows, and fewer.
    #[test]
    fn elimination_of_all_variables_together_gives_the_same_minimum(
        length in 4usize..60,
        width in 1usize..5,
        given in 0usize..3,
        a in prop::collection::vec(-1.0..1.0f64, 97),
        exponents in prop::collection::vec(-3..=3i32, 5),
    ) {
        let mut plain = chain(length, width, &a, &exponents);
        plain.equalities = Rows::new();
        for (j, right) in a.iter().enumerate().take(given) {
            plain.equalities.push([(j, 2.0)], *right);
        }
        plain.elimination_order = (0..length as u32).chain([0]).collect();
        let mut sub = plain.clone();
        sub.elimination_order = vec![0; length + 1];
        let (expected, found) = (plain.solve_equality_constrained().unwrap(), sub.solve_equality_constrained().unwrap());
        for (z, right) in found.iter().zip(&a).take(given) {
            prop_assert_eq!(*z, right / 2.0);
        }
        // At a minimum the cost depends on the point to second order only: the rest is its rounding error.
        let (found, expected) = (plain.value(&found), plain.value(&expected));
        prop_assert!((found - expected).abs() <= 1e-12 * (1.0 + expected), "{found} {expected}");
    }
}

/// Linearly dependent columns are eliminated by another method, which finds one of the many minima.
#[test]
fn undetermined_variables_do_not_prevent_a_minimum() {
    let mut two = Subproblem::new(2);
    let mut three = Subproblem::new(3);
    for i in 0..5 {
        let x = f64::from(i) - 1.7;
        two.residuals.push([(0, 1.0), (1, x)], x.sin());
        // The third column is the sum of the others.
        (three.residuals).push([(0, 1.0), (1, x), (2, 1.0 + x)], x.sin());
    }
    two.elimination_order = vec![0; 2];
    three.elimination_order = vec![0; 3];
    let least = two.value(&two.solve_equality_constrained().expect("one minimum"));
    let found = three.value(&three.solve_equality_constrained().expect("a minimum"));
    assert!((found - least).abs() <= 1e-12 * least, "{found} {least}");
    three.residuals.push([(2, 1.0)], 0.5);
    let z = three.solve_equality_constrained().expect("one minimum");
    assert!((z[2] - 0.5).abs() <= 1e-14, "{z:?}");
}

#[test]
fn several_right_hand_sides_are_solved_as_each_by_itself() {
    let numbers = [0.3, -0.7, 0.9, 0.2, -0.4, 0.8, 0.1];
    let mut sub = chain(12, 3, &numbers, &[0]);
    sub.elimination_order = (0..13).collect();
    let targets: Vec<Vec<f64>> = (0..3)
        .map(|k| {
            (0..sub.residuals.len())
                .map(|i| (k as f64 - 1.3 * i as f64).sin())
                .collect()
        })
        .collect();
    let together = sub.solve_equality_constrained_for(&targets).unwrap();
    for (target, found) in targets.into_iter().zip(together) {
        let alone = sub.solve_equality_constrained_for(&[target]).unwrap();
        // The same operations for each right-hand side: identical bits.
        assert_eq!(alone, [found]);
    }
}

#[test]
fn unsolvable_problems_have_no_solution() {
    let numbers = [0.3, -0.7, 0.9, 0.2, -0.4, 0.8, 0.1];
    let mut sub = chain(12, 3, &numbers, &[0]);
    sub.elimination_order = (0..13).collect();
    assert!(sub.solve_equality_constrained().is_some());
    // NaN in a residual or an equality is not ignored.
    for bad in [f64::NAN, f64::INFINITY] {
        let mut broken = sub.clone();
        broken.residuals.push([(3, bad)], 1.0);
        assert!(broken.solve_equality_constrained().is_none());
        let mut broken = sub.clone();
        broken.equalities.push([(3, bad)], 1.0);
        assert!(broken.solve_equality_constrained().is_none());
    }
    // Contradictory equalities.
    sub.equalities.push([(5, 1.0)], 1.0);
    sub.equalities.push([(5, 1.0)], 2.0);
    assert!(sub.solve_equality_constrained().is_none());
}

#[test]
fn bounds_violated_by_the_plain_minimum_become_active() {
    let mut sub = Subproblem::new(3);
    sub.elimination_order = vec![0, 1, 2];
    for (j, target) in [-1.0, 0.5, 3.0].into_iter().enumerate() {
        sub.residuals.push([(j, 1.0)], target);
        sub.bound([(j, 1.0)], 0.0, 2.0);
    }
    let plain = sub.solve_equality_constrained().unwrap();
    let held = sub.solve_active_set(plain, 1e-10).unwrap();
    for (found, expected) in held.iter().zip([0.0, 0.5, 2.0]) {
        assert!((found - expected).abs() < 1e-14, "{held:?}");
    }
}

#[test]
fn tens_of_thousands_of_values_take_no_more_work_than_thousands() {
    for nodes in [2_000, 20_000, 60_000] {
        let mut problem = paper_problem(nodes, [2.0, 1.0, 1.0]);
        add_physics(&mut problem, 1.0, true);
        let settings = FitSettings {
            solver: Solver::GaussNewton,
            initial: Initial::Data,
            gradient: GradientKind::Discrete,
            stopping: Stopping::default(),
            qp: kmcfit_core::solvers::QpSolver::Auto,
            interrupt: None,
        };
        let found = fit(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
        assert_eq!(found.outcome.status, Status::Converged, "{nodes}");
        // The bound on the damping is reached everywhere with zero multipliers: no program is needed.
        assert_eq!(found.counts.qp, 0, "{nodes}");
        assert!(found.history.len() <= 3, "{nodes}: {}", found.history.len());
        let errors = errors(&found.best.evaluation.nodal, &paper_system(nodes));
        assert!(errors.iter().all(|e| *e < 1e-11), "{nodes}: {errors:?}");
    }
}
