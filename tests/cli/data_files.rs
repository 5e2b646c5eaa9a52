//! The files of `data/` equal the output of the program and of the example that generate them.

use crate::workbench::{Workbench, column, repository};
use std::fs;

#[allow(dead_code, reason = "the example's main is not needed here")]
#[path = "../../examples/make_data.rs"]
mod make_data;

#[allow(dead_code, reason = "the example's main is not needed here")]
#[path = "../../examples/make_records.rs"]
mod make_records;

/// Numbers in the text are rounded to fewer digits than those in which implementations of the sine differ.
#[test]
fn records() {
    for (name, text) in make_records::all() {
        assert!(text == shipped(name), "{name}");
    }
}

fn shipped(name: &str) -> String {
    fs::read_to_string(repository("data").join(name)).expect("a file of data/")
}

#[test]
fn paper() {
    let bench = Workbench::with_shipped_models();
    let record = bench.read("data/paper.csv.json");
    for name in ["data/paper.csv", "data/paper.csv.json"] {
        fs::remove_file(bench.path(name)).expect("a file can be removed");
    }
    let simulate = [
        "simulate",
        "models/paper-device.yaml",
        "--out",
        "data/paper.csv",
    ];
    assert_eq!(bench.run_to(0, &simulate), "");
    assert!(bench.read("data/paper.csv") == shipped("paper.csv"));
    assert_eq!(bench.read("data/paper.csv.json"), record);
}

#[test]
fn further_experiments() {
    let bench = Workbench::with_shipped_models();
    for (name, experiment) in [("second", "second record"), ("forced", "forced record")] {
        let out = format!("data/paper_{name}.csv");
        let simulate = [
            "simulate",
            "models/paper-experiments.yaml",
            "--experiment",
            experiment,
            "--out",
            &out,
        ];
        fs::remove_file(bench.path(&out)).expect("a file can be removed");
        bench.run_to(0, &simulate);
        assert!(
            bench.read(&out) == shipped(&format!("paper_{name}.csv")),
            "{name}"
        );
    }
}

#[test]
fn noisy() {
    let bench = Workbench::with_shipped_models();
    let simulate = [
        "simulate",
        "models/paper-device.yaml",
        "--noise",
        "0.1",
        "--seed",
        "1",
        "--out",
        "data/noisy.csv",
    ];
    bench.run_to(0, &simulate);
    for name in ["noisy.csv", "noisy.csv.json"] {
        assert!(
            bench.read(&format!("data/{name}")) == shipped(name),
            "{name}"
        );
    }
}

#[test]
fn paper_truth() {
    assert!(make_data::paper_truth().to_csv() == shipped("paper_truth.csv"));
}

/// The last digits of Bessel functions depend on the library that computes them.
#[test]
fn bessel() {
    let (made, shipped) = (make_data::bessel().to_csv(), shipped("bessel.csv"));
    assert_eq!(column(&made, "t_s"), column(&shipped, "t_s"));
    let pairs = column(&made, "y_m")
        .into_iter()
        .zip(column(&shipped, "y_m"));
    for (made, shipped) in pairs {
        assert!((made - shipped).abs() <= 1e-12, "{made} {shipped}");
    }
}

#[test]
fn every_file_is_described() {
    let about = shipped("README.md");
    for entry in fs::read_dir(repository("data")).expect("a folder can be listed") {
        let name = entry
            .expect("an entry")
            .file_name()
            .into_string()
            .expect("a name");
        assert!(
            name == "README.md" || about.contains(&format!("`{name}`")),
            "{name}"
        );
    }
}

/// Results and journals are text and contain the path of the model, so the error names the model and not `--out`.
#[test]
#[cfg(target_os = "linux")]
fn a_path_that_is_not_utf_8_is_refused() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let bench = Workbench::with_shipped_models();
    let odd = OsStr::from_bytes(b"models/p\xffper.yaml");
    let position = bench.path("models");
    let copy = position.join(OsStr::from_bytes(b"p\xffper.yaml"));
    std::fs::copy(position.join("paper.yaml"), copy).expect("room");
    for command in ["fit", "check", "simulate", "study", "compare"] {
        let output = bench
            .command(&[command])
            .arg(odd)
            .output()
            .expect("the program runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{command}: {said}");
        assert!(
            said.contains("the path of the model is not UTF-8"),
            "{command}: {said}"
        );
        assert!(!said.contains("--out"), "{command}: {said}");
    }
    assert!(!bench.path("runs").exists(), "something was written");
}
