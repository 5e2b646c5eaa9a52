//! The combined computation of cost and gradient equals an evaluation followed by its adjoint, for each algorithm.

use crate::common::paper_problem;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Weighting};
use kmcfit_core::step::Cause;

/// Rounding of the same sums in another order, relative to the largest entry.
const ROUNDING: f64 = 1e-11;

fn agree(problem: &Problem, theta: &[f64]) {
    let mut gradient = vec![f64::NAN; theta.len()];
    let cost = problem.cost_and_gradient(theta, &mut gradient).unwrap();
    let evaluation = problem.evaluate(theta).unwrap();
    let expected = problem.gradient(theta, &evaluation, GradientKind::Discrete);
    assert!((cost - evaluation.cost).abs() <= ROUNDING * evaluation.cost);
    let scale = expected
        .euclidean
        .iter()
        .fold(0.0, |most: f64, g| most.max(g.abs()));
    assert!(scale > 0.0);
    for (i, (g, e)) in gradient.iter().zip(&expected.euclidean).enumerate() {
        assert!((g - e).abs() <= ROUNDING * scale, "{i}: {g} {e}");
    }
}

/// A non-constant start.
fn uneven(problem: &Problem) -> Vec<f64> {
    let start = problem.start();
    let wave = |(i, p): (usize, &f64)| p * (1.0 + 0.1 * (0.37 * i as f64).sin());
    start.iter().enumerate().map(wave).collect()
}

#[test]
fn cost_and_gradient_agree_with_one_value_per_node() {
    // The last is long enough for several tiles and, where there are two cores, two threads.
    for nodes in [65, 100, 2000, 4097, 120_000] {
        let problem = paper_problem(nodes, [2.0, 1.0, 1.0]);
        agree(&problem, &uneven(&problem));
    }
}

#[test]
fn cost_and_gradient_agree_with_sigma_and_penalties() {
    let mut problem = paper_problem(300, [2.0, 1.0, 1.0]);
    let samples = problem.experiments[0].channels[0].observed().to_vec();
    let grid = problem.system.grid;
    let sigma = Weighting::Sigma(0.1);
    let channel = Channel::displacement_at_nodes(samples.clone(), 1, sigma, &grid);
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels = vec![channel];
        })
        .unwrap();
    agree(&problem, &uneven(&problem));

    let parts = [2.0, 1.0, 1.0].map(|start| CoefficientSpec::nodal(start).tikhonov(1, 0.3));
    let record = Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(&grid.times(), &samples);
    let method = problem.system.method;
    let smooth = Builder::new(parts)
        .record(record)
        .method(method)
        .build()
        .unwrap();
    agree(&smooth, &uneven(&smooth));
}

/// Samples at every second node, or other bases: cases without the fast algorithm.
#[test]
fn cost_and_gradient_agree_without_the_fast_algorithm() {
    let mut problem = paper_problem(301, [2.0, 1.0, 1.0]);
    let grid = problem.system.grid;
    let samples: Vec<f64> = problem.experiments[0].channels[0].observed().to_vec();
    let half: Vec<f64> = samples.iter().copied().step_by(2).collect();
    let spacing = 2.0 * grid.step();
    let channel = Channel::displacement_at_nodes(half, 2, Weighting::Integral { spacing }, &grid);
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels = vec![channel];
        })
        .unwrap();
    agree(&problem, &uneven(&problem));

    let parts = [
        CoefficientSpec::piecewise_linear(5, 2.0),
        CoefficientSpec::constant(1.0),
        CoefficientSpec::b_spline(4, 1.0),
    ];
    let record = Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(&grid.times(), &samples);
    let knots = Builder::new(parts).record(record).build().unwrap();
    agree(&knots, &uneven(&knots));
}

#[test]
fn a_mass_that_is_not_positive_is_a_breakdown() {
    let problem = paper_problem(200, [2.0, 1.0, 1.0]);
    let mut theta = problem.start();
    theta[77] = -0.5;
    let broken = problem.cost_and_gradient(&theta, &mut vec![0.0; theta.len()]);
    let broken = broken.unwrap_err();
    assert_eq!(
        (broken.cause, broken.node, broken.value),
        (Cause::Mass, 77, -0.5)
    );
}
