//! `result.json` agrees with the tables of the run.

use crate::workbench::{Workbench, column};
use serde_json::Value;

/// A system with every kind of term in J, far enough from the truth that none of the terms vanishes.
const EVERYTHING: &str = "format: 1
title: Every term
experiments:
  - data: samples.csv
    initial: {displacement: 1.0, velocity: 0.5}
grid: {nodes: 401, method: rk4}
functions:
  mass:
    basis: polynomial
    degree: 2
    start: [1.0, 0.01, 0.001]
    penalty: {kind: tikhonov, order: 1, weight: 0.3}
  damping:
    basis: b-spline
    knots: 5
    start: 0.2
    penalty: [{kind: tikhonov, order: 0, weight: 0.02, reference: 0.05}, {kind: tikhonov, order: 2, weight: 0.004}]
  stiffness:
    basis: piecewise-linear
    knots: 6
    start: 1.1
    penalty: {kind: tv, weight: 0.01}
constraints:
  - {function: stiffness, at: [0.0, 10.0], value: 1.2, soft: 0.5}
fit: {stop: {iterations: 4}}
";

fn bench() -> Workbench {
    let bench = Workbench::empty();
    let device = "format: 1
experiments:
  - initial: {displacement: 1.0, velocity: 0.5}
grid: {nodes: 401, method: rk4, duration: 10.0}
functions:
  mass: {fixed: 1.0}
  damping: {fixed: 0.1}
  stiffness: {fixed: 1.0}
";
    bench.write("device.yaml", device);
    bench.run_to(0, &["simulate", "device.yaml", "--out", "samples.csv"]);
    bench
}

