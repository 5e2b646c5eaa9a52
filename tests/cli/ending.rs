//! Ends of runs: exit codes, statuses and results.

use crate::workbench::{MODEL, Workbench, column};
use serde_json::Value;
use std::time::{Duration, Instant};

/// The paper's problem with other stopping tests.
fn paper_until(stop: &str) -> Workbench {
    let bench = Workbench::with_shipped_models();
    let model = bench.read("models/paper.yaml");
    assert!(model.contains("{iterations: 1000}"));
    bench.write(
        "models/paper.yaml",
        &model.replace("{iterations: 1000}", stop),
    );
    bench
}

/// A complete run: every iteration has its row, and the last cost is that of the result.
fn status(bench: &Workbench, run: &str) -> String {
    let text = bench.read(&format!("{run}/result.json"));
    let result: Value = serde_json::from_str(&text).expect("JSON");
    let costs = column(&bench.read(&format!("{run}/history.csv")), "cost");
    assert_eq!(
        Some(costs.len() as u64),
        result["counts"]["iterations"].as_u64()
    );
    if let Some(cost) = costs.last() {
        assert_eq!(Some(*cost), result["cost"]["final"].as_f64());
    }
    assert!(bench.path(&format!("{run}/figures/motion.svg")).exists());
    result["outcome"]["status"]
        .as_str()
        .expect("a word")
        .to_owned()
}

#[test]
fn the_papers_rule() {
    let bench = paper_until("{iterations: 30, cost_ratio: 0.5, gradient_ratio: 0.5}");
    bench.run_to(0, &["fit", "models/paper.yaml"]);
    assert_eq!(status(&bench, "runs/paper"), "converged");
}

#[test]
fn too_few_iterations() {
    let bench = paper_until("{iterations: 3, cost_ratio: 1e-4}");
    bench.run_to(3, &["fit", "models/paper.yaml"]);
    assert_eq!(status(&bench, "runs/paper"), "max-iterations");
}

#[test]
fn time_limit() {
    let bench = paper_until("{iterations: 100000000, seconds: 0.3}");
    let begin = Instant::now();
    let stdout = bench.run_to(3, &["fit", "models/paper.yaml"]);
    assert!(begin.elapsed() < Duration::from_secs(30));
    assert!(
        stdout.contains("time-limit: reached the limit of 0.3 s"),
        "{stdout}"
    );
    assert_eq!(status(&bench, "runs/paper"), "time-limit");
}

/// Ctrl-C ends a run with the results of the best point, which is not assessed.
#[test]
#[cfg(unix)]
fn interrupt() {
    let bench = paper_until("{iterations: 100000000}");
    let output = bench.interrupt(&["fit", "models/paper.yaml"], "model.yaml");
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(stdout.contains("interrupted: "), "{stdout}");
    assert!(
        stdout.contains("stopped; not done: step-size check"),
        "{stdout}"
    );
    assert_eq!(status(&bench, "runs/paper"), "interrupted");
}

/// A response that overflows is not invalid input, but there is no result to write.
#[test]
fn a_start_without_motion() {
    let bench = Workbench::with_small_model();
    let model = MODEL.replace("start: 2.0", "start: 1e-200");
    bench.write("model.yaml", &model);
    let (code, stdout, stderr) = bench.run(&["fit", "model.yaml", "--out", "run"]);
    assert_eq!((code, stdout.as_str()), (3, ""));
    assert!(
        stderr.starts_with("failed: the start cannot be evaluated: "),
        "{stderr}"
    );
}

/// Constraints under which no response can be simulated: the result is the start as given.
fn infeasible(constraint: &str) -> (String, Value) {
    let bench = Workbench::with_small_model();
    let model = MODEL
        .replace("method: lbfgs", "method: gauss-newton")
        .replace("start: 2.0", "start: 2.0, min: none")
        .replace("fit:", &format!("constraints: [{constraint}]\nfit:"));
    bench.write("model.yaml", &model);
    let stdout = bench.run_to(3, &["fit", "model.yaml", "--out", "run"]);
    assert_eq!(status(&bench, "run"), "infeasible");
    let result: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
    let number = |pointer: &str| result.pointer(pointer).and_then(Value::as_f64);
    assert_eq!(number("/functions/mass/min"), Some(2.0));
    assert_eq!(number("/cost/final"), number("/cost/initial"));
    assert!(number("/constraints/max_violation").is_some_and(|v| v > 0.1));
    let finite = |column: Vec<f64>| column.iter().all(|x| x.is_finite());
    assert!(finite(column(&bench.read("run/functions.csv"), "mass_kg")));
    assert!(finite(column(&bench.read("run/trajectory.csv"), "y_m")));
    // The folder is that of a finished run.
    bench.run_to(0, &["predict", "run", "--initial", "1,0"]);
    (stdout, result)
}

#[test]
fn a_mass_that_must_pass_zero() {
    // Either constraint permits a positive mass; together they make it negative within 0.01 s.
    let (stdout, result) =
        infeasible("{function: mass, max: 1.0}, {function: mass, slope: {max: -100.0}}");
    let reason = result["outcome"]["reason"].as_str().expect("text");
    assert!(reason.contains("the mass is -"), "{reason}");
    // No constraint is reported as active at a point that violates them.
    assert_eq!(result["constraints"]["active"], serde_json::json!([]));
    assert!(stdout.contains(
        "infeasible: the simulation fails at all starting points within the constraints"
    ));
}

#[test]
fn a_damping_that_must_overflow() {
    let (_, result) = infeasible("{function: damping, at: 0.0, value: -1e20}");
    let reason = result["outcome"]["reason"].as_str().expect("text");
    assert!(reason.contains("the response overflows"), "{reason}");
}

/// A failed run is reported as failed; a run with an empty history is valid.
#[test]
fn failed_and_empty_runs_are_read_back() {
    let bench = Workbench::with_small_model();
    let failing = MODEL.replace("start: 2.0", "start: 1e-200");
    bench.write("failing.yaml", &failing);
    bench.run(&["fit", "failing.yaml", "--out", "failed"]);
    for command in [
        &["compare", "failed"][..],
        &["predict", "failed", "--initial", "1,0"],
    ] {
        let (code, _, stderr) = bench.run(command);
        assert_eq!(code, 2, "{stderr}");
        insta::allow_duplicates! {
            insta::assert_snapshot!(stderr, @"
            error: failed/result.json: this run failed and has no estimates
              found: the start cannot be evaluated: the response overflows at t = 0.1 s
              expected: the result of a run with estimates
            ");
        }
    }
    let still = MODEL.replace("iterations: 5", "iterations: 0");
    bench.write("still.yaml", &still);
    bench.run_to(0, &["fit", "still.yaml", "--out", "still"]);
    assert_eq!(bench.read("still/history.csv").lines().count(), 1);
    let stdout = bench.run_to(0, &["compare", "still", "still"]);
    assert!(stdout.contains("still-2"), "{stdout}");
    // A number that JSON cannot hold.
    let result = bench.read("still/result.json");
    let mut result: Value = serde_json::from_str(&result).expect("JSON");
    result["cost"]["ratio"] = Value::Null;
    result["gradient"]["initial_norm_squared"] = Value::Null;
    bench.write("still/result.json", &result.to_string());
    bench.run_to(0, &["compare", "still"]);
    bench.run_to(0, &["predict", "still", "--initial", "1,0"]);
}
