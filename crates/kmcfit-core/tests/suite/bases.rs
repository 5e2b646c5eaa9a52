//! Every basis against independent evaluations of its functions.

use kmcfit_core::constraints::Rows;
use kmcfit_core::functions::{Basis, from_physical_powers, physical_powers, uniform_knots};
use kmcfit_core::system::{Grid, trapezoid_weights};
use proptest::prelude::*;

/// A record that does not begin at zero, with knots that are not multiples of the step.
fn grid(nodes: usize) -> Grid {
    Grid::new(-1.5, 4.0, nodes).unwrap()
}

/// Unequal knots off the nodes; two of them are nodes of no grid in this file.
fn knots() -> Vec<f64> {
    vec![-1.5, -1.171, -0.3, 0.24, 1.0, 1.9, 2.5]
}

/// Every basis with the degree of the polynomials it contains and the number of times that its functions can be
/// differentiated with a square-integrable result.
fn table() -> Vec<(Basis, usize, usize)> {
    vec![
        (Basis::Nodal, 1, 1),
        (Basis::Constant, 0, 2),
        (Basis::PiecewiseConstant { knots: knots() }, 0, 0),
        (Basis::PiecewiseLinear { knots: knots() }, 1, 1),
        (Basis::Polynomial { degree: 0 }, 0, 2),
        (Basis::Polynomial { degree: 1 }, 1, 2),
        (Basis::Polynomial { degree: 7 }, 7, 2),
        (Basis::BSpline { knots: knots() }, 3, 2),
        (
            Basis::BSpline {
                knots: vec![-1.5, 2.5],
            },
            3,
            2,
        ),
    ]
}

/// Times other than knots and nodes, the ends, and every knot and node.
fn times(grid: &Grid) -> Vec<f64> {
    let mut times: Vec<f64> = (0..97)
        .map(|i| -1.5 + 4.0 * (f64::from(i) + 0.37) / 97.3)
        .collect();
    times.extend(knots());
    times.extend(grid.times());
    times
}

fn apply(matrix: &Rows, theta: &[f64]) -> Vec<f64> {
    assert_eq!(matrix.width(), theta.len());
    matrix.multiply(theta)
}

/// `|L theta|^2`.
fn squared(matrix: &Rows, theta: &[f64]) -> f64 {
    apply(matrix, theta).iter().map(|x| x * x).sum()
}

/// Irregular parameters.
fn some_parameters(count: usize) -> Vec<f64> {
    (0..count)
        .map(|j| 1.0 + (2.3 * j as f64 + 0.4).sin())
        .collect()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        let error = (f - e).abs() / e.abs().max(1.0);
        assert!(error <= tolerance, "{what}, {i}: {f} instead of {e}");
    }
}

fn power(t: f64, n: usize) -> f64 {
    t.powi(n as i32)
}

/// Derivatives of `t^n`.
fn power_derivative(t: f64, n: usize, q: usize) -> f64 {
    match q {
        0 => power(t, n),
        _ if n == 0 => 0.0,
        _ => n as f64 * power_derivative(t, n - 1, q - 1),
    }
}

#[test]
fn sizes_and_signs() {
    let grid = grid(41);
    for (basis, _, _) in table() {
        let name = basis.name();
        let expected = match name {
            "nodal" => 41,
            "constant" => 1,
            "piecewise-constant" => 6,
            "piecewise-linear" => 7,
            "polynomial" => basis.parameters(&grid),
            _ => basis.knot_times(&grid).len() + 2,
        };
        assert_eq!(basis.parameters(&grid), expected, "{name}");
        let ends = basis.knot_times(&grid);
        assert_eq!((ends[0], ends[ends.len() - 1]), (-1.5, 2.5), "{name}");
        let values = basis.rows(&grid, &times(&grid), 0);
        let sign = (0..values.len()).all(|i| values.row(i).all(|(_, v)| v >= 0.0));
        assert_eq!(sign, basis.positive_parameters(), "{basis:?}");
    }
}

#[test]
fn constants_are_reproduced_to_rounding() {
    let grid = grid(41);
    for (basis, _, _) in table() {
        let theta = basis.constant(&grid, 3.7);
        let values = apply(&basis.rows(&grid, &times(&grid), 0), &theta);
        assert_close(&values, &vec![3.7; values.len()], 2e-15, basis.name());
        let projected = basis.project(&grid, &[3.7; 41]).unwrap();
        assert_close(&projected, &theta, 4e-15, basis.name());
        for order in 1..=2 {
            let rough = squared(&basis.roughness(&grid, order), &theta);
            assert!(rough < 1e-20, "{basis:?}, {order}: {rough}");
        }
    }
}

