use super::*;
use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Parameterization};
use crate::objective::GradientKind;
use crate::record::{Channel, Experiment};
use crate::solvers::{FitSettings, Solver};
use crate::step::EngineMode;
use crate::structure::{Law, Structure};
use crate::system::{Grid, Method, State, System};

const NODES: usize = 401;

/// The paper's problem on a coarse grid.
fn problem() -> Problem {
    let grid = Grid::new(0.0, 10.0, NODES).expect("a grid");
    let system = System {
        grid,
        method: Method::Midpoint,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let nodal = |quantity, start: f64| {
        CoefficientFunction::free(quantity, Basis::Nodal, &grid, vec![start; NODES])
    };
    let list = vec![
        nodal(CoefficientKind::MASS, 2.0),
        nodal(CoefficientKind::DAMPING, 1.0),
        nodal(CoefficientKind::STIFFNESS, 1.0),
    ];
    let functions = Parameterization::new(list, NODES, grid.step()).expect("functions");
    let times = grid.times().into_iter();
    let samples = times.map(|t| (-0.05 * t).exp() * (1.1 * t).cos()).collect();
    let spacing = grid.step();
    let weighting = Weighting::Integral { spacing };
    let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
    let initial = State::one(1.0, 0.0);
    let experiment = Experiment::free("decay", initial, NODES).with_channel(channel);
    Problem::new(system, functions, vec![experiment]).unwrap()
}

/// Iterates of a search with some steps.
fn search(problem: &Problem, steps: usize) -> Vec<Iterate> {
    let settings = FitSettings {
        solver: Solver::SteepestDescent,
        gradient: GradientKind::Continuous,
        ..FitSettings::default()
    };
    let mut counted = argmin::core::Problem::new(problem);
    let mut work = CountedEvaluator::new(&mut counted, &settings);
    let mut evaluation = problem.workspace();
    let evaluated = work.evaluate_into(&problem.start(), &mut evaluation);
    evaluated.expect("a motion");
    let mut points = vec![work.complete(problem.start(), evaluation)];
    let mut method = SteepestDescent::default();
    for _ in 0..steps {
        let point = points.last().expect("a point");
        assert!(ray(problem, point).is_some(), "the paper's problem");
        let Step::Moved { point, .. } = method.step(&mut work, point) else {
            panic!("a lower cost");
        };
        points.push(*point);
    }
    points
}

/// Each step is the best of the trials evaluated one by one.
#[test]
fn steps_are_the_best_of_all_trials() {
    let problem = problem();
    let points = search(&problem, 12);
    for (step, pair) in points.windows(2).enumerate() {
        let (before, after) = (&pair[0], &pair[1]);
        let mut lowest = (before.evaluation.cost, 0.0);
        for length in lengths(before) {
            let mut evaluation = problem.workspace();
            let parameters = trial(before, length);
            let evaluated =
                problem.evaluate_for(EngineMode::Reference, &parameters, &mut evaluation);
            if evaluated.is_ok() && evaluation.cost < lowest.0 {
                lowest = (evaluation.cost, length);
            }
        }
        assert_eq!(after.evaluation.cost, lowest.0, "step {step}");
        assert!(after.parameters == trial(before, lowest.1), "step {step}");
    }
}
