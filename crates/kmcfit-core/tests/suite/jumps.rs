//! A stiffness with a jump: a total-variation penalty recovers it, a Tikhonov penalty does not.

use crate::common;

use kmcfit_core::constraints::Rows;
use kmcfit_core::functions::{Basis, CoefficientFunction, Penalty, TotalVariation, uniform_knots};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Stopping, fit};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};

const SIGMA: f64 = 0.02;
const JUMP: f64 = 12.0;
const KNOTS: usize = 51;

fn problem() -> (Problem, Vec<f64>) {
    let system = common::system(2000, Method::Rk4);
    let grid = system.grid;
    let nodes = grid.nodes();
    let level = |t: f64| if t < JUMP { 2.0 } else { 1.6 };
    let stiffness: Vec<f64> = grid.times().iter().map(|t| level(*t)).collect();
    let truth = NodalCoefficients {
        inertias: vec![vec![1.0; nodes]],
        coefficients: vec![vec![0.05; nodes], stiffness],
    };
    let observed = common::noisy(&system, &truth, SIGMA, 1);
    let knots = uniform_knots(&grid, KNOTS);
    let cells = knots
        .windows(2)
        .map(|w| level(0.5 * (w[0] + w[1])))
        .collect();
    let basis = Basis::PiecewiseConstant { knots };
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, nodes),
        CoefficientFunction::free(
            CoefficientKind::STIFFNESS,
            basis.clone(),
            &grid,
            vec![1.8; KNOTS - 1],
        ),
    ];
    (
        common::problem_of(system, list, observed, Some(SIGMA)),
        cells,
    )
}

fn differences() -> Rows {
    let mut rows = Rows::new();
    for i in 0..KNOTS - 2 {
        rows.push([(i, -1.0), (i + 1, 1.0)], 0.0);
    }
    rows
}

fn stiffness(problem: &Problem) -> Vec<f64> {
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-8),
            ..Stopping::exactly(60)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let found = fit(problem, &problem.functions.start(), &settings, &mut |_| {}).unwrap();
    println!(
        "{:?} {:?} its {}",
        found.outcome,
        found.counts,
        found.history.len()
    );
    found.best.parameters[problem.functions.ranges()[2].clone()].to_vec()
}

/// Cells between which the stiffness changes by more than a quarter of the true jump.
fn jumps(k: &[f64]) -> Vec<usize> {
    let changes = k.windows(2).map(|w| (w[1] - w[0]).abs());
    changes
        .enumerate()
        .filter(|(_, c)| *c > 0.1)
        .map(|(i, _)| i + 1)
        .collect()
}

#[test]
fn total_variation_finds_the_jump_and_both_levels() {
    let (mut problem, cells) = problem();
    let rows = differences();
    problem = problem
        .with(|parts| {
            parts.variations = vec![TotalVariation {
                function: 2,
                weight: 300.0,
                rows,
            }];
        })
        .unwrap();
    let k = stiffness(&problem);
    let jump = cells.windows(2).position(|w| w[0] != w[1]).unwrap() + 1;
    assert_eq!(jumps(&k), [jump]);
    // The jump is located to one knot: the adjacent cell may have a part of it.
    let beside = |i: usize| i.abs_diff(jump) <= 1;
    for (i, (k, truth)) in k
        .iter()
        .zip(&cells)
        .enumerate()
        .filter(|(i, _)| !beside(*i))
    {
        assert!(
            (k / truth - 1.0).abs() < 0.01,
            "cell {i}: {k} is not {truth}"
        );
    }
}

#[test]
fn tikhonov_penalties_smooth_the_jump() {
    let (mut problem, cells) = problem();
    let Some(basis) = problem
        .functions
        .iter()
        .nth(2)
        .and_then(|f| f.basis.clone())
    else {
        panic!("the stiffness has a basis");
    };
    let rows = basis.roughness(&problem.system.grid, 1);
    for weight in [1e2, 1e3, 1e4] {
        problem = problem
            .with(|parts| {
                parts.penalties = vec![Penalty::new(2, 1, weight, rows.clone())];
            })
            .unwrap();
        let k = stiffness(&problem);
        let worst = k
            .iter()
            .zip(&cells)
            .fold(0.0f64, |m, (k, t)| m.max((k / t - 1.0).abs()));
        assert!(worst > 0.03, "weight {weight}: {worst}");
    }
}
