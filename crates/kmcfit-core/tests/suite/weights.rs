//! Choice of the penalty weight from noisy samples.

use crate::common;
use crate::common::counts::seeds;

use kmcfit_core::functions::{CoefficientFunction, Ratio, WeightRule};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Initial, Solver, Stopping, WeightPath, choose_weight};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};
use std::ops::RangeInclusive;

const SIGMA: f64 = 0.1;

fn nodal_problem(truth: &NodalCoefficients, nodes: usize, bounded: bool, seed: u64) -> Problem {
    let system = common::system(nodes, Method::Midpoint);
    let observed = common::noisy(&system, truth, SIGMA, seed);
    let quantities = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
    ];
    let list = quantities
        .into_iter()
        .zip([2.0, 1.0, 1.0])
        .map(|(q, start)| CoefficientFunction::nodal(q, vec![start; nodes]))
        .collect();
    let mut problem = common::problem_of(system, list, observed, Some(SIGMA));
    common::add_physics(&mut problem, 1.0, bounded);
    problem
}

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Data,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-5),
            ..Stopping::exactly(40)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

fn relative_errors(problem: &Problem, theta: &[f64], truth: &NodalCoefficients) -> [f64; 2] {
    let nodal = problem.functions.nodal(theta);
    let relative = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .fold(0.0f64, |most, (a, b)| most.max((a / b - 1.0).abs()))
    };
    let of = |nodal| Ratio::StiffnessOverMass.at_nodes(problem.system.laws(), nodal);
    [
        relative(&nodal.inertias[0], &truth.inertias[0]),
        relative(&of(&nodal), &of(truth)),
    ]
}

fn path(problem: &Problem) -> (WeightPath, Vec<f64>) {
    let start = problem.functions.start();
    let rule = WeightRule::Discrepancy;
    let (path, _, fit) =
        choose_weight(problem, &start, &settings(), rule, &[0, 1, 2], &mut |_| {}).unwrap();
    (path, fit.best.parameters)
}

/// Chi-square of the noise and the largest weight below it: a straight mass is what the penalty
/// favours, so the smooth fit must find it well.
fn paper_system_with_noise(nodes: usize, bounded: bool, seeds: RangeInclusive<u64>) {
    let truth = common::paper_system(nodes);
    for seed in seeds {
        let problem = nodal_problem(&truth, nodes, bounded, seed);
        let (path, theta) = path(&problem);
        let errors = relative_errors(&problem, &theta, &truth);
        assert!(errors.iter().all(|e| *e <= 0.05), "seed {seed}: {errors:?}");
        // Every smaller weight on the path also explains the data.
        let limit = nodes as f64 + 2.0 * (2.0 * nodes as f64).sqrt();
        assert!(path.points[path.chosen].misfit <= limit);
        assert!(path.points[..path.chosen].iter().all(|p| p.misfit > limit));
        // Cross-validation chooses on the same path.
        assert!(path.picks[2].is_some());
        println!("seed {seed}: largest relative errors of m and k/m {errors:?}");
    }
}

#[test]
fn the_discrepancy_principle_recovers_the_paper_s_system_from_noise() {
    paper_system_with_noise(2000, true, 1..=2);
}

/// Half the samples and no bounds: no program is solved.
#[test]
fn the_discrepancy_principle_recovers_the_system_without_bounds() {
    paper_system_with_noise(1000, false, 1..=seeds(6, 20));
}
