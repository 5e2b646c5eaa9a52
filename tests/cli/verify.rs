//! `kmcfit verify`: stored results against their recomputation.

use crate::workbench::{Workbench, sample_table};
use insta::assert_snapshot;
use kmcfit_core::internals::threads::{available, map};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fs;

/// Models of different kinds: an estimated sigma, autoregressive noise, constants that fit exactly, the equation error, two records.
const RUNS: [&str; 6] = [
    "duffing",
    "roll-decay",
    "linear-mass",
    "moving-support",
    "camera",
    "hammer-and-shaker",
];

fn fitted(names: &[&str]) -> Workbench {
    let bench = Workbench::with_shipped_models();
    for name in names {
        let model = format!("models/{name}.yaml");
        bench.run_to(0, &["fit", &model, "--no-report"]);
    }
    bench
}

#[test]
fn a_run_holds() {
    let bench = fitted(&["duffing"]);
    let said = bench.run_to(0, &["verify", "runs/duffing"]);
    let (checks, sum) = said.trim_end().rsplit_once('\n').expect("lines");
    assert_eq!(sum, "all 7 hold");
    let names = checks.lines().map(|line| {
        assert!(
            line.contains("recomputed") && line.contains("  holds ("),
            "{line}"
        );
        line.split("  ").next().expect("a name")
    });
    let expected = [
        "cost",
        "KKT residual",
        "covariance",
        "noise",
        "result.json",
        "parameters.json",
        "tables",
    ];
    assert_eq!(names.collect::<Vec<_>>(), expected);
    let json = bench.run_to(0, &["verify", "runs/duffing", "--json"]);
    let found: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(found["holds"], true);
    assert_eq!(found["differences"], Value::Array(Vec::new()));
}

/// Every shipped model that can be fitted holds.
#[test]
fn shipped_runs_hold() {
    let bench = Workbench::with_shipped_models();
    let entries = fs::read_dir(bench.path("models")).expect("a folder");
    let paths: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    let fitted = map(paths.len(), available(), |i| {
        let name = paths[i].file_stem().expect("a name").to_string_lossy();
        let model = format!("models/{name}.yaml");
        // A system to simulate and the models of a study have nothing to fit.
        let is_fitted = bench.run(&["fit", &model, "--no-report"]).0 != 2;
        if is_fitted {
            bench.run_to(0, &["verify", &format!("runs/{name}")]);
        }
        is_fitted
    });
    assert_eq!(fitted.iter().filter(|fitted| **fitted).count(), 20);
}

/// Seeded edits by 1e-6 of a number that is not zero, each found.
#[test]
fn edits_are_found() {
    every_edit_is_found(1, 20);
}

#[test]
#[ignore = "a minute; .ci/long edits"]
fn many_edits_are_found() {
    every_edit_is_found(2, 1000);
    println!("| seeded edits by 1e-6 | found |\n|---|---|\n| 1000 | 1000 |");
}

fn every_edit_is_found(seed: u64, edits: usize) {
    let bench = fitted(&RUNS);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for edit in 0..edits {
        let run = format!("runs/{}", RUNS[edit % RUNS.len()]);
        let mut files = vec![
            "result.json".to_owned(),
            "result.json".to_owned(),
            "parameters.json".to_owned(),
            "functions.csv".to_owned(),
            "trajectory.csv".to_owned(),
        ];
        for entry in fs::read_dir(bench.path(&run).join("channels")).expect("channels") {
            let name = entry.expect("an entry").file_name();
            files.push(format!("channels/{}", name.to_string_lossy()));
        }
        let file = format!("{run}/{}", files.choose(&mut random).expect("a file"));
        let before = bench.read(&file);
        let (after, place) = match file.ends_with(".json") {
            true => edited_json(&before, &mut random),
            false => edited_table(&before, &mut random),
        };
        bench.write(&file, &after);
        let (code, stdout, stderr) = bench.run(&["verify", &run]);
        // An edited number of parameters is refused as damage.
        let is_found = match code {
            3 => stdout.contains("DOES NOT HOLD"),
            _ => code == 2 && stderr.contains("the parameters are damaged"),
        };
        assert!(
            is_found,
            "edit {edit}: {file}: {place}: {code}\n{stdout}{stderr}"
        );
        bench.write(&file, &before);
    }
}

/// Keys of the search and of times, and the costs of exact fits, which are rounding.
const LEFT_OUT: [&str; 13] = [
    "/format",
    "/seconds",
    "/timings",
    "/counts",
    "/attempts",
    "/weights",
    "/automatic",
    "/advice",
    "/warnings",
    "/gradient",
    "/optimality",
    "/model",
    "/outcome",
];