fn fitted(bench: &Workbench, model: &str) -> Value {
    bench.write("model.yaml", model);
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    serde_json::from_str(&bench.read("run/result.json")).expect("JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Trapezoid rule.
fn integral(values: &[f64], step: f64) -> f64 {
    let pairs = values.windows(2).map(|w| 0.5 * (w[0] + w[1]));
    pairs.sum::<f64>() * step
}

/// Central differences at the inner nodes.
fn slopes(values: &[f64], step: f64) -> Vec<f64> {
    let slope = |w: &[f64]| (w[2] - w[0]) / (2.0 * step);
    values.windows(3).map(slope).collect()
}

fn squares(values: &[f64]) -> Vec<f64> {
    values.iter().map(|x| x * x).collect()
}

/// The terms of the cost, computed from the tables alone, add up to J.
#[test]
fn the_sentence_is_the_whole_cost() {
    let bench = bench();
    let result = fitted(&bench, EVERYTHING);
    assert_eq!(result["model"]["cost_kind"], "integral");
    assert_eq!(
        result["model"]["cost_definition"],
        "J = integral (y - y_obs)^2 dt (trapezoid rule over the samples, m^2 s) \
         + 0.3 * integral (dm/dt)^2 dt \
         + 0.02 * integral (c - reference)^2 dt \
         + 0.004 * integral (d^2c/dt^2)^2 dt \
         + 0.01 * total variation of k \
         + 0.5 * mean over its rows of (excess beyond `stiffness(0) = 1.2`)^2 \
         + 0.5 * mean over its rows of (excess beyond `stiffness(10) = 1.2`)^2"
    );
    let (motion, functions) = (
        bench.read("run/trajectory.csv"),
        bench.read("run/functions.csv"),
    );
    let step = 10.0 / 400.0;
    let (found, observed) = (column(&motion, "y_m"), column(&motion, "observed_y_m"));
    let residual: Vec<f64> = found.iter().zip(&observed).map(|(a, b)| a - b).collect();
    let mass = column(&functions, "mass_kg");
    let damping = column(&functions, "damping_N_s_per_m");
    let stiffness = column(&functions, "stiffness_N_per_m");
    let off: Vec<f64> = damping.iter().map(|c| c - 0.05).collect();
    let bends = slopes(&slopes(&damping, step), step);
    let ends = [stiffness[0], stiffness[400]].map(|k| (k - 1.2).powi(2));
    let misfit = integral(&squares(&residual), step);
    let terms = [
        0.3 * integral(&squares(&slopes(&mass, step)), step),
        0.02 * integral(&squares(&off), step),
        0.004 * integral(&squares(&bends), step),
        0.01 * stiffness
            .windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .sum::<f64>(),
        0.5 * (ends[0] + ends[1]),
    ];
    assert!(terms.iter().all(|term| *term > 0.0), "{terms:?}");
    let close = |found: f64, expected: f64, tolerance: f64| {
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{found} {expected}"
        );
    };
    close(number(&result["cost"]["misfit"]), misfit, 1e-12);
    // The differences omit up to two of 400 cells at either end.
    let regularisation = number(&result["cost"]["regularisation"]);
    close(regularisation, terms.iter().sum(), 0.02);
    close(
        number(&result["cost"]["final"]),
        misfit + regularisation,
        1e-12,
    );
}

/// The polynomial with the given coefficients equals the function in the table.
#[test]
fn polynomials_are_given_in_powers_of_t() {
    let bench = bench();
    let result = fitted(&bench, EVERYTHING);
    let powers: Vec<f64> = (result["functions"]["mass"]["powers"].as_array())
        .expect("a list")
        .iter()
        .map(number)
        .collect();
    assert_eq!(powers.len(), 3);
    let functions = bench.read("run/functions.csv");
    let times = column(&functions, "t_s");
    for (t, mass) in times.iter().zip(column(&functions, "mass_kg")) {
        let value = powers[0] + powers[1] * t + powers[2] * t * t;
        // Rounding error of three terms of the size of the function.
        assert!((value / mass - 1.0).abs() < 1e-14, "{t}: {value} {mass}");
    }
    for other in ["damping", "stiffness"] {
        assert!(
            result["functions"][other].get("powers").is_none(),
            "{other}"
        );
    }
}

/// A coarse fit starts a finer one whose knots contain its own: the finer one begins at the coarse
/// cost and does not end above it.
#[test]
fn a_coarse_fit_starts_a_finer_one() {
    let bench = bench();
    let noise = ["--noise", "0.02", "--seed", "3", "--out", "samples.csv"];
    std::fs::remove_file(bench.path("samples.csv")).expect("a file can be removed");
    bench.run_to(0, &[&["simulate", "device.yaml"][..], &noise].concat());
    let model = |knots: usize, start: [&str; 3]| {
        let [mass, damping, stiffness] = start;
        format!(
            "format: 1
experiments:
  - data: samples.csv
    initial: {{displacement: 1.0, velocity: 0.5}}
grid: {{method: rk4}}
functions:
  mass: {{basis: piecewise-linear, knots: {knots}, start: {mass}, penalty: {{kind: tikhonov, order: 1, weight: 0.001}}}}
  damping: {{basis: b-spline, knots: {knots}, start: {damping}}}
  stiffness: {{basis: piecewise-constant, knots: {knots}, start: {stiffness}}}
constraints:
  - {{function: stiffness, at: 0.0, value: 1.0}}
fit: {{stop: {{iterations: 200, tolerance: 1e-8}}}}
"
        )
    };
    bench.write("coarse.yaml", &model(6, ["1.3", "0.3", "1.0"]));
    bench.run_to(0, &["fit", "coarse.yaml"]);
    let columns = ["mass_kg", "damping_N_s_per_m", "stiffness_N_per_m"]
        .map(|name| format!("{{data: runs/coarse/functions.csv, column: {name}}}"));
    bench.write(
        "fine.yaml",
        &model(11, columns.each_ref().map(String::as_str)),
    );
    bench.run_to(0, &["fit", "fine.yaml"]);
    let cost = |run: &str, key: &str| {
        let result: Value = serde_json::from_str(&bench.read(run)).expect("JSON");
        number(&result["cost"][key])
    };
    let reached = cost("runs/coarse/result.json", "final");
    let begun = cost("runs/fine/result.json", "initial");
    let found = cost("runs/fine/result.json", "final");
    // The table has all digits, and every coarse function is in the finer basis: the difference is the rounding error of a
    // projection, a few hundred additions.
    assert!((begun / reached - 1.0).abs() < 1e-9, "{begun} {reached}");
    assert!(found <= begun, "{found} {begun}");
    assert!(
        found < 0.999 * reached,
        "twice the knots explain more noise: {found} {reached}"
    );
}

/// A fit of the equation error states the kind of its covariance once, and every coefficient is conditional on negligible noise.
#[test]
fn intervals_of_the_equation_error() {
    let bench = Workbench::with_shipped_models();
    let method = "fit.method=equation-error";
    let model = [
        "fit",
        "models/duffing.yaml",
        "--set",
        method,
        "--out",
        "run",
        "--verbose",
    ];
    let summary = bench.run_to(0, &model);
    let kind = "heteroscedasticity- and autocorrelation-consistent covariance";
    assert_eq!(summary.matches(kind).count(), 1, "{summary}");
    let text = bench.read("run/result.json");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(result["identifiability"]["covariance"], "kernel");
    for function in ["mass", "damping", "stiffness", "cubic_stiffness"] {
        let found = &result["functions"][function];
        assert_eq!(found["verdict"], "conditional");
        assert!(number(&found["standard_error"]) > 0.0);
    }
    let warnings = result["findings"].as_array();
    let conditional = warnings.expect("a list").iter();
    let conditional = conditional.filter(|w| w["condition"] == "negligible-noise");
    assert_eq!(conditional.count(), 6);
}

/// Every interval of `result.json` is computed again from `parameters.json` alone: covariance, gradient, quantile.
#[test]
fn intervals_follow_from_the_parameters() {
    let bench = Workbench::with_shipped_models();
    for (model, least) in [
        ("duffing", 6),
        ("accelerometer", 6),
        ("hammer-and-shaker", 5),
    ] {
        let path = format!("models/{model}.yaml");
        bench.run_to(0, &["fit", &path, "--out", "out", "--no-report"]);
        let read =
            |name: &str| -> Value { serde_json::from_str(&bench.read(name)).expect("a document") };
        let (result, parameters) = (read("out/result.json"), read("out/parameters.json"));
        let number = |value: &Value| value.as_f64().expect("a number");
        let list = |value: &Value| -> Vec<f64> {
            value
                .as_array()
                .expect("a list")
                .iter()
                .map(number)
                .collect()
        };
        let covariance = parameters["covariance"].as_array().expect("a matrix");
        let covariance: Vec<Vec<f64>> = covariance.iter().map(list).collect();
        let names = parameters["names"].as_array().expect("names");
        assert_eq!(names.len(), covariance.len());
        assert_eq!(list(&parameters["values"]).len(), covariance.len());
        let half = |name: &str| {
            let error = &parameters["estimates"][name];
            let gradient = list(&error["gradient"]);
            let rows = gradient.iter().zip(&covariance);
            let square: f64 = rows
                .map(|(a, row)| a * row.iter().zip(&gradient).map(|(c, b)| c * b).sum::<f64>())
                .sum();
            number(&error["quantile"]) * (square + number(&error["basis_error"]).powi(2)).sqrt()
        };
        let estimates = result["estimates"].as_object().expect("a map");
        let mut compared = 0;
        for (name, estimate) in estimates {
            let Some(interval) = estimate["ci95"].as_array() else {
                continue;
            };
            let [low, high] = [0, 1].map(|i| number(&interval[i]));
            let (found, stated) = (half(name), 0.5 * (high - low));
            // The difference of the ends has a rounding error of their size.
            let rounding = 1e-15 * low.abs().max(high.abs());
            assert!(
                (found - stated).abs() < 1e-9 * stated + rounding,
                "{model}: {name} {found} {stated}"
            );
            compared += 1;
        }
        for parameter in result["nuisance_parameters"]
            .as_array()
            .into_iter()
            .flatten()
        {
            let name = parameter["name"].as_str().expect("a name");
            let error = number(&parameter["standard_error"]);
            let stated = error * number(&parameters["estimates"][name]["quantile"]);
            assert!((half(name) / stated - 1.0).abs() < 1e-6, "{model}: {name}");
        }
        assert!(compared >= least, "{model}: {compared}");
    }
}
