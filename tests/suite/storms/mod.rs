//! Numerical stress tests: for any record a fit ends in time, with a status or an error, and no meaningless result is
//! reported as converged.

mod cases;

use assert_cmd::Command;
use cases::{Case, cases};
use kmcfit_core::internals::threads::{available, map};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::time::Duration;

const METHODS: [&str; 5] = [
    "steepest-descent",
    "lbfgs",
    "projected-gradient",
    "gauss-newton",
    "equation-error",
];
/// Time limit of a case; all take less.
const HANGS: Duration = Duration::from_secs(300);
/// Largest relative error of mass and damping that counts as `found`; it is limited by the step of the calm record.
const FOUND: f64 = 1e-4;
/// Largest relative error that counts as `near`.
const NEAR: f64 = 0.05;

/// End of a fit.
struct End {
    /// The status, or `refused`.
    status: String,
    /// Mass and damping, if the fit has a result.
    device: Option<[f64; 2]>,
    /// Classification of the functions.
    sentences: Vec<String>,
}

fn run(case: &Case, method: &str) -> End {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    fs::write(place.join("model.yaml"), case.model(method)).expect("room");
    fs::write(place.join("samples.csv"), case.sample_table()).expect("room");
    let output = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(place)
        .args(["fit", "model.yaml", "--no-report", "--out", "run"])
        .timeout(HANGS)
        .output()
        .expect("the program runs");
    let what = format!("{}, {method}", case.name);
    let stderr = String::from_utf8(output.stderr).expect("text");
    let code = output.status.code();
    let code = code.unwrap_or_else(|| panic!("{what}: killed\n{stderr}"));
    assert!([0, 2, 3].contains(&code), "{what}: {code}\n{stderr}");
    if code == 2 {
        assert!(!place.join("run").exists(), "{what}");
        assert!(stderr.starts_with("error: model.yaml:"), "{what}: {stderr}");
        return End {
            status: "refused".into(),
            device: None,
            sentences: Vec::new(),
        };
    }
    let text = fs::read_to_string(place.join("run/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    let word = |pointer: &str| result.pointer(pointer).and_then(Value::as_str);
    let status = word("/outcome/status").expect("a status").to_owned();
    assert!(
        word("/outcome/reason").is_some_and(|r| !r.is_empty()),
        "{what}"
    );
    let is_fine = ["converged", "completed"].contains(&status.as_str());
    assert_eq!(code == 0, is_fine, "{what}: {status}");
    let has_device = !["failed", "infeasible"].contains(&status.as_str());
    let device = has_device.then(|| sensible(&what, place, &result));
    let sentences = result
        .pointer("/identifiability/functions")
        .and_then(Value::as_array);
    End {
        status,
        device,
        sentences: (sentences.into_iter().flatten())
            .filter_map(|s| s.as_str().map(str::to_owned))
            .collect(),
    }
}

/// Checks that the numbers of a result are consistent; returns its mass and damping.
fn sensible(what: &str, place: &Path, result: &Value) -> [f64; 2] {
    let cost = |key: &str| result["cost"][key].as_f64();
    if result["attempts"]
        .as_array()
        .is_some_and(|attempts| !attempts.is_empty())
    {
        let (before, after) = (cost("initial"), cost("final"));
        let (before, after) = before
            .zip(after)
            .unwrap_or_else(|| panic!("{what}: no cost"));
        assert!(
            after.is_finite() && after <= before,
            "{what}: {before:e} -> {after:e}"
        );
    }
    let table = fs::read_to_string(place.join("run/functions.csv")).expect("a table");
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().expect("names").split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).expect("a column");
    let columns = ["mass_kg", "damping_N_s_per_m", "stiffness_N_per_m"].map(column);
    let mut first = None;
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let values = columns.map(|c| fields[c].parse::<f64>().expect("a number"));
        assert!(values.iter().all(|v| v.is_finite()), "{what}: {line}");
        first.get_or_insert([values[0], values[1]]);
    }
    first.expect("rows")
}

/// The largest error of mass and damping, relative to the system of the record.
fn error(case: &Case, found: [f64; 2]) -> f64 {
    let part = |found: f64, true_one: f64| (found / true_one - 1.0).abs();
    let device = case.device;
    part(found[0], device.mass).max(part(found[1], device.damping))
}

/// Status of a fit, and agreement of mass and damping with the record.
fn verdict(case: &Case, end: &End) -> String {
    let found = match end.device.map(|found| error(case, found)) {
        None => return end.status.clone(),
        Some(error) if error <= FOUND => "found",
        Some(error) if error <= NEAR => "near",
        Some(_) => "another",
    };
    format!("{}: {found}", end.status)
}

/// Records from which almost no parameter combination is identifiable.
const BLIND: [&str; 4] = [
    "constant samples",
    "nothing moves",
    "an outlier of 1e9",
    "sigma 1e300",
];

/// From such records no function is classified as identified.
fn says_little(case: &Case, method: &str, end: &End) {
    if BLIND.contains(&case.name) {
        for sentence in &end.sentences {
            assert!(
                !sentence.contains("is identified"),
                "{}, {method}: {sentence}",
                case.name
            );
        }
    }
}

/// Fits of a scaled response give the same parameters, except for steepest descent, whose step lengths have a
/// scale.
fn same_device(calm: &[End], end: &End, name: &str, index: usize) {
    if METHODS[index] == "steepest-descent"
        || !["amplitude 1e-12", "amplitude 1e12"].contains(&name)
    {
        return;
    }
    let both = calm[index].device.zip(end.device);
    let (before, now) = both.unwrap_or_else(|| panic!("{name}: no device"));
    assert_eq!(calm[index].status, end.status, "{name}");
    for (before, now) in before.into_iter().zip(now) {
        // The tolerance of J is 1e-10; its square root bounds the error of the parameters.
        assert!((now / before - 1.0).abs() < 1e-5, "{name}: {before} {now}");
    }
}

#[test]
fn storms() {
    let mut table = format!(
        "| record | {} |\n|---|{}\n",
        METHODS.join(" | "),
        "---|".repeat(5)
    );
    let mut calm = Vec::new();
    let cases = cases();
    let count = METHODS.len();
    let each = |i: usize| run(&cases[i / count], METHODS[i % count]);
    let mut ends = map(cases.len() * count, available(), each).into_iter();
    for case in &cases {
        let ends = METHODS.map(|_| ends.next().expect("a fit of each"));
        for (index, end) in ends.iter().enumerate() {
            says_little(case, METHODS[index], end);
            if !calm.is_empty() {
                same_device(&calm, end, case.name, index);
            }
        }
        let cells = ends.each_ref().map(|end| verdict(case, end));
        table += &format!("| {} | {} |\n", case.name, cells.join(" | "));
        if calm.is_empty() {
            calm = Vec::from(ends);
        }
    }
    insta::assert_snapshot!("storms", table);
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/storms.md"));
    let page = page.expect("docs/storms.md");
    assert!(
        page.contains(&table),
        "docs/storms.md has another table:\n{table}"
    );
}