#[test]
fn polynomials_of_the_space_are_reproduced_with_their_derivatives() {
    let grid = grid(41);
    let times = times(&grid);
    for (basis, degree, _) in table() {
        for n in 0..=degree {
            let nodal: Vec<f64> = grid.times().iter().map(|&t| power(t, n)).collect();
            let theta = basis.project(&grid, &nodal).unwrap();
            for q in 0..=2.min(degree) {
                let found = apply(&basis.rows(&grid, &times, q), &theta);
                let expected: Vec<f64> = times.iter().map(|&t| power_derivative(t, n, q)).collect();
                assert_close(&found, &expected, 1e-11, &format!("{basis:?}, t^{n}, {q}"));
            }
        }
    }
}

#[test]
fn the_design_is_the_rows_at_the_nodes() {
    for nodes in [9, 41, 2000] {
        let grid = grid(nodes);
        for (basis, _, _) in table() {
            let theta = some_parameters(basis.parameters(&grid));
            let design = basis.design(&grid).multiply(&theta, nodes);
            let rows = apply(&basis.rows(&grid, &grid.times(), 0), &theta);
            match basis {
                Basis::PiecewiseConstant { .. } => {
                    let means = means(&basis, &grid, &theta);
                    // The error of 1000 midpoints of a function with values up to 1 and at most three jumps in a window.
                    assert_close(
                        &design,
                        &means,
                        3e-3,
                        &format!("{basis:?} on {nodes} nodes"),
                    );
                }
                _ => assert_eq!(design, rows, "{basis:?} on {nodes} nodes"),
            }
        }
    }
}

/// Means over the half steps beside each node, by midpoints.
fn means(basis: &Basis, grid: &Grid, theta: &[f64]) -> Vec<f64> {
    let end = grid.time(grid.nodes() - 1);
    let mean = |t: f64| {
        let from = (t - 0.5 * grid.step()).max(grid.start());
        let to = (t + 0.5 * grid.step()).min(end);
        let times: Vec<f64> = (0..1000)
            .map(|i| from + (to - from) * (f64::from(i) + 0.5) / 1000.0)
            .collect();
        apply(&basis.rows(grid, &times, 0), theta)
            .iter()
            .sum::<f64>()
            / 1000.0
    };
    grid.times().into_iter().map(mean).collect()
}

#[test]
fn derivatives_agree_with_differences() {
    let grid = grid(23);
    // Times at least a difference away from every knot and node.
    let h = 1e-5;
    let clear = |t: &f64| {
        let away = |k: &f64| (t - k).abs() > 2.0 * h;
        knots().iter().all(away) && grid.times().iter().all(away)
    };
    let times: Vec<f64> = times(&grid).into_iter().filter(clear).collect();
    assert!(times.len() > 80);
    let moved = |by: f64| -> Vec<f64> { times.iter().map(|t| t + by).collect() };
    for (basis, _, _) in table() {
        let theta = some_parameters(basis.parameters(&grid));
        for q in 1..=2 {
            let at = |by: f64| apply(&basis.rows(&grid, &moved(by), q - 1), &theta);
            let (after, before) = (at(h), at(-h));
            let differences: Vec<f64> = after
                .iter()
                .zip(&before)
                .map(|(a, b)| (a - b) / (2.0 * h))
                .collect();
            let derivative = apply(&basis.rows(&grid, &times, q), &theta);
            assert_close(&derivative, &differences, 3e-7, &format!("{basis:?}, {q}"));
        }
    }
}

#[test]
fn at_a_jump_the_side_after_counts_and_at_the_end_the_side_before() {
    let grid = Grid::new(0.0, 3.0, 31).unwrap();
    let knots = vec![0.0, 1.0, 2.0, 3.0];
    let at = [0.0, 0.5, 1.0, 2.0, 3.0];
    let steps = Basis::PiecewiseConstant {
        knots: knots.clone(),
    };
    let values = apply(&steps.rows(&grid, &at, 0), &[5.0, 6.0, 7.0]);
    assert_eq!(values, [5.0, 5.0, 6.0, 7.0, 7.0]);
    let hats = Basis::PiecewiseLinear { knots };
    let slopes = apply(&hats.rows(&grid, &at, 1), &[0.0, 1.0, 3.0, 0.0]);
    assert_eq!(slopes, [1.0, 1.0, 2.0, -3.0, -3.0]);
    // Node 10 differs from the knot 0.3 by a rounding error: at a node the value is the mean over the half steps beside it.
    let grid = Grid::new(0.0, 0.9, 31).unwrap();
    assert!(grid.time(10) != 0.3);
    let steps = Basis::PiecewiseConstant {
        knots: vec![0.0, 0.3, 0.9],
    };
    let values = steps.design(&grid).multiply(&[1.0, 2.0], 31);
    assert_eq!((values[9], values[11]), (1.0, 2.0));
    assert!((values[10] - 1.5).abs() < 1e-12);
    // A knot between nodes, at 0.005 s of a half step of 0.015 s after node 10: (1 * 0.02 + 2 * 0.01) / 0.03.
    let steps = Basis::PiecewiseConstant {
        knots: vec![0.0, 0.305, 0.9],
    };
    let values = steps.design(&grid).multiply(&[1.0, 2.0], 31);
    assert_eq!((values[9], values[11]), (1.0, 2.0));
    assert!((values[10] - 4.0 / 3.0).abs() < 1e-12);
}

