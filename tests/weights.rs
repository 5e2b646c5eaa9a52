//! Choosing the weight of the smoothness from noisy readings.

mod common;

use kmcfit::dynamics::{Device, Method};
use kmcfit::functions::{CoefficientFunction, Quantity, Ratios};
use kmcfit::objective::GradientKind;
use kmcfit::problem::Problem;
use kmcfit::solvers::{
    FitSettings, Initial, Solver, Stopping, WeightPath, WeightRule, choose_weight,
};

const SIGMA: f64 = 0.1;

fn nodal_problem(truth: &Device, nodes: usize, seed: u64) -> Problem {
    let oscillator = common::oscillator(nodes, Method::Midpoint);
    let observed = common::noisy(&oscillator, truth, SIGMA, seed);
    let quantities = [Quantity::Mass, Quantity::Damping, Quantity::Stiffness];
    let list = quantities
        .into_iter()
        .zip([2.0, 1.0, 1.0])
        .map(|(q, start)| CoefficientFunction::nodal(q, vec![start; nodes]))
        .collect();
    let mut problem = common::problem_of(oscillator, list, observed, Some(SIGMA));
    common::add_physics(&mut problem, 1.0, true);
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
        interrupt: None,
    }
}

fn relative_errors(problem: &Problem, theta: &[f64], truth: &Device) -> [f64; 2] {
    let device = problem.functions.device(theta);
    let relative = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .fold(0.0f64, |most, (a, b)| most.max((a / b - 1.0).abs()))
    };
    let (found, exact) = (Ratios::of(&device), Ratios::of(truth));
    [
        relative(&device.mass, &truth.mass),
        relative(&found.k_over_m, &exact.k_over_m),
    ]
}

fn path(problem: &Problem, rule: WeightRule) -> (WeightPath, Vec<f64>) {
    let start = problem.functions.start();
    let (path, _, fit) = choose_weight(problem, &start, &settings(), rule, &mut |_| {}).unwrap();
    (path, fit.best.parameters)
}

#[test]
fn try_it() {
    let nodes: usize = std::env::var("NS")
        .unwrap_or("2000".into())
        .parse()
        .unwrap();
    let truth = common::paper_device(nodes);
    for seed in 1..=2 {
        let clock = std::time::Instant::now();
        let problem = nodal_problem(&truth, nodes, seed);
        let (path, theta) = path(&problem, WeightRule::Discrepancy);
        println!(
            "seed {seed} {:?} errors {:?} picks {:?} {:?}",
            clock.elapsed(),
            relative_errors(&problem, &theta, &truth),
            path.picks,
            path.remark
        );
        for p in &path.points {
            println!(
                "  {:.2e} misfit {:.2} rough {:.3e} dof {:.2} gcv {:.5} errors {:?}",
                p.weight,
                p.misfit,
                p.roughness,
                p.degrees_of_freedom,
                p.gcv,
                relative_errors(&problem, &p.parameters, &truth)
            );
        }
    }
}
