//! L-BFGS on the paper's problem, one value per step.

use crate::common;

use kmcfit_core::objective::GradientKind;
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Status, Stopping, fit};

fn settings(stopping: Stopping) -> FitSettings {
    FitSettings {
        solver: Solver::Lbfgs { memory: 20 },
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping,
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

fn until(cost_ratio: f64, iterations: u64) -> FitSettings {
    settings(Stopping {
        cost_ratio: Some(cost_ratio),
        ..Stopping::exactly(iterations)
    })
}

#[test]
fn the_start_of_the_paper_reaches_a_millionth_of_its_cost() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let start = problem.functions.start();
    let run = fit(&problem, &start, &until(1e-6, 1000), &mut |_| {}).unwrap();
    assert_eq!(run.outcome.status, Status::Converged);
    // One forward and one adjoint solve per iteration, and few trials besides.
    let iterations = run.history.len() as u64;
    assert_eq!(run.counts.adjoint, iterations + 1);
    assert!(run.counts.forward <= iterations * 6 / 5, "{:?}", run.counts);
}

#[test]
fn the_work_does_not_grow_with_the_number_of_nodes() {
    // In the L2 inner product the search is one in function space.
    let iterations = [500, 2000, 8000].map(|nodes| {
        let problem = common::paper_problem(nodes, [2.0, 1.0, 1.0]);
        let start = problem.functions.start();
        let run = fit(&problem, &start, &until(1e-3, 400), &mut |_| {}).unwrap();
        assert_eq!(run.outcome.status, Status::Converged);
        run.history.len()
    });
    let (least, most) = (
        iterations.iter().min().unwrap(),
        iterations.iter().max().unwrap(),
    );
    assert!(most * 2 <= least * 3, "{iterations:?}");
}

#[test]
fn the_cost_falls_at_every_iteration() {
    let problem = common::paper_problem(500, [2.0, 1.0, 1.0]);
    let start = problem.functions.start();
    let run = fit(
        &problem,
        &start,
        &settings(Stopping::exactly(300)),
        &mut |_| {},
    )
    .unwrap();
    let mut last = run.initial_cost;
    for row in &run.history {
        assert!(row.cost < last, "{row:?}");
        last = row.cost;
    }
    assert_eq!(run.best.evaluation.cost, last);
}

#[test]
fn a_start_that_cannot_be_simulated_is_an_error() {
    let problem = common::paper_problem(100, [2.0, 1.0, 1.0]);
    let mut start = problem.functions.start();
    start[17] = -1.0;
    let breakdown = fit(
        &problem,
        &start,
        &settings(Stopping::exactly(10)),
        &mut |_| {},
    );
    assert_eq!(breakdown.unwrap_err().node, 17);
}
