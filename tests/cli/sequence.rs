//! The sequence of the README in one command: neither the paper's fit nor positivity alone recovers the true system; the
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
    let verdict = |run: &Value| run["verdict"].as_str().expect("text").to_owned();
    let [paper, positive, known @ .., noisy] = runs.as_slice() else {
        panic!("{names:?}");
    };

    // In the paper's fit, mass and damping have the wrong sign or size. With positivity alone the misfit is smaller and the errors are
    // as large.
    assert_eq!(paper["is_true_system"], false);
    assert_eq!(positive["is_true_system"], false);
    assert!(verdict(positive).starts_with("response fitted (J/J0 "));
    for run in [paper, positive] {
        assert!(verdict(run).contains("true system: error of k/m "), "{run}");
        assert!(number(run, "/errors/k_over_m_relative") > 0.1, "{run}");
    }
    assert!(number(positive, "/misfit") < 0.1 * number(paper, "/misfit"));
    assert!(number(positive, "/smallest_mass") >= 0.05);
    assert!(number(positive, "/smallest_damping") >= 0.0);

    // Smooth and normalised, few parameters, knots, splines: the true system and its predictions are recovered.
    // The samples are computed by the same stepper, and the truth has no roughness: only rounding errors remain.
    for run in known {
        assert_eq!(run["is_true_system"], true, "{run}");
        assert_eq!(run["status"], "converged", "{run}");
        assert!(verdict(run).starts_with("true system recovered: "));
        assert!(number(run, "/errors/mass") < 1e-6, "{run}");
        assert!(number(run, "/roughness/mass") < 1e-6 * number(positive, "/roughness/mass"));
        assert!(number(run, "/max_violation") <= 1e-9);
    }

    // Noise limits the accuracy only: 401 samples with a noise of 0.1 m in 3 m.
    assert!(number(noisy, "/errors/k_over_m_relative") < 0.05, "{noisy}");
    assert!(number(noisy, "/errors/mass") < 0.05, "{noisy}");
    assert_eq!(noisy["misfit_unit"], "1");
    assert!(verdict(noisy).contains("to the true system") || noisy["is_true_system"] == true);
    // The iterations along the path of weights are counted, although the last fit needs none.
    let result = bench.read("runs/compare/noisy/result.json");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    let path = result["weights"]["path"].as_array().expect("a path");
    let iterations = |point: &Value| number(point, "/iterations");
    let on_path: f64 = path.iter().map(iterations).sum();
    assert!(path.iter().filter(|point| iterations(point) > 0.0).count() > 1);
    let last = number(&result, "/counts/iterations");
    assert_eq!(number(noisy, "/iterations"), on_path + last);

    // From other initial states: the fit with the wrong parameters does not predict the response, the true system does.
    let elsewhere = |run: &Value| number(run, "/predictions/4/cost");
    assert!(elsewhere(paper) > 1.0 && elsewhere(positive) > 1.0);
    assert!(known.iter().all(|run| elsewhere(run) < 1e-9));
    assert!(elsewhere(noisy) < 1.0, "{}", elsewhere(noisy));
    assert_eq!(document["left_out"], Value::Array(Vec::new()));
}

/// The key `sequence` is found in every style of YAML.
#[test]
fn a_sequence_in_flow_style() {
    let bench = Workbench::with_shipped_models();
    for text in [
        "{format: 1, title: T, sequence: [nowhere.yaml]}\n",
        "{\"format\": 1, \"sequence\": [\"nowhere.yaml\"]}\n",
        "format: 1\n'sequence': [nowhere.yaml]\n",
        "format: 1\n? sequence\n: [nowhere.yaml]\n",
    ] {
        bench.write("models/flow.yaml", text);
        let (code, _, said) = bench.run(&["study", "models/flow.yaml"]);
        assert_eq!(code, 2, "{said}");
        let read = "models/nowhere.yaml: no such file";
        assert!(said.contains(read), "{text}: {said}");
    }
}
