//! The shipped models, and the files of a run.

use crate::workbench::{MODEL, Workbench, column, paper_run, repository, table};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

fn result(bench: &Workbench, run: &str) -> Value {
    serde_json::from_str(&bench.read(&format!("{run}/result.json"))).expect("JSON")
}

/// Fits a shipped model and checks the amount of work: folder and result.
fn fitted(name: &str, code: i32) -> (Workbench, Value) {
    let bench = Workbench::with_shipped_models();
    let mut command = bench.command(&["fit", &format!("models/{name}.yaml")]);
    // The work does not depend on the arithmetic (tests/cli/arithmetic.rs); every processor has this one.
    let output = command.env("KMCFIT_ARITHMETIC", "scalar").output();
    let output = output.expect("the program runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{name}: {said}");
    let result = result(&bench, &format!("runs/{name}"));
    assert_eq!(result["timings"]["arithmetic"], "scalar");
    takes_as_much_work_as_ever(name, &result);
    (bench, result)
}

/// The work of a shipped model is pinned, which detects a loss of efficiency without a clock; a gain is pinned as well. The last
/// bit of the system's sine depends on the processor, which shifts the end of a search by an iteration: the tolerance is two
/// iterations and 5 %.
fn takes_as_much_work_as_ever(name: &str, result: &Value) {
    let pinned = repository(&format!("tests/cli/work/{name}.txt"));
    let pinned =
        fs::read_to_string(&pinned).unwrap_or_else(|e| panic!("{}: {e}", pinned.display()));
    let keys = ["iterations", "forward", "adjoint", "tangent", "qp"];
    let mut lines = pinned.lines();
    for key in keys {
        let line = lines.next().unwrap_or_default();
        let count = line.strip_prefix(&format!("{key}: "));
        let count: u64 = count.and_then(|n| n.parse().ok()).expect("a pinned count");
        let found = result["counts"][key].as_u64().expect("a count");
        let band = if count == 0 { 0 } else { 2 + count / 20 };
        assert!(
            found.abs_diff(count) <= band,
            "{name}: {key} {found}, pinned {count} within {band}"
        );
    }
    // Timed work and counted work agree.
    for key in &keys[1..] {
        let (timed, counted) = (&result["timings"][key], &result["counts"][key]);
        assert_eq!(&timed["count"], counted, "{name}: {key}");
        let seconds = timed["seconds"].as_f64().expect("a number");
        assert_eq!(seconds > 0.0, *counted != 0, "{name}: {key} {timed}");
    }
    // Time that is counted twice would leave a negative remainder.
    let other = &result["timings"]["other"]["seconds"];
    assert!(other.as_f64().expect("a number") > 0.0, "{name}: {result}");
}

#[test]
fn every_shipped_model_is_run_here() {
    let files = fs::read_dir(repository("models")).expect("a folder can be listed");
    let found: BTreeSet<String> = files
        .map(|file| {
            file.expect("an entry")
                .file_name()
                .into_string()
                .expect("a name")
        })
        .collect();
    let run_here = [
        "paper.yaml",
        "paper-ones.yaml",
        "paper-device.yaml",
        "paper-lbfgs.yaml",
        "paper-positive.yaml",
        "paper-smooth.yaml",
        "linear-mass.yaml",
        "knots.yaml",
        "spline.yaml",
        "noisy.yaml",
        "paper-experiments.yaml",
        "paper-two-records.yaml",
        "paper-forced.yaml",
        "accelerometer.yaml",
        "hammer-and-shaker.yaml",
        "duffing.yaml",
        "friction.yaml",
        "roll-decay.yaml",
        "footbridge.yaml",
        "moving-support.yaml",
        "shaking-table.yaml",
        "camera.yaml",
    ];
    assert_eq!(found, run_here.map(str::to_owned).into());
    // All except models for simulation.
    let without_fit = ["paper-device.yaml", "paper-experiments.yaml"];
    for file in run_here.iter().filter(|file| !without_fit.contains(file)) {
        let name = file.strip_suffix(".yaml").expect("YAML");
        let pinned = format!("tests/cli/work/{name}.txt");
        assert!(repository(&pinned).exists(), "{pinned}");
    }
}

