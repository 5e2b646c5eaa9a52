//! Models of the paper's record compared: neither the paper's fit nor positivity alone recovers the true system; the
//! assumptions of the later models do.

use crate::workbench::Workbench;
use serde_json::Value;

const MODELS: [&str; 7] = [
    "paper",
    "paper-positive",
    "paper-smooth",
    "linear-mass",
    "knots",
    "spline",
    "noisy",
];

/// The shipped models on 401 nodes, with samples made on as many, and a fifth of the paper's
/// iterations.
fn bench() -> Workbench {
    let bench = Workbench::with_shipped_models();
    let simulate = ["simulate", "models/paper-device.yaml", "--nodes", "401"];
    let noise = ["--noise", "0.1", "--seed", "1", "--out", "data/noisy.csv"];
    for name in ["data/paper.csv", "data/noisy.csv"] {
        std::fs::remove_file(bench.path(name)).expect("a file can be removed");
    }
    bench.run_to(0, &[&simulate[..], &["--out", "data/paper.csv"]].concat());
    bench.run_to(0, &[&simulate[..], &noise].concat());
    for name in MODELS {
        let file = format!("models/{name}.yaml");
        let model = bench.read(&file);
        assert!(model.contains("nodes: 2000"), "{name}");
        let model = model
            .replace("nodes: 2000", "nodes: 401")
            .replace("iterations: 1000", "iterations: 200");
        bench.write(&file, &model);
    }
    bench
}

#[test]
fn a_sequence_states_which_assumptions_recover_the_system() {
    let bench = bench();
    let files = MODELS.map(|name| format!("models/{name}.yaml"));
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let stdout = bench.run_to(0, &[&["compare"], &files[..], &["--json"]].concat());
    let document: Value = serde_json::from_str(&stdout).expect("JSON");
    let runs = document["runs"].as_array().expect("runs");
    let names: Vec<&str> = runs.iter().filter_map(|run| run["name"].as_str()).collect();
    assert_eq!(names, MODELS);
    let number = |run: &Value, pointer: &str| -> f64 {
        let value = run.pointer(pointer).and_then(Value::as_f64);
        value.unwrap_or_else(|| panic!("{pointer} of {run}"))
    };
    let [paper, positive, known @ .., noisy] = runs.as_slice() else {
        panic!("{names:?}");
    };

    // With positivity alone the misfit is smaller than the paper's and the errors are as large.
    for run in [paper, positive] {
        assert!(number(run, "/errors/k_over_m_relative") > 0.1, "{run}");
    }
    assert!(number(positive, "/misfit") < 0.1 * number(paper, "/misfit"));
    // Smooth and normalised, few parameters, knots, splines: the true system is recovered. The samples are computed by the same
    // stepper, and the truth has no roughness: only rounding errors remain.
    for run in known {
        assert_eq!(run["status"], "converged", "{run}");
        assert!(number(run, "/errors/k_over_m_relative") < 1e-6, "{run}");
        assert!(number(run, "/errors/mass") < 1e-6, "{run}");
    }
    // Noise limits the accuracy only: 401 samples with a noise of 0.1 m in 3 m.
    assert!(number(noisy, "/errors/k_over_m_relative") < 0.05, "{noisy}");
    assert!(number(noisy, "/errors/mass") < 0.05, "{noisy}");
    assert_eq!(document["left_out"], Value::Array(Vec::new()));
    // From other initial states: the fit with the wrong parameters does not predict the response, the true system does.
    let elsewhere = |name: &str| {
        let result = bench.read(&format!("runs/compare/{name}/result.json"));
        let result: Value = serde_json::from_str(&result).expect("JSON");
        number(&result, "/predictions/4/cost")
    };
    assert!(MODELS[..2].iter().all(|name| elsewhere(name) > 1.0));
    assert!(
        MODELS[2..MODELS.len() - 1]
            .iter()
            .all(|name| elsewhere(name) < 1e-9)
    );
}
