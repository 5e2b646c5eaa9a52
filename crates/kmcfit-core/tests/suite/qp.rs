//! Convex subproblems against solutions by independent methods.

use kmcfit_core::constraints::{Cone, Constraints, RowGroup, Rows};
use kmcfit_core::qp::{ConicStatus, Subproblem, project};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use crate::common::properties::properties;

/// `|z - target|^2` without constraints.
fn nearest(target: &[f64]) -> Subproblem {
    let mut sub = Subproblem::new(target.len());
    for (j, t) in target.iter().enumerate() {
        sub.residuals.push([(j, 1.0)], *t);
    }
    sub
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn a_half_plane() {
    let mut sub = nearest(&[1.0, 2.0]);
    sub.bound([(0, 1.0), (1, 1.0)], f64::NEG_INFINITY, 2.0);
    let solution = sub.solve();
    assert_eq!(solution.status, ConicStatus::Solved);
    assert!(close(&solution.z, &[0.5, 1.5], 1e-8), "{:?}", solution.z);
    // Half the gradient, z - target = (-1/2, -1/2), is balanced by 1/2 of the row (1, 1).
    assert!(
        close(&solution.multipliers, &[0.5], 1e-7),
        "{:?}",
        solution.multipliers
    );
}

/// A program that active sets solve without Clarabel.
#[test]
fn clarabel_alone_is_the_reference() {
    let mut sub = nearest(&[1.0, 2.0]);
    sub.bound([(0, 1.0), (1, 1.0)], f64::NEG_INFINITY, 2.0);
    sub.elimination_order = vec![0; 2];
    let [few, clarabel] = [sub.solve(), sub.solve_by_clarabel(Subproblem::ITERATIONS)];
    assert_eq!((few.attempts, clarabel.attempts), (0, 1));
    assert!(close(&few.z, &clarabel.z, 1e-8), "{:?}", clarabel.z);
}

#[test]
fn bounds_from_below_have_negative_multipliers() {
    let mut sub = nearest(&[-3.0, 0.5]);
    sub.bound([(0, 1.0)], 0.0, f64::INFINITY);
    sub.bound([(1, 1.0)], 0.0, 1.0);
    let solution = sub.solve();
    assert!(close(&solution.z, &[0.0, 0.5], 1e-8));
    assert!(
        close(&solution.multipliers, &[-3.0, 0.0], 1e-6),
        "{:?}",
        solution.multipliers
    );
}

#[test]
fn equalities_and_their_multipliers() {
    let mut sub = nearest(&[1.0, 0.0]);
    sub.equalities.push([(0, 2.0), (1, 2.0)], 4.0);
    let plain = sub.solve_equality_constrained().unwrap();
    let conic = sub.solve();
    for z in [&plain, &conic.z] {
        assert!(close(z, &[1.5, 0.5], 1e-8), "{z:?}");
    }
    assert!(close(&conic.equality_multipliers, &[-0.25], 1e-7));
}

#[test]
fn a_second_order_cone() {
    // |(z0, z1)| <= 1: the nearest point to (3, 4) is (0.6, 0.8).
    let mut sub = nearest(&[3.0, 4.0]);
    let mut rows = Rows::new();
    rows.push([], -1.0);
    rows.push([(0, 1.0)], 0.0);
    rows.push([(1, 1.0)], 0.0);
    sub.cones.push(Cone { rows });
    let solution = sub.solve();
    assert_eq!(solution.status, ConicStatus::Solved);
    assert!(close(&solution.z, &[0.6, 0.8], 1e-7), "{:?}", solution.z);
}

#[test]
fn absolute_values_are_soft_thresholds() {
    // (z - a)^2 + w |z| has its minimum at sign(a) max(|a| - w/2, 0).
    for (a, w, expected) in [(3.0, 1.0, 2.5), (-3.0, 1.0, -2.5), (0.3, 1.0, 0.0)] {
        let mut sub = nearest(&[a]);
        sub.absolute.push([(0, 1.0)], 0.0);
        sub.absolute_weights.push(w);
        assert!(sub.solve_equality_constrained().is_none());
        let solution = sub.solve();
        assert!(
            close(&solution.z, &[expected], 1e-6),
            "{a} {w}: {:?}",
            solution.z
        );
        assert!(
            (sub.value(&[expected]) - ((expected - a).powi(2) + w * expected.abs())).abs() < 1e-12
        );
    }
}

/// `w (x' - x) + A' lambda = 0`, group by group and row by row.
#[test]
fn the_multipliers_of_a_projection_balance_it() {
    let mut sum = RowGroup::new("x0 + x1 = 1");
    sum.push([(0, 1.0), (1, 1.0)], [1.0, 1.0], [0.0, 0.0]);
    let mut bounds = RowGroup::new("x2 <= 0, 2 x3 >= 1, x4 <= 9");
    bounds.push([(2, 1.0)], [f64::NEG_INFINITY, 0.0], [0.0, 0.0]);
    bounds.push([(3, 2.0)], [1.0, f64::INFINITY], [0.0, 0.0]);
    bounds.push([(4, 1.0)], [f64::NEG_INFINITY, 9.0], [0.0, 0.0]);
    let constraints = Constraints {
        groups: vec![sum, bounds],
        cones: Vec::new(),
    };
    let metric = [1.0, 1.0, 2.0, 4.0, 1.0];
    let projection = project(&constraints, &[2.0, 1.0, 3.0, 0.25, 5.0], &metric);
    assert!(close(&projection.theta, &[1.0, 0.0, 0.0, 0.5, 5.0], 1e-6));
    let [sum, bounds] = projection.multipliers.as_slice() else {
        panic!("{projection:?}");
    };
    // The accuracy of the program behind it.
    assert!(close(sum, &[1.0], 1e-6), "{sum:?}");
    assert!(close(bounds, &[6.0, -0.5, 0.0], 1e-6), "{bounds:?}");
}

#[test]
fn contradictions_are_infeasible() {
    let mut sub = nearest(&[0.0]);
    sub.bound([(0, 1.0)], 1.0, f64::INFINITY);
    sub.bound([(0, 1.0)], f64::NEG_INFINITY, 0.0);
    assert_eq!(sub.solve().status, ConicStatus::Infeasible);
    let mut sub = nearest(&[0.0, 0.0]);
    sub.equalities.push([(0, 1.0), (1, 1.0)], 1.0);
    sub.equalities.push([(0, 1.0), (1, 1.0)], 2.0);
    assert_eq!(sub.solve().status, ConicStatus::Infeasible);
}

#[test]
fn numbers_that_are_not_finite_do_not_panic() {
    for bad in [f64::NAN, f64::INFINITY, 1e308] {
        let mut sub = nearest(&[bad, 1.0]);
        sub.bound([(0, bad), (1, 1.0)], 0.0, f64::INFINITY);
        let solution = sub.solve();
        assert!(solution.z.iter().all(|z| z.is_finite()));
        let _ = sub.solve_equality_constrained();
    }
}

/// The minimiser of `|z - target|^2` under `rows z <= right` by trying every active set.
fn by_enumeration(target: &[f64], rows: &[Vec<f64>], right: &[f64]) -> Option<Vec<f64>> {
    let n = target.len();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for set in 0u32..1 << rows.len() {
        let active: Vec<usize> = (0..rows.len()).filter(|i| set >> i & 1 == 1).collect();
        if active.len() > n {
            continue;
        }
        let a = DMatrix::from_fn(active.len(), n, |i, j| rows[active[i]][j]);
        let t = DVector::from_column_slice(target);
        let z = if active.is_empty() {
            t.clone()
        } else {
            let slack = DVector::from_iterator(active.len(), active.iter().map(|&i| right[i]));
            let gram = &a * a.transpose();
            let Some(inverse) = gram.try_inverse() else {
                continue;
            };
            let lambda = inverse * (&a * &t - slack);
            if lambda.iter().any(|l| *l < -1e-12) {
                continue;
            }
            &t - a.transpose() * lambda
        };
        let inside = rows.iter().zip(right).all(|(row, r)| {
            row.iter().zip(z.iter()).map(|(a, z)| a * z).sum::<f64>() <= r + 1e-9 * (1.0 + r.abs())
        });
        let distance = (&z - &t).norm_squared();
        if inside && best.as_ref().is_none_or(|b| distance < b.0) {
            best = Some((distance, z.iter().copied().collect()));
        }
    }
    best.map(|b| b.1)
}

proptest! {
    #![proptest_config(properties(300, 1))]

    #[test]
    fn random_programs_agree_with_enumeration_whatever_the_scale_of_their_rows(
        target in prop::collection::vec(-3.0..3.0f64, 3),
        rows in prop::collection::vec(prop::collection::vec(-1.0..1.0f64, 3), 1..6),
        // A point inside, so that the set is not empty.
        inside in prop::collection::vec(-1.0..1.0f64, 3),
        room in prop::collection::vec(0.05..1.0f64, 6),
        exponents in prop::collection::vec(-6..=6i32, 6),
    ) {
        prop_assume!(rows.iter().all(|r| r.iter().map(|a| a * a).sum::<f64>() > 0.05));
        let right: Vec<f64> = rows.iter().zip(&room)
            .map(|(row, room)| row.iter().zip(&inside).map(|(a, z)| a * z).sum::<f64>() + room)
            .collect();
        let expected = by_enumeration(&target, &rows, &right).unwrap();
        let mut group = RowGroup::new("random");
        for ((row, right), exponent) in rows.iter().zip(&right).zip(&exponents) {
            let scale = 10f64.powi(*exponent);
            let entries = row.iter().enumerate().map(|(j, a)| (j, a * scale));
            group.push(entries, [f64::NEG_INFINITY, right * scale], [0.0, 0.0]);
        }
        let constraints = Constraints { groups: vec![group], cones: Vec::new() };
        let projection = project(&constraints, &target, &[1.0; 3]);
        prop_assert_eq!(projection.status, ConicStatus::Solved);
        // The distance is accurate to the duality gap of 1e-8, the point to its square root if a row is weakly
        // active.
        let distance = |z: &[f64]| z.iter().zip(&target).map(|(z, t)| (z - t).powi(2)).sum::<f64>();
        let (found, least) = (distance(&projection.theta), distance(&expected));
        prop_assert!((found - least).abs() <= 1e-8 * (1.0 + least), "{found} {least}");
        prop_assert!(close(&projection.theta, &expected, 1e-4), "{:?} {:?}", projection.theta, expected);
    }

    #[test]
    fn plain_and_conic_solutions_agree(
        a in prop::collection::vec(-1.0..1.0f64, 15),
        b in prop::collection::vec(-1.0..1.0f64, 5),
        exponent in -6..=6i32,
    ) {
        let mut sub = Subproblem::new(3);
        let scale = 10f64.powi(exponent);
        for i in 0..5 {
            sub.residuals.push((0..3).map(|j| (j, scale * a[3 * i + j])), scale * b[i]);
        }
        sub.proximal = vec![1e-3 * scale * scale; 3];
        let (plain, conic) = (sub.solve_equality_constrained().unwrap(), sub.solve());
        prop_assert!(close(&plain, &conic.z, 1e-5), "{plain:?} {:?}", conic.z);
    }
}
