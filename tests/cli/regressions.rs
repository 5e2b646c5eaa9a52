//! Regression tests, one for each mistake found in use.

use crate::workbench::{MODEL, Workbench, sample_table};

fn bench(from: &str, to: &str) -> Workbench {
    let bench = Workbench::empty();
    assert!(MODEL.contains(from), "{from}");
    bench.write("model.yaml", &MODEL.replace(from, to));
    bench.write("samples.csv", &sample_table(21));
    bench
}

fn status(bench: &Workbench, run: &str) -> String {
    let text = bench.read(&format!("{run}/result.json"));
    let result: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    result["outcome"]["status"]
        .as_str()
        .expect("a word")
        .to_owned()
}

#[test]
fn a_failed_prediction_does_not_end_the_fit() {
    let bench = bench(
        "fit:",
        "predict: [{displacement: 1e308, velocity: 1e308}, {displacement: 1, velocity: 0}]\nfit:",
    );
    let stdout = bench.run_to(0, &["fit", "model.yaml"]);
    assert!(
        stdout.contains("no response: the response overflows"),
        "{stdout}"
    );
    assert_eq!(status(&bench, "runs/model"), "completed");
}

#[test]
fn a_cost_that_overflows_is_an_outcome() {
    let bench = Workbench::with_small_model();
    let spoiled = sample_table(21).replacen("\n1,", "\n1,1e300\n#", 1);
    bench.write("samples.csv", &spoiled);
    let (code, _, stderr) = bench.run(&["fit", "model.yaml"]);
    assert_eq!(code, 3, "{stderr}");
    assert!(
        stderr.contains("the cost overflows") && stderr.contains("t = 1 s"),
        "{stderr}"
    );
}

#[test]
fn without_iterations_or_tests_the_default_tolerance_holds() {
    let bench = bench("stop: {iterations: 5}", "stop: {}");
    let (_, stdout, _) = bench.run(&["fit", "model.yaml"]);
    assert!(!stdout.contains("asked for"), "{stdout}");
}

#[test]
fn a_start_that_fits_exactly_is_converged() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["simulate", "model.yaml", "--out", "exact.csv"]);
    bench.write("exact.yaml", &MODEL.replace("samples.csv", "exact.csv"));
    bench.run_to(0, &["fit", "exact.yaml"]);
    assert_eq!(status(&bench, "runs/exact"), "converged");
}

#[test]
fn experiments_have_names_of_their_own_and_columns_two() {
    let bench = bench("displacement: y_m", "displacement: t_s");
    let (code, _, stderr) = bench.run(&["fit", "model.yaml"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("the same column"), "{stderr}");
}

/// More than 10^5 parameters, the number in the paper.
#[test]
fn forty_thousand_nodes_run_the_same_commands() {
    let bench = Workbench::with_shipped_models();
    let nodes = "40000";
    bench.run_to(
        0,
        &[
            "simulate",
            "models/paper-device.yaml",
            "--nodes",
            nodes,
            "--out",
            "data/large.csv",
        ],
    );
    let model = bench.read("models/paper-lbfgs.yaml");
    let model = model
        .replace("paper.csv", "large.csv")
        .replace("nodes: 2000", "nodes: 40000")
        .replace("{iterations: 1000, cost_ratio: 1.0e-6}", "{iterations: 5}");
    bench.write("models/large.yaml", &model);
    bench.run_to(0, &["fit", "models/large.yaml"]);
    assert_eq!(status(&bench, "runs/large"), "completed");
    let stdout = bench.run_to(0, &["check", "models/large.yaml"]);
    assert!(stdout.contains("120000 parameters"), "{stdout}");
    let stdout = bench.run_to(0, &["predict", "runs/large", "--initial", "-3.3,1"]);
    assert!(stdout.contains("-3.3"), "{stdout}");
}