/// Largest error of a function against the truth.
fn error(result: &Value, function: &str) -> f64 {
    result["functions"][function]["truth_max_error"]
        .as_f64()
        .expect("a number")
}

/// Models that recover the true system, and the largest error of each function.
#[test]
fn models_that_recover_the_system() {
    let expected = [
        ("linear-mass", 1e-10, 1e-10),
        ("knots", 1e-6, 1e-6),
        ("paper-smooth", 1e-4, 1e-4),
        ("spline", 1e-6, 1e-6),
    ];
    for (name, mass, others) in expected {
        let (bench, result) = fitted(name, 0);
        assert_eq!(result["outcome"]["status"], "converged", "{name}");
        assert!(error(&result, "mass") <= mass, "{name}: {result}");
        assert!(error(&result, "damping") <= others, "{name}: {result}");
        assert!(error(&result, "stiffness") <= others, "{name}: {result}");
        let violation = result["constraints"]["max_violation"]
            .as_f64()
            .expect("a number");
        assert!(violation <= 1e-9, "{name}: {result}");
        left_behind(&bench, &format!("runs/{name}"));
    }
}

#[test]
fn paper_positive() {
    let (_, result) = fitted("paper-positive", 0);
    assert!(result["cost"]["ratio"].as_f64().expect("a number") <= 1e-6);
    let least = |f: &str| result["functions"][f]["min"].as_f64().expect("a number");
    assert!(least("mass") >= 0.05 && least("damping") >= 0.0 && least("stiffness") >= 0.05);
    // An exact fit of a different parameter set.
    assert!(error(&result, "mass") > 0.1 && error(&result, "damping") > 0.1);
}

#[test]
fn noisy() {
    let (bench, result) = fitted("noisy", 0);
    assert!(error(&result, "mass") <= 0.05, "{result}");
    let weights = &result["weights"];
    assert_eq!(weights["rule"], "discrepancy");
    assert_eq!(weights["weight"], weights["picks"]["discrepancy"]);
    assert!(weights["path"].as_array().expect("a list").len() >= 9);
    assert!(
        bench
            .read("runs/noisy/figures/weights.svg")
            .starts_with("<svg")
    );
}

#[test]
fn paper() {
    let (bench, stdout) = paper_run();
    let result = result(bench, "runs/paper");
    takes_as_much_work_as_ever("paper", &result);
    assert_eq!(result["outcome"]["status"], "completed");
    assert_eq!(result["counts"]["iterations"], 1000);
    assert_eq!(result["counts"]["forward"], 50_001);
    assert!(stdout.starts_with(
        "The paper's run, start (2, 1, 1): 2000 samples, 25 s\nCheck      at most 1999 of 6000 parameter combinations"
    ));
    assert!(stdout.contains("at most 1999 of 6000 parameter combinations are identifiable"));
    let ratio = result["cost"]["ratio"].as_f64().expect("a number");
    assert!((ratio / 8.130_155_3e-5 - 1.0).abs() < 1e-7, "{ratio}");
    left_behind(bench, "runs/paper");
}

#[test]
fn paper_ones() {
    let (bench, result) = fitted("paper-ones", 0);
    assert_eq!(result["outcome"]["status"], "completed");
    assert_eq!(result["counts"]["iterations"], 1000);
    left_behind(&bench, "runs/paper-ones");
}

#[test]
fn paper_lbfgs() {
    let (bench, result) = fitted("paper-lbfgs", 0);
    assert_eq!(result["outcome"]["status"], "converged");
    assert!(result["cost"]["ratio"].as_f64().expect("a number") <= 1e-6);
    left_behind(&bench, "runs/paper-lbfgs");
}

/// The model without samples, which generates them.
#[test]
fn paper_device() {
    let bench = Workbench::with_shipped_models();
    let stdout = bench.run_to(
        0,
        &["simulate", "models/paper-device.yaml", "--nodes", "100"],
    );
    let (names, rows) = table(&stdout);
    assert_eq!(names, ["t_s", "y_m"]);
    assert_eq!(rows.len(), 100);
}