/// The integral of the squared derivative by Simpson's rule on each cell, derivatives taken inside
/// it: an independent rule, exact for these functions up to its error.
fn integral(basis: &Basis, grid: &Grid, theta: &[f64], q: usize) -> f64 {
    let parts = 2000;
    let knots = basis.knot_times(grid);
    let mut sum = 0.0;
    for cell in knots.windows(2) {
        let width = cell[1] - cell[0];
        // Slightly inside, so that both ends belong to this cell.
        let inset = 1e-10 * width.max(0.5);
        let times: Vec<f64> = (0..=2 * parts)
            .map(|i| cell[0] + width * f64::from(i) / f64::from(2 * parts))
            .map(|t| t.clamp(cell[0] + inset, cell[1] - inset))
            .collect();
        let values = apply(&basis.rows(grid, &times, q), theta);
        for w in values.windows(3).step_by(2) {
            let simpson = w[0] * w[0] + 4.0 * w[1] * w[1] + w[2] * w[2];
            sum += width / f64::from(6 * parts) * simpson;
        }
    }
    sum
}

#[test]
fn roughness_is_the_integral_of_the_squared_derivative() {
    let grid = grid(9);
    for (basis, degree, differentiable) in table() {
        let theta = some_parameters(basis.parameters(&grid));
        for q in 0..=differentiable {
            let rough = basis.roughness(&grid, q);
            let cells = basis.knot_times(&grid).len() - 1;
            assert_eq!(rough.len(), cells * (degree + 1).saturating_sub(q));
            let found = squared(&rough, &theta);
            let expected = integral(&basis, &grid, &theta, q);
            let error = (found - expected).abs() / expected.max(1e-300);
            assert!(
                error < 1e-8 || found + expected < 1e-25,
                "{basis:?}, {q}: {found} instead of {expected}"
            );
        }
    }
}

#[test]
fn roughness_of_a_parabola_in_closed_form() {
    // p = t^2 on [-1.5, 2.5]: the integrals of t^4, (2 t)^2 and 2^2.
    let grid = grid(41);
    let cubes = |n: i32| (2.5_f64.powi(n) + 1.5_f64.powi(n)) / f64::from(n);
    let expected = [cubes(5), 4.0 * cubes(3), 16.0];
    let nodal: Vec<f64> = grid.times().iter().map(|t| t * t).collect();
    for (basis, _, _) in table().into_iter().filter(|(_, degree, _)| *degree >= 2) {
        let theta = basis.project(&grid, &nodal).unwrap();
        for (q, expected) in expected.iter().enumerate() {
            let found = squared(&basis.roughness(&grid, q), &theta);
            assert!((found / expected - 1.0).abs() < 1e-11, "{basis:?}, {q}");
        }
    }
    // Divided differences of a parabola are exact, for any spacing; they omit the halves of the two
    // end cells.
    let hats = Basis::PiecewiseLinear { knots: knots() };
    let theta: Vec<f64> = knots().iter().map(|t| t * t).collect();
    let inner = 4.0 - 0.5 * (0.329 + 0.6);
    let found = squared(&hats.roughness(&grid, 2), &theta);
    assert!((found - 4.0 * inner).abs() < 1e-12, "{found}");
    // Equal spacing: h ((p_{j-1} - 2 p_j + p_{j+1}) / h^2)^2.
    let theta = some_parameters(41);
    let h = grid.step();
    let expected: f64 = theta
        .windows(3)
        .map(|w| h * ((w[0] - 2.0 * w[1] + w[2]) / (h * h)).powi(2))
        .sum();
    let found = squared(&Basis::Nodal.roughness(&grid, 2), &theta);
    assert!((found / expected - 1.0).abs() < 1e-12);
    let steps = Basis::PiecewiseConstant {
        knots: uniform_knots(&grid, 42),
    };
    let h = 4.0 / 41.0;
    let expected: f64 = theta.windows(2).map(|w| (w[1] - w[0]).powi(2) / h).sum();
    let found = squared(&steps.roughness(&grid, 1), &theta);
    assert!((found / expected - 1.0).abs() < 1e-12);
}

