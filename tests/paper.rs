mod common;
use kmcfit::objective::GradientKind;
use kmcfit::solvers::{FitSettings, Solver, Stopping, fit};

#[test]
fn run() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let settings = FitSettings {
        solver: Solver::SteepestDescent,
        gradient: GradientKind::Continuous,
        stopping: Stopping::exactly(1000),
        interrupt: None,
    };
    let result = fit(&problem, &problem.functions.start(), &settings, &mut |_| {}).unwrap();
    println!(
        "{} {:?} {:?}",
        result.initial_cost, result.counts, result.elapsed
    );
    let text = std::fs::read_to_string("../shared/reference/paper_history.csv").unwrap();
    let mut worst = 0.0f64;
    for (row, line) in result.history.iter().zip(text.lines().skip(1)) {
        let f: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        worst = worst
            .max((row.cost_ratio / f[2] - 1.0).abs())
            .max((row.gradient_norm_squared_ratio / f[3] - 1.0).abs());
    }
    println!("worst {worst:e} {:?}", result.history.last());
}
#[test]
fn lbfgs() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    for memory in [5, 10, 20, 40] {
        let settings = FitSettings {
            solver: Solver::Lbfgs { memory },
            gradient: GradientKind::Discrete,
            stopping: Stopping::exactly(1000),
            interrupt: None,
        };
        let result = fit(&problem, &problem.functions.start(), &settings, &mut |_| {}).unwrap();
        println!(
            "{memory} {} {:?} {:?} {:?}",
            result.initial_cost, result.counts, result.elapsed, result.outcome
        );
        let it4 = result
            .history
            .iter()
            .find(|r| r.cost_ratio <= 1e-4)
            .map(|r| r.iteration);
        let it6 = result
            .history
            .iter()
            .find(|r| r.cost_ratio <= 1e-6)
            .map(|r| r.iteration);
        println!("{it4:?} {it6:?} {:?}", result.history.last());
    }
}