/// The files of a run, their columns and keys.
fn left_behind(bench: &Workbench, run: &str) {
    let result = result(bench, run);
    stable_keys(&result);
    let read = |name: &str| bench.read(&format!("{run}/{name}"));
    let nodes = result["model"]["nodes"].as_u64().expect("a count") as usize;

    let history = read("history.csv");
    let first = "attempt,iteration,cost,cost_ratio,gradient_norm_squared_ratio,step";
    assert!(history.starts_with(first), "{history}");
    let numbers: Vec<f64> = (1..=result["counts"]["iterations"].as_u64().expect("a count"))
        .map(|i| i as f64)
        .collect();
    assert_eq!(column(&history, "iteration"), numbers);
    let costs = column(&history, "cost");
    assert!(costs.windows(2).all(|pair| pair[1] < pair[0]));
    assert_eq!(costs.last().copied(), result["cost"]["final"].as_f64());

    let (names, rows) = table(&read("functions.csv"));
    let expected = "t_s,mass_kg,damping_N_s_per_m,stiffness_N_per_m,k_over_m_per_s2,\
                    c_over_m_per_s,natural_frequency_Hz,damping_ratio,\
                    true_mass_kg,true_damping_N_s_per_m,true_stiffness_N_per_m";
    // With few parameters: lower and upper end of the band of each function and ratio.
    let is_band = |name: &&String| name.ends_with("_lo95") || name.ends_with("_hi95");
    let bands = names.iter().filter(is_band).count();
    let few = result["model"]["parameters"]
        .as_u64()
        .is_some_and(|n| n <= 64);
    assert_eq!(bands, if few { 14 } else { 0 }, "{names:?}");
    let others: Vec<&str> = (names.iter().filter(|name| !is_band(name)))
        .map(String::as_str)
        .collect();
    assert_eq!(others.join(","), expected);
    assert_eq!(rows.len(), nodes);

    let (names, rows) = table(&read("trajectory.csv"));
    assert_eq!(names, ["t_s", "y_m", "v_m_per_s", "observed_y_m"]);
    assert_eq!(rows.len(), nodes);

    for figure in ["convergence", "functions", "motion", "ratios"] {
        let svg = read(&format!("figures/{figure}.svg"));
        let document = roxmltree::Document::parse(&svg).expect("XML");
        assert!(
            document
                .root_element()
                .has_tag_name(("http://www.w3.org/2000/svg", "svg"))
        );
    }
}

fn stable_keys(result: &Value) {
    let keys = [
        "/format",
        "/title",
        "/version",
        "/outcome/status",
        "/outcome/reason",
        "/cost/initial",
        "/cost/final",
        "/cost/ratio",
        "/cost/misfit",
        "/cost/regularisation",
        "/counts/iterations",
        "/counts/forward",
        "/counts/adjoint",
        "/counts/tangent",
        "/counts/qp",
        "/seconds",
        "/timings/arithmetic",
        "/timings/forward/seconds",
        "/timings/forward/count",
        "/timings/adjoint/count",
        "/timings/tangent/count",
        "/timings/qp/count",
        "/timings/linear_algebra/seconds",
        "/timings/start/seconds",
        "/timings/io/seconds",
        "/timings/analysis/seconds",
        "/timings/report/seconds",
        "/timings/other/seconds",
        "/timings/total/seconds",
        "/functions/mass/min",
        "/functions/mass/max",
        "/functions/mass/truth_max_error",
        "/functions/mass/truth_rms_error",
        "/functions/damping/min",
        "/functions/stiffness/min",
    ];
    for key in keys {
        assert!(result.pointer(key).is_some_and(|v| !v.is_null()), "{key}");
    }
    assert_eq!(result["format"], 1);
}

#[test]
fn two_runs_are_identical_but_for_their_times() {
    let run = || {
        let (bench, mut result) = fitted("paper-lbfgs", 0);
        result["seconds"] = Value::Null;
        result["timings"] = Value::Null;
        let mut files = bench.contents();
        files.insert("runs/paper-lbfgs/result.json".into(), result.to_string());
        files
    };
    assert_eq!(run(), run());
}

/// A second run replaces the results of the first; without a report there are no figures.
#[test]
fn options() {
    let bench = Workbench::with_small_model();
    let stdout = bench.run_to(
        0,
        &["fit", "model.yaml", "--out", "run", "--json", "--no-report"],
    );
    assert_eq!(stdout, bench.read("run/result.json"));
    assert!(!bench.path("run/figures").exists());
    bench.write(
        "model.yaml",
        &MODEL.replace("iterations: 5", "iterations: 3"),
    );
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    assert_eq!(result(&bench, "run")["counts"]["iterations"], 3);
    assert!(bench.path("run/figures/motion.svg").exists());
}