#[test]
fn second_differences_keep_their_digits_on_fine_grids() {
    let grid = Grid::new(0.0, 25.0, 40_000).unwrap();
    let line: Vec<f64> = grid.times().iter().map(|t| 1.0 - 0.02 * t).collect();
    let rough = Basis::Nodal.roughness(&grid, 2);
    // The remaining error is the rounding error of the values, 1e-16 / dt^1.5 per row.
    assert!(squared(&rough, &line) < 1e-14 * 40_000.0);
}

/// The B-spline of degree `p` that begins at `u[i]`, by the textbook recursion with 0/0 = 0.
fn cox_de_boor(u: &[f64], i: usize, p: usize, t: f64) -> f64 {
    if p == 0 {
        return f64::from(u[i] <= t && t < u[i + 1]);
    }
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    ratio(t - u[i], u[i + p] - u[i]) * cox_de_boor(u, i, p - 1, t)
        + ratio(u[i + p + 1] - t, u[i + p + 1] - u[i + 1]) * cox_de_boor(u, i + 1, p - 1, t)
}

#[test]
fn splines_agree_with_the_textbook_recursion() {
    let grid = grid(41);
    let mut u = vec![-1.5; 3];
    u.extend(knots());
    u.extend([2.5; 3]);
    let spline = Basis::BSpline { knots: knots() };
    let times: Vec<f64> = times(&grid).into_iter().filter(|t| *t < 2.5).collect();
    let rows = spline.rows(&grid, &times, 0).dense();
    for (k, &t) in times.iter().enumerate() {
        for j in 0..spline.parameters(&grid) {
            assert!((rows[(k, j)] - cox_de_boor(&u, j, 3, t)).abs() < 1e-14);
        }
    }
    // Equal knots, far from the ends: 1/6, 4/6, 1/6; slopes -1/2, 0, 1/2; curvatures 1, -2, 1.
    let grid = Grid::new(0.0, 10.0, 101).unwrap();
    let spline = Basis::BSpline {
        knots: uniform_knots(&grid, 11),
    };
    for (q, expected) in [
        [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
        [-0.5, 0.0, 0.5],
        [1.0, -2.0, 1.0],
    ]
    .into_iter()
    .enumerate()
    {
        let row = spline.rows(&grid, &[5.0], q).dense();
        let found: Vec<f64> = (5..8).map(|j| row[(0, j)]).collect();
        assert_close(&found, &expected, 1e-14, "cardinal spline");
        assert!(row.iter().map(|x| x.abs()).sum::<f64>() < 4.0 + 1e-12);
    }
}

#[test]
fn physical_powers_there_and_back() {
    let grid = grid(41);
    let powers = [1.0, -0.02, 0.3, 0.0, -2.5, 0.7];
    let theta = from_physical_powers(&grid, &powers);
    assert_close(&physical_powers(&grid, &theta), &powers, 1e-13, "powers");
    let basis = Basis::Polynomial { degree: 5 };
    let values = apply(&basis.rows(&grid, &times(&grid), 0), &theta);
    let expected: Vec<f64> = times(&grid)
        .iter()
        .map(|&t| powers.iter().rev().fold(0.0, |sum, a| sum * t + a))
        .collect();
    assert_close(&values, &expected, 1e-13, "values");
    // The linear mass decay, 1 - 0.02 t on [0, 25].
    let grid = Grid::new(0.0, 25.0, 2000).unwrap();
    assert_close(
        &from_physical_powers(&grid, &[1.0, -0.02]),
        &[0.75, -0.25],
        1e-16,
        "linear mass",
    );
    assert_eq!(physical_powers(&grid, &[]), Vec::<f64>::new());
    assert_eq!(from_physical_powers(&grid, &[]), Vec::<f64>::new());
}

#[test]
fn the_projection_is_orthogonal() {
    let grid = grid(200);
    let nodal: Vec<f64> = grid.times().iter().map(|t| (3.0 * t).sin().exp()).collect();
    let weights = trapezoid_weights(200, grid.step());
    for (basis, _, _) in table() {
        let theta = basis.project(&grid, &nodal).unwrap();
        let design = basis.design(&grid);
        let values = design.multiply(&theta, 200);
        let misses: Vec<f64> = (0..200)
            .map(|i| weights[i] * (nodal[i] - values[i]))
            .collect();
        let mut dual = vec![0.0; theta.len()];
        design.transpose_multiply_add(&misses, &mut dual);
        assert_close(&dual, &vec![0.0; theta.len()], 1e-13, basis.name());
    }
}

proptest! {
    #![proptest_config(properties(200, 1))]
}