/// The document with one number multiplied by 1 + 1e-6, and its place.
fn edited_json(text: &str, random: &mut ChaCha8Rng) -> (String, String) {
    let mut document: Value = serde_json::from_str(text).expect("JSON");
    let deviations: Vec<f64> = match document["covariance"].as_array() {
        Some(rows) => (rows.iter().enumerate())
            .map(|(i, row)| row[i].as_f64().expect("a variance").sqrt())
            .collect(),
        None => Vec::new(),
    };
    let start = document
        .pointer("/cost/initial")
        .and_then(Value::as_f64)
        .unwrap_or(0.0);
    let mut places = Vec::new();
    numbers(&document, String::new(), &mut places);
    places.retain(|(place, x)| {
        let parts: Vec<&str> = place.split('/').skip(1).collect();
        let is_small = match parts.as_slice() {
            ["covariance", i, j] => {
                let [i, j] = [i, j].map(|k| deviations[k.parse::<usize>().expect("an index")]);
                x.abs() < 1e-6 * i * j
            }
            [.., "cost"] | ["cost", ..] => x.abs() < 1e-12 * start,
            _ => false,
        };
        *x != 0.0 && !is_small && !LEFT_OUT.iter().any(|prefix| place.starts_with(prefix))
    });
    let (place, x) = places.choose(random).expect("a number").clone();
    let is_count = document.pointer(&place).is_some_and(Value::is_u64);
    let edited = match is_count {
        true => Value::from(x as u64 + 1),
        false => Value::from(x * (1.0 + 1e-6)),
    };
    *document.pointer_mut(&place).expect("the place") = edited;
    (serde_json::to_string(&document).expect("JSON"), place)
}

fn numbers(value: &Value, place: String, found: &mut Vec<(String, f64)>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let key = key.replace('~', "~0").replace('/', "~1");
                numbers(value, format!("{place}/{key}"), found);
            }
        }
        Value::Array(list) => {
            for (i, value) in list.iter().enumerate() {
                numbers(value, format!("{place}/{i}"), found);
            }
        }
        Value::Number(number) => found.push((place, number.as_f64().expect("a number"))),
        _ => {}
    }
}

/// The table with one number multiplied by 1 + 1e-6; one far below the largest of its column is rounding.
fn edited_table(text: &str, random: &mut ChaCha8Rng) -> (String, String) {
    let mut rows: Vec<Vec<String>> = (text.lines())
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    loop {
        let (i, j) = (
            random.random_range(1..rows.len()),
            random.random_range(0..rows[0].len()),
        );
        let parsed = |row: &Vec<String>| row[j].parse::<f64>().ok();
        let largest = rows
            .iter()
            .filter_map(parsed)
            .fold(0.0f64, |most, x| most.max(x.abs()));
        let Some(x) = parsed(&rows[i]).filter(|x| x.abs() > 1e-7 * largest) else {
            continue;
        };
        rows[i][j] = (x * (1.0 + 1e-6)).to_string();
        let lines: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
        return (
            lines.join("\n") + "\n",
            format!("row {i}, column {}", rows[0][j]),
        );
    }
}