/// A closed pipe at standard output is not an error; progress is shown on terminals only.
#[test]
fn nothing_but_results_when_piped() {
    let bench = Workbench::with_small_model();
    let (_, _, stderr) = bench.run(&["fit", "model.yaml"]);
    assert_eq!(stderr, "");
    assert!(bench.path("runs/model/result.json").exists());
}

/// The models of records like measurements: every constant is found within this many of its own
/// standard errors, none of which is large.
const STANDARD_ERRORS: f64 = 3.5;

#[test]
fn models_of_measurements() {
    let expected: [(&str, &[(&str, f64)]); 6] = [
        ("accelerometer", &[("damping", 1.2)]),
        (
            "hammer-and-shaker",
            &[("mass", 1.2), ("damping", 0.9), ("stiffness", 480.0)],
        ),
        (
            "duffing",
            &[
                ("mass", 1.0),
                ("damping", 0.4),
                ("stiffness", 10.0),
                ("cubic_stiffness", 30.0),
            ],
        ),
        (
            "friction",
            &[
                ("mass", 1.0),
                ("damping", 0.3),
                ("stiffness", 40.0),
                ("coulomb_friction", 2.0),
            ],
        ),
        (
            "roll-decay",
            &[
                ("mass", 20.0),
                ("damping", 0.4),
                ("quadratic_damping", 3.0),
                ("cubic_stiffness", 60.0),
            ],
        ),
        ("shaking-table", &[("damping", 0.8), ("stiffness", 300.0)]),
    ];
    for (name, constants) in expected {
        let (_, result) = fitted(name, 0);
        assert_eq!(result["outcome"]["status"], "converged", "{name}");
        for (function, truth) in constants {
            let found = &result["functions"][function];
            let number = |key: &str| found[key].as_f64().expect("a number");
            let (value, error) = (number("min"), number("standard_error"));
            assert!(error < 0.05 * truth, "{name} {function}: +- {error}");
            let off = (value - truth).abs() / error;
            assert!(
                off < STANDARD_ERRORS,
                "{name} {function}: {value} +- {error}"
            );
        }
        for experiment in result["experiments"].as_array().expect("experiments") {
            for channel in experiment["channels"].as_array().expect("channels") {
                let p = channel["whiteness_p_value"].as_f64().expect("a number");
                assert!(p > 0.01, "{name}: {channel}");
            }
        }
    }
}

/// A softening spring, an offset and the noise from an instrument's file.
#[test]
fn accelerometer() {
    let (_, result) = fitted("accelerometer", 0);
    let stiffness = &result["functions"]["stiffness"];
    let ends = [("min", 2700.0), ("max", 3000.0)];
    for (key, truth) in ends {
        let found = stiffness[key].as_f64().expect("a number");
        assert!((found - truth).abs() < 1e-3 * truth, "{found}");
    }
    let channel = &result["experiments"][0]["channels"][0];
    assert_eq!(channel["unit"], "g");
    assert_eq!(channel["ignored"][0]["samples"], 3);
    // The standard deviation of 1198 samples has a standard error of 2 %; the limit is three of them.
    let sigma = channel["sigma"].as_f64().expect("a number");
    assert!((sigma - 0.01).abs() < 6e-4, "{sigma}");
    let offset = scalar(&result, "offset of the acceleration of ring-down");
    assert!((offset - 0.05 * 9.80665).abs() < 0.01, "{offset}");
}

fn scalar(result: &Value, name: &str) -> f64 {
    let mut scalars = result["nuisance_parameters"]
        .as_array()
        .expect("nuisance_parameters")
        .iter();
    let found = scalars.find(|s| s["name"] == name).expect(name);
    found["value"].as_f64().expect("a number")
}

