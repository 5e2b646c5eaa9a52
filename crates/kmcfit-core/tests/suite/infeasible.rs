//! Infeasible problems, and quadratic programs without a solution: the fit ends with a status and its best point.

use crate::common;

use kmcfit_core::constraints::{Constraints, RowGroup, TOLERANCE};
use kmcfit_core::functions::{Basis, CoefficientFunction, uniform_knots};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::qp::project;
use kmcfit_core::solvers::{
    Fit, FitSettings, Initial, Solver, StartProjection, Status, Stopping, fit,
};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};

const NODES: usize = 101;
const UNBOUNDED: f64 = f64::INFINITY;

/// Samples of a mass that grows, `m = 0.8 + 0.01 t`; the mass is estimated in `basis`.
fn problem(basis: &Basis) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let grid = system.grid;
    let truth = NodalCoefficients {
        inertias: vec![grid.times().iter().map(|t| 0.8 + 0.01 * t).collect()],
        coefficients: vec![vec![0.05; NODES], vec![1.0; NODES]],
    };
    let response = system.forward(&truth, &common::initial(), None).unwrap();
    let start = basis.constant(&grid, 1.0);
    let list = vec![
        CoefficientFunction::free(CoefficientKind::MASS, basis.clone(), &grid, start),
        CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, NODES),
        CoefficientFunction::fixed(CoefficientKind::STIFFNESS, vec![1.0; NODES]),
    ];
    common::problem_of(system, list, response.displacement(0).to_vec(), None)
}

fn knots() -> Basis {
    let grid = common::system(NODES, Method::Rk4).grid;
    Basis::PiecewiseLinear {
        knots: uniform_knots(&grid, 6),
    }
}

/// `lower <= first - second <= upper` for the knots of the mass that follow each other, every row
/// multiplied by `scale`.
fn falling(bounds: [f64; 2], scale: f64) -> RowGroup {
    let mut group = RowGroup::new("mass falls");
    for j in 0..5 {
        let row = [(j, scale), (j + 1, -scale)];
        group.push(row, bounds.map(|b| scale * b), [j as f64, j as f64]);
    }
    group
}

fn run(problem: &Problem, solver: Solver, program_iterations: u32) -> Fit {
    let settings = FitSettings {
        solver,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-10),
            program_iterations,
            ..Stopping::exactly(100)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let start = problem.functions.start();
    fit(problem, &start, &settings, &mut |_| {}).unwrap()
}

const SOLVERS: [Solver; 2] = [Solver::GaussNewton, Solver::ProjectedGradient];

/// The returned point is finite, and its cost is not above the start's.
fn keeps_the_best_point(problem: &Problem, found: &Fit) {
    let finite = found.best.parameters.iter().all(|p| p.is_finite());
    let cost = found.best.evaluation.cost;
    assert!(finite && cost.is_finite(), "{:?}", found.best.parameters);
    let start = problem.evaluate(&problem.functions.start()).unwrap().cost;
    assert!(cost <= start, "{cost} {start}");
    let again = problem.evaluate(&found.best.parameters).unwrap().cost;
    assert_eq!(cost, again);
}

#[test]
fn a_stalled_program_ends_a_fit_with_its_best_point() {
    for solver in SOLVERS {
        let mut problem = problem(&knots());
        // The constraint is active from the first iteration on, and clipping is not sufficient.
        problem = problem
            .with(|parts| {
                parts.constraints.groups = vec![falling([0.0, UNBOUNDED], 1.0)];
            })
            .unwrap();
        let solved = run(&problem, solver, Stopping::default().program_iterations);
        assert_eq!(solved.outcome.status, Status::Converged, "{solver:?}");
        // Without iterations no program is solved.
        let found = run(&problem, solver, 0);
        assert_eq!(found.outcome.status, Status::Stalled, "{solver:?}");
        assert!(found.outcome.reason.to_string().contains("solver stalled"));
        assert!(problem.constraints.hold(&found.best.parameters, TOLERANCE));
        keeps_the_best_point(&problem, &found);
        // A start within the constraints may be as low, but nothing is lower than the minimum.
        let (cost, least) = (found.best.evaluation.cost, solved.best.evaluation.cost);
        assert!(
            cost >= (1.0 - 1e-6) * least,
            "{solver:?}: {cost:e} {least:e}"
        );
    }
}

