use super::problems::knots;
use kmcfit_core::internals::functions::{Basis, Penalty};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::record::{Channel, Weighting};
use kmcfit_core::internals::solvers::fit_from;
use kmcfit_core::internals::study::constancy_test::{
    ConstancySettings, ConstancyTest, constancy_tests,
};

fn asked(problem: &Problem) -> ConstancyTest {
    let settings = crate::common::synthetic::settings();
    let best = fit_from(problem, &problem.start(), &settings)
        .unwrap()
        .best
        .parameters;
    let how = ConstancySettings {
        simulations: 199,
        threads: 2,
        ..ConstancySettings::default()
    };
    let mut all = constancy_tests(problem, &best, &how).unwrap();
    assert_eq!(all.len(), 1, "the damping is constant by its basis");
    all.pop().unwrap()
}

/// Forty records of a constant stiffness: at the level 0.05 two are called varying on average; more
/// than seven have a probability of 0.2 %, and a p-value below one half half of them: 20 +- 3.2.
#[test]
fn a_constant_is_called_constant_at_the_nominal_rate() {
    let found: Vec<ConstancyTest> = (0..40)
        .map(|seed| asked(&knots(&|_| 2.0, 6, 0.05, 100 + seed)))
        .collect();
    let varying = found.iter().filter(|v| v.varies()).count();
    let low = found.iter().filter(|v| v.p_value < 0.5).count();
    println!("{varying} of 40, {low} below one half");
    println!("{}", found[0].sentence());
    assert!(varying <= 7, "{varying}");
    assert!((8..=32).contains(&low), "{low}");
    assert!(found.iter().filter(|v| v.bic > 0.0).count() <= 2);
}

#[test]
fn a_stiffness_that_varies_is_found() {
    let found = asked(&knots(&|t| 2.0 + 0.3 * (0.6 * t).sin(), 6, 0.05, 1));
    println!("{}", found.sentence());
    assert!(found.varies() && found.bic > 0.0, "{found:?}");
    assert!(found.sentence().contains("rejects a constant"));
    // Smoothed, and without a stated sigma.
    let mut problem = knots(&|t| 2.0 + 0.3 * (0.6 * t).sin(), 11, 0.05, 2);
    let grid = problem.system.grid;
    let knots = (0..11).map(|i| i as f64).collect();
    let rows = Basis::PiecewiseLinear { knots }.roughness(&grid, 1);
    problem.penalize(Penalty::new(2, 1, 10.0, rows)).unwrap();
    let found = asked(&problem);
    println!("{}", found.sentence());
    assert!(found.varies(), "{found:?}");
    problem = problem
        .with(|parts| {
            for experiment in &mut parts.experiments {
                let plain = |c: &Channel| {
                    let weights = vec![1.0; c.len()];
                    c.clone().with_weighting(Weighting::Trapezoid(weights))
                };
                experiment.channels = experiment.channels.iter().map(plain).collect();
            }
        })
        .unwrap();
    problem = problem
        .with(|parts| {
            parts.penalties[0].weight *= 0.05 * 0.05;
        })
        .unwrap();
    let found = asked(&problem);
    println!("{}", found.sentence());
    assert!(found.varies(), "{found:?}");
}

#[test]
fn with_smoothness_the_rate_is_nominal_too() {
    let smoothed = |seed: u64| {
        let mut problem = knots(&|_| 2.0, 11, 0.05, 500 + seed);
        let knots = (0..11).map(|i| i as f64).collect();
        let rows = Basis::PiecewiseLinear { knots }.roughness(&problem.system.grid, 1);
        problem.penalize(Penalty::new(2, 1, 10.0, rows)).unwrap();
        asked(&problem).p_value
    };
    let p: Vec<f64> = (0..30).map(smoothed).collect();
    let varying = p.iter().filter(|p| **p <= 0.05).count();
    println!("{varying} of 30");
    // 1.5 expected; more than six: 0.1 %.
    assert!(varying <= 6, "{p:?}");
}