/// Messages on runs that cannot be verified; nothing is written.
#[test]
fn mistakes() {
    let bench = Workbench::with_small_model();
    bench.run(&["fit", "model.yaml", "--out", "run", "--no-report"]);
    let refused = |arguments: &[&str]| {
        let before = bench.contents();
        let (code, stdout, stderr) = bench.run(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert_eq!(bench.contents(), before);
        stderr
    };
    assert_snapshot!(refused(&["verify", "nowhere"]));
    let model = bench.read("model.yaml");
    bench.write("model.yaml", &model.replace("nodes: 21", "nodes: 41"));
    assert_snapshot!(refused(&["verify", "run"]));
    bench.write(
        "model.yaml",
        &model.replace("stiffness: {basis: nodal", "stiffness: {basis: constant"),
    );
    assert_snapshot!(refused(&["verify", "run"]));
    fs::remove_file(bench.path("model.yaml")).expect("removed");
    assert_snapshot!(refused(&["verify", "run"]));
    bench.write("model.yaml", &model);
    let parameters = bench.read("run/parameters.json");
    bench.write(
        "run/parameters.json",
        &parameters.replacen("mass[0]", "mass\", \"more", 1),
    );
    assert_snapshot!(refused(&["verify", "run"]));
    let edited = |edit: &dyn Fn(&mut Value)| {
        let mut document: Value = serde_json::from_str(&parameters).expect("JSON");
        edit(&mut document);
        bench.write("run/parameters.json", &document.to_string());
        refused(&["verify", "run"])
    };
    assert_snapshot!(edited(&|p| p["functions"][0]["has_jumps"] = true.into()), @"
    error: run: this kind of fit cannot be rebuilt
      found: a coefficient with jumps found by `bic`
      expected: a fit that its parameters and the noise of its channels describe
      hint: fit the model again into another folder and compare the result documents
    ");
    assert_snapshot!(edited(&|p| p["values"][0] = (-1e300).into()), @"
    error: model.yaml: the model file does not give the model of the run
      found: the mass is -1e300 kg at t = 0 s, not positive
      expected: a response, as in run
      hint: the model file or its data have changed since the fit: fit again
    ");
    bench.write("run/parameters.json", "{}");
    assert_snapshot!(refused(&["verify", "run"]));
    fs::remove_file(bench.path("run/parameters.json")).expect("removed");
    assert_snapshot!(refused(&["verify", "run"]));
}

/// Other samples give other results.
#[test]
fn a_changed_record_is_found() {
    let bench = Workbench::with_small_model();
    bench.run(&["fit", "model.yaml", "--out", "run", "--no-report"]);
    bench.run_to(0, &["verify", "run"]);
    bench.write(
        "samples.csv",
        &sample_table(21).replacen("0.1,0.98", "0.1,0.97", 1),
    );
    let said = bench.run_to(3, &["verify", "run"]);
    assert!(said.contains("cost"), "{said}");
}

/// The covariance of 65 to 1000 parameters stands in its own file.
#[test]
fn an_edited_covariance_file_is_found() {
    let bench = Workbench::with_shipped_models();
    let yaml = "format: 1
title: many knots
experiments:
  - name: free decay
    data: data/noisy.csv
    columns: {time: t_s, displacement: y_m}
    sigma: {displacement: 0.1}
    initial: {displacement: 3.3, velocity: 1.0}
grid: {nodes: 500, method: rk4}
functions:
  mass: {basis: b-spline, knots: 80, start: 2.0, penalty: {kind: tikhonov, order: 2, weight: 0.1}}
  damping: {basis: constant, start: 0.1}
  stiffness: {fixed: 1.0}
";
    bench.write("many.yaml", yaml);
    bench.run_to(0, &["fit", "many.yaml", "--no-report"]);
    bench.run_to(0, &["verify", "runs/many"]);
    let path = bench.path("runs/many/covariance.npy");
    let mut bytes = fs::read(&path).expect("a file");
    // A variance: the last of the 83 x 83 numbers.
    let end = bytes.len();
    let mut last = [0; 8];
    last.copy_from_slice(&bytes[end - 8..]);
    let edited = f64::from_le_bytes(last) * (1.0 + 1e-5);
    bytes[end - 8..].copy_from_slice(&edited.to_le_bytes());
    fs::write(&path, &bytes).expect("written");
    let said = bench.run_to(3, &["verify", "runs/many"]);
    assert!(
        said.contains("covariance") && said.contains("does not hold"),
        "{said}"
    );
    fs::write(&path, &bytes[..end - 8]).expect("written");
    let (code, _, error) = bench.run(&["verify", "runs/many"]);
    assert_eq!(code, 2);
    assert!(error.contains("the matrix is damaged"), "{error}");
}

/// `report` draws the same figures and page as the fit, apart from those of the search, and leaves the other files as they are; the run
/// still holds.
#[test]
fn a_report_is_drawn_again() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["fit", "models/duffing.yaml"]);
    let kept = ["result.json", "functions.csv", "parameters.json"];
    let before = kept.map(|name| bench.read(&format!("runs/duffing/{name}")));
    let drawn = ["functions", "residual_tests", "spectra", "convergence"];
    let read = |name: &str| bench.read(&format!("runs/duffing/figures/{name}.svg"));
    let figures = drawn.map(read);
    let page = bench.read("runs/duffing/report.html");
    let said = bench.run_to(0, &["report", "runs/duffing"]);
    assert_eq!(said, "report and figures in runs/duffing\n");
    assert_eq!(
        kept.map(|name| bench.read(&format!("runs/duffing/{name}"))),
        before
    );
    for (name, figure) in drawn.iter().zip(&figures) {
        assert!(read(name) == *figure, "{name} differs");
    }
    // The first screen and the sections before the solver are those of the fit.
    let upper = |page: &str| {
        page.split("<section id=\"solver\">")
            .next()
            .map(str::to_owned)
    };
    assert!(upper(&bench.read("runs/duffing/report.html")) == upper(&page));
    bench.run_to(0, &["verify", "runs/duffing"]);
    // Without its page a run gets one.
    bench.run_to(
        0,
        &[
            "fit",
            "models/duffing.yaml",
            "--no-report",
            "--out",
            "plain",
        ],
    );
    bench.run_to(0, &["report", "plain"]);
    assert!(upper(&bench.read("plain/report.html")) == upper(&page));
}

#[test]
fn a_report_needs_a_finished_run() {
    let bench = Workbench::with_shipped_models();
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(&["report", "models"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert_snapshot!(stderr, @r"
    error: models/result.json: no such file
      expected: the result of a finished run
    ");
    assert_eq!(bench.contents(), before);
}