/// A program may also stall after others were solved: for any limit the best point is kept, and more iterations per program never lead to
/// a higher cost.
#[test]
fn a_stalled_program_does_not_lose_the_best_point() {
    let mut problem = problem(&knots());
    problem = problem
        .with(|parts| {
            parts.constraints.groups = vec![falling([0.0, UNBOUNDED], 1.0)];
        })
        .unwrap();
    let ends: Vec<Fit> = (4..=16)
        .step_by(2)
        .map(|limit| run(&problem, Solver::GaussNewton, limit))
        .collect();
    for found in &ends {
        let status = found.outcome.status;
        assert!(matches!(status, Status::Stalled | Status::Converged));
        assert!(problem.constraints.hold(&found.best.parameters, TOLERANCE));
        keeps_the_best_point(&problem, found);
    }
    let last = ends.last().unwrap();
    assert_eq!(last.outcome.status, Status::Converged);
}

/// Rows with factors from 1e-200 to 1e200 are equivalent to rows of size 1; rows whose entries differ by as
/// much cannot be solved. In both cases the fit has a status and a point.
#[test]
fn badly_scaled_constraints_end_with_a_point() {
    let mut mixed = RowGroup::new("sizes apart");
    mixed.push([(0, 1e-150), (1, 1e150)], [0.0, UNBOUNDED], [0.0, 0.0]);
    mixed.push([(2, 1e-9), (3, -1e9), (4, 1.0)], [-1.0, 1e9], [0.0, 0.0]);
    let groups = [
        falling([0.0, UNBOUNDED], 1e-200),
        falling([0.0, UNBOUNDED], 1e200),
        falling([0.0, 1e-300], 1.0),
        mixed,
    ];
    for (i, group) in groups.into_iter().enumerate() {
        for solver in SOLVERS {
            let mut problem = problem(&knots());
            problem = problem
                .with(|parts| {
                    parts.constraints.groups = vec![group.clone()];
                })
                .unwrap();
            let start = match problem.feasible_start(&problem.functions.start()) {
                StartProjection::Kept(start) => start,
                StartProjection::Moved { parameters, .. } => parameters,
                // A program that stalls here is reported before the fit.
                StartProjection::Unsolved(_) => continue,
                other => panic!("{i} {solver:?}: {other:?}"),
            };
            problem = problem
                .with(|parts| {
                    parts.functions.set_start(&start);
                })
                .unwrap();
            let found = run(&problem, solver, 100);
            println!("{i} {solver:?}: {:?}", found.outcome);
            keeps_the_best_point(&problem, &found);
            assert!(problem.constraints.hold(&found.best.parameters, TOLERANCE));
        }
    }
}

/// From a start outside contradictory constraints no step is possible.
#[test]
fn contradictory_constraints_of_a_problem_make_a_fit_infeasible() {
    for solver in SOLVERS {
        let mut problem = problem(&knots());
        problem = problem
            .with(|parts| {
                parts.constraints.groups = vec![
                    falling([0.1, UNBOUNDED], 1.0),
                    falling([-UNBOUNDED, -0.1], 1.0),
                ];
            })
            .unwrap();
        let found = run(&problem, solver, 100);
        assert_eq!(found.outcome.status, Status::Infeasible, "{solver:?}");
        assert_eq!(found.best.parameters, problem.functions.start());
        keeps_the_best_point(&problem, &found);
    }
}

/// The nearest function through three points is negative between two of them; the nearest non-negative function is
/// not.
#[test]
fn a_start_is_projected_to_a_positive_mass() {
    let basis = Basis::Polynomial { degree: 4 };
    let mut problem = problem(&basis);
    let grid = problem.system.grid;
    let times = [0.0, 12.5, 18.75];
    let mut group = RowGroup::new("three masses");
    let rows = basis.rows(&grid, &times, 0);
    for (i, value) in [3.0, 1e-3, 1e-3].into_iter().enumerate() {
        group.push(rows.row(i), [value, value], [0.0, 0.0]);
    }
    problem = problem
        .with(|parts| {
            parts.constraints = Constraints {
                groups: vec![group],
                cones: Vec::new(),
            };
        })
        .unwrap();
    let start = problem.functions.start();
    let least = |theta: &[f64]| {
        let mass = problem.functions.nodal(theta).inertias.swap_remove(0);
        mass.into_iter().fold(f64::INFINITY, f64::min)
    };
    let metric = problem.functions.gram_diagonal();
    let nearest = project(&problem.constraints, &start, &metric).theta;
    assert!(least(&nearest) < 0.0, "{}", least(&nearest));
    match problem.feasible_start(&start) {
        StartProjection::Moved { parameters, .. } => {
            assert!(least(&parameters) > 0.0);
            assert!(problem.constraints.hold(&parameters, TOLERANCE));
        }
        other => panic!("{other:?}"),
    }
}
