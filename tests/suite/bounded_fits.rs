//! Fits with thousands of bounds and a path of weights: the minima that an interior-point method on the stages of the
//! linearised equation of motion finds, in double and in extended precision.

use kmcfit::config::{BuildMode, Model, ModelFile, Override, build};
use kmcfit_core::solvers::{Fit, Status, WeightPath, choose_weight, fit};

/// A shipped model with `values` set.
fn shipped(name: &str, values: &[&str]) -> Model {
    let path = format!("{}/models/{name}.yaml", env!("CARGO_MANIFEST_DIR"));
    let texts: Vec<String> = values.iter().map(|text| (*text).to_string()).collect();
    let overrides = Override::parse_all(&texts).expect("values");
    let file = ModelFile::read_with_overrides(path, &overrides).expect("a file");
    build(&file, BuildMode::Fit).expect("a model")
}

/// `models/noisy.yaml` with `values` set, fitted along its path of weights.
fn noisy(values: &[&str]) -> (WeightPath, Fit) {
    let model = shipped("noisy", values);
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

/// J of every weight agrees to 1e-9, although no step of one fit is that of the other.
#[test]
fn stages_and_clarabel_find_the_same_minima_along_a_path_of_weights() {
    let [(stages, _), (clarabel, _)] = ["fit.qp=auto", "fit.qp=clarabel"]
        .map(|qp| noisy(&["grid.nodes=500", "fit.stop.tolerance=1.0e-12", qp]));
    assert_eq!(stages.points.len(), clarabel.points.len());
    for (a, b) in stages.points.iter().zip(&clarabel.points) {
        let [a_cost, b_cost] = [a, b].map(|p| p.misfit + p.weight * p.roughness);
        assert!(
            (a_cost - b_cost).abs() <= 1e-9 * b_cost,
            "weight {:e}: {a_cost} and {b_cost}",
            a.weight
        );
    }
}

/// Fits without noise: J is a rounding error, and both solvers recover the system. Where many systems have the same record, with
/// positivity alone, both end at a J below the ratio at which the model stops. Coefficients are of order 1, or zero.
#[test]
fn stages_and_clarabel_fit_every_shipped_model_with_constraints() {
    for name in [
        "knots",
        "linear-mass",
        "paper-forced",
        "paper-smooth",
        "paper-two-records",
        "spline",
    ] {
        let [on_stages, by_clarabel] = ["auto", "clarabel"].map(|qp| {
            let model = shipped(name, &[&format!("fit.qp={qp}")]);
            let settings = &model.settings;
            let found = fit(
                &model.problem,
                &model.problem.start(),
                settings,
                &mut |_| {},
            )
            .expect("a response");
            (
                found.outcome.status,
                model.problem.functions.nodal(&found.best.parameters),
            )
        });
        assert_eq!(on_stages.0, Status::Converged, "{name}");
        assert_eq!(by_clarabel.0, Status::Converged, "{name}");
        for (a, b) in on_stages.1.functions().zip(by_clarabel.1.functions()) {
            let size = b.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let difference = a
                .iter()
                .zip(b)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(
                difference <= 1e-6 * size.max(1e-3),
                "{name}: {difference:e} of {size}"
            );
        }
    }
    for qp in ["auto", "clarabel"] {
        let model = shipped("paper-positive", &[&format!("fit.qp={qp}")]);
        let found = fit(
            &model.problem,
            &model.problem.start(),
            &model.settings,
            &mut |_| {},
        )
        .expect("a response");
        assert_eq!(found.outcome.status, Status::Converged, "{qp}");
        assert!(found.best.evaluation.cost <= 1e-6 * 139.8, "{qp}");
    }
}
