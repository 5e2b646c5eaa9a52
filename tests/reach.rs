//! Every basis, method and kind of constraint on problems with known answers, from random starts: how
//! many of them reach the answer.

mod common;

use kmcfit::constraints::RowGroup;
use kmcfit::dynamics::{Device, Method};
use kmcfit::functions::basis::uniform_knots;
use kmcfit::functions::{Basis, CoefficientFunction, Penalty, Quantity};
use kmcfit::objective::GradientKind;
use kmcfit::problem::Problem;
use kmcfit::solvers::{FitSettings, Initial, Solver, Start, Stopping, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const STARTS: u64 = 20;
const NODES: usize = 301;

/// The answer: m = 1 - 0.02 t, c = 0.05, k = 1; the stiffness is known.
fn truth(oscillator: &kmcfit::dynamics::Oscillator) -> Device {
    let mass = oscillator
        .grid
        .times()
        .iter()
        .map(|t| 1.0 - 0.02 * t)
        .collect();
    Device {
        mass,
        coefficients: vec![vec![0.05; NODES], vec![1.0; NODES]],
    }
}

fn bases(grid: &kmcfit::dynamics::Grid) -> Vec<Basis> {
    vec![
        Basis::Nodal,
        Basis::PiecewiseLinear {
            knots: uniform_knots(grid, 6),
        },
        Basis::Polynomial { degree: 2 },
        Basis::BSpline {
            knots: uniform_knots(grid, 4),
        },
    ]
}

/// The mass in `basis`, a constant damping, a known stiffness, started at `(m, c)`.
fn problem(basis: &Basis, constrained: bool, start: (f64, f64)) -> (Problem, Device) {
    let oscillator = common::oscillator(NODES, Method::Rk4);
    let truth = truth(&oscillator);
    let observed = oscillator
        .forward(&truth, common::INITIAL, None)
        .unwrap()
        .displacement;
    let grid = oscillator.grid;
    let list = vec![
        CoefficientFunction::free(
            Quantity::Mass,
            basis.clone(),
            &grid,
            basis.constant(&grid, start.0),
        ),
        CoefficientFunction::constant(Quantity::Damping, start.1, NODES),
        CoefficientFunction::fixed(Quantity::Stiffness, vec![1.0; NODES]),
    ];
    let mut problem = common::problem_of(oscillator, list, observed, None);
    // Weak enough not to move the answer, which it does not charge; it makes it the only one.
    problem
        .penalties
        .push(Penalty::new(0, 2, 1.0, basis.roughness(&grid, 2)));
    if constrained {
        // The mass is only lost, and the damping is never negative.
        let times: Vec<f64> = grid.times().into_iter().step_by(10).collect();
        let slopes = basis.rows(&grid, &times, 1);
        let mut group = RowGroup::new("mass non-increasing");
        for (row, t) in slopes.row_iter().zip(&times) {
            let entries = row
                .col_indices()
                .iter()
                .copied()
                .zip(row.values().iter().copied());
            group.push(entries, [f64::NEG_INFINITY, 0.0], [*t, *t]);
        }
        problem.constraints.groups.push(group);
        let damping = problem.functions.ranges()[1].start;
        let mut group = RowGroup::new("damping >= 0");
        group.push(
            [(damping, 1.0)],
            [0.0, f64::INFINITY],
            [0.0, common::DURATION],
        );
        problem.constraints.groups.push(group);
    }
    (problem, truth)
}

fn reaches(basis: &Basis, solver: Solver, constrained: bool, seed: u64) -> bool {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let start = (random.random_range(0.5..2.5), random.random_range(0.0..1.0));
    let (problem, truth) = problem(basis, constrained, start);
    let settings = FitSettings {
        solver,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-12),
            ..Stopping::exactly(400)
        },
        interrupt: None,
    };
    let start = match problem.feasible_start(&problem.functions.start()) {
        Start::Kept(start)
        | Start::Moved {
            parameters: start, ..
        } => start,
        other => panic!("{other:?}"),
    };
    let found = fit(&problem, &start, &settings, &mut |_| {}).unwrap();
    assert!(problem.constraints.hold(&found.best.parameters, 1e-9));
    let errors = common::errors(&found.best.evaluation.device, &truth);
    errors.iter().all(|e| *e < 1e-3)
}

#[test]
fn the_share_of_starts_that_reach_the_answer_does_not_fall() {
    let grid = common::oscillator(NODES, Method::Rk4).grid;
    // Gauss-Newton has the start ladder, the others only their start; in 400 iterations they do not
    // bring a smoothed function of one value per node to its end.
    let table: [(Solver, bool, [u64; 4]); 5] = [
        (Solver::GaussNewton, false, [20, 20, 20, 20]),
        (Solver::GaussNewton, true, [20, 20, 20, 20]),
        (Solver::ProjectedGradient, false, [0, 20, 20, 14]),
        (Solver::ProjectedGradient, true, [0, 20, 20, 20]),
        (Solver::Lbfgs { memory: 20 }, false, [0, 20, 20, 20]),
    ];
    println!("starts of {STARTS} that reach the answer");
    let mut short = Vec::new();
    for (solver, constrained, least) in table {
        for (basis, least) in bases(&grid).iter().zip(least) {
            let count = (1..=STARTS)
                .filter(|seed| reaches(basis, solver, constrained, *seed))
                .count() as u64;
            let words = format!(
                "{} {} constrained: {constrained}: {count}",
                solver.name(),
                basis.name()
            );
            println!("{words}");
            if count < least {
                short.push(format!("{words}, at least {least}"));
            }
        }
    }
    assert!(short.is_empty(), "{short:#?}");
}