#[test]
fn a_validation_record_is_predicted_within_its_noise() {
    let (bench, result) = fitted("hammer-and-shaker", 0);
    let held = &result["validation"][0];
    assert_eq!(held["name"], "hammer 3");
    let rms = held["channels"][0]["rms_residual"]
        .as_f64()
        .expect("a number");
    // The noise is 0.02 mm; the standard error from 301 samples is 4 %.
    assert!((rms - 0.02).abs() < 0.0025, "{rms}");
    let folder = "runs/hammer-and-shaker";
    let table = bench.read(&format!("{folder}/channels/validation-1-displacement.csv"));
    let residuals = column(&table, "residual");
    let mean = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
    assert!((mean.sqrt() - rms).abs() < 1e-9 * rms, "{rms}");
    let page = bench.read(&format!("{folder}/report.html"));
    assert!(page.contains("Samples and model: hammer 3 (validation), displacement"));
    let experiments = result["experiments"].as_array().expect("experiments");
    assert_eq!(experiments.len(), 3);
}

/// Outliers have little influence on the estimates, and sigma is that of the other samples.
#[test]
fn camera() {
    let (_, result) = fitted("camera", 0);
    let constants = [("damping", 0.2, 0.01), ("stiffness", 25.0, 0.001)];
    for (function, truth, share) in constants {
        let found = result["functions"][function]["min"]
            .as_f64()
            .expect("a number");
        assert!((found - truth).abs() < share * truth, "{function}: {found}");
    }
    let sigma = result["experiments"][0]["channels"][0]["sigma"].as_f64();
    assert!((sigma.expect("a number") - 0.002).abs() < 3e-4, "{sigma:?}");
    let drift = scalar(&result, "drift of the displacement of photographs");
    assert!((drift - 0.002).abs() < 2e-4, "{drift}");
}

/// The first of twelve tests; its frequency at -3 degrees and damping ratio are those of `data/README.md`, within four standard errors.
#[test]
fn footbridge() {
    let (_, result) = fitted("footbridge", 0);
    let frequency = 2.05 * (1.0f64 + 0.0016 * 13.0).sqrt();
    for (name, truth) in [("natural_frequency", frequency), ("damping_ratio", 0.006)] {
        let estimate = &result["estimates"][name];
        let value = estimate["value"].as_f64().expect("a number");
        let end = |i: usize| estimate["ci95"][i].as_f64().expect("a limit");
        let standard_error = (end(1) - end(0)) / (2.0 * 1.96);
        assert!(
            (value - truth).abs() < 4.0 * standard_error,
            "{name}: {estimate}"
        );
    }
}

/// The equation error: one convex problem without active inequalities, and no simulation.
#[test]
fn moving_support() {
    let (_, result) = fitted("moving-support", 0);
    assert_eq!(result["outcome"]["status"], "converged");
    assert_eq!(result["model"]["cost_kind"], "equation-error");
    // The force is not measured.
    let damping = &result["estimates"]["damping"];
    assert_eq!(damping["status"], "not_identifiable", "{damping}");
    assert!(damping["value"].is_null(), "{damping}");
    let reasons = result["verdict"]["reasons"].as_array().expect("a list");
    assert!(reasons.iter().any(|r| r["kind"] == "unmeasured_force"));
}

/// Two free records give the ratios and leave the scale; a force gives the scale as well.
#[test]
fn two_records_and_a_force() {
    let largest = |bench: &Workbench, run: &str, of: &str, truth: &dyn Fn(&[f64]) -> f64| {
        let text = bench.read(&format!("runs/{run}/functions.csv"));
        let columns = ["true_mass_kg", "true_stiffness_N_per_m"].map(|c| column(&text, c));
        let found = column(&text, of);
        let off = (0..found.len()).map(|i| {
            let true_value = truth(&[columns[0][i], columns[1][i]]);
            (found[i] / true_value - 1.0).abs()
        });
        off.fold(0.0, f64::max)
    };
    let ratio = |t: &[f64]| t[1] / t[0];
    let (bench, _) = fitted("paper-two-records", 0);
    let off = largest(&bench, "paper-two-records", "k_over_m_per_s2", &ratio);
    assert!(off < 5e-3, "{off}");
    // The penalty lowers an undetermined scale down to the bounds.
    let off = largest(&bench, "paper-two-records", "mass_kg", &|t| t[0]);
    assert!(off > 0.5, "{off}");
    let (bench, _) = fitted("paper-forced", 0);
    let off = largest(&bench, "paper-forced", "mass_kg", &|t| t[0]);
    assert!(off < 5e-3, "{off}");
}
