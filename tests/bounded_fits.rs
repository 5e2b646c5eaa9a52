//! Fits with thousands of bounds and a path of weights: the minima that an interior-point method on the stages of the
//! linearised equation of motion finds, in double and in extended precision.

use kmcfit::config::{BuildMode, Model, ModelFile, Override, build};
use kmcfit_core::internals::solvers::{Fit, Status, WeightPath, choose_weight};

/// `models/noisy.yaml` with `values` set, fitted along its path of weights.
fn noisy(values: &[&str]) -> (WeightPath, Fit) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/models/noisy.yaml");
    let texts: Vec<String> = values.iter().map(|text| (*text).to_string()).collect();
    let overrides = Override::parse_all(&texts).expect("values");
    let file = ModelFile::read_with(path, &overrides).expect("a file");
    let model: Model = build(&file, BuildMode::Fit).expect("a model");
    let search = model.weight_rule.as_ref().expect("a rule");
    let start = model.problem.functions.start();
    let (path, _, fit) = choose_weight(
        &model.problem,
        &start,
        &model.settings,
        search.rule,
        &search.penalties,
        &mut |_| {},
    )
    .expect("a motion");
    (path, fit)
}

/// J along the path. A fit that accepts a wrong minimum of a quadratic program ends above it.
#[test]
fn the_minima_at_heavy_weights() {
    let (path, fit) = noisy(&[]);
    let costs = path
        .points
        .iter()
        .map(|p| p.misfit + p.weight * p.roughness);
    let costs: Vec<f64> = costs.take(4).collect();
    // From the largest weight of the path, 1.06e10, to 1.06e7.
    let expected = [1995.725, 1995.714, 1995.628, 1995.035];
    for (found, expected) in costs.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-3, "{costs:?}");
    }
    assert_eq!(fit.outcome.status, Status::Converged, "{:?}", fit.outcome);
    let optimality = fit.optimality.expect("a measured end");
    assert!(optimality.holds(), "{optimality:?}");
    assert!(optimality.stationarity <= 1e-8, "{optimality:?}");
}

#[test]
fn the_minimum_of_a_passive_system() {
    let constraints = "constraints=[{function: stiffness, at: 0.0, value: 1.0}, {passive: true}]";
    let (_, fit) = noisy(&[constraints]);
    let cost = fit.best.evaluation.cost;
    assert!((cost - 1995.73).abs() <= 5e-3, "{cost} {:?}", fit.outcome);
    assert_eq!(fit.outcome.status, Status::Converged, "{:?}", fit.outcome);
}
