//! Golden numbers: estimates, intervals, cost and verdict of the shipped models, of measured records and of ten simulated rigs, and the
//! history of the paper's run. `KMCFIT_GOLDEN=write` writes the table anew in place of comparing with it: for a number that changes on
//! purpose, with its reason in the commit.

use crate::program::{is_long, program};
use crate::workbench::repository;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Largest change of an estimate or of an end of its interval, in standard errors.
const STANDARD_ERRORS: f64 = 1e-3;
/// Largest relative change of the cost and of estimates without intervals. At a minimum a change of the parameters by a thousandth of a
/// standard error changes the cost by a millionth of its value for one sample, and by less for more.
const RELATIVE: f64 = 1e-6;
/// Half-width of a 95 % interval in standard errors.
const HALF_WIDTH: f64 = 1.96;

/// One line of the table: the cost, the verdict, the digest of a history, or an estimate with its range over the record and its interval.
fn lines(model: &str, folder: &Path) -> String {
    let text = fs::read_to_string(folder.join("result.json")).expect("a result");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().map_or("-".to_owned(), |x| format!("{x:e}"));
    let mut out = String::new();
    let _ = writeln!(out, "{model}\tcost\t{}", number(&result["cost"]["final"]));
    let level = result["verdict"]["level"].as_str().unwrap_or("-");
    let _ = writeln!(out, "{model}\tverdict\t{level}");
    let estimates = result["estimates"].as_object().expect("estimates").iter();
    for (name, estimate) in estimates.collect::<BTreeMap<_, _>>() {
        let numbers = [
            &estimate["value"],
            &estimate["range"][0],
            &estimate["range"][1],
        ];
        let ends = [&estimate["ci95"][0], &estimate["ci95"][1]];
        let numbers = numbers.into_iter().chain(ends).map(number);
        let numbers: Vec<String> = numbers.collect();
        let _ = writeln!(out, "{model}\t{name}\t{}", numbers.join("\t"));
    }
    if model == "paper" {
        let history = fs::read(folder.join("history.csv")).expect("a history");
        let digest = Sha256::digest(history);
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        let _ = writeln!(out, "{model}\thistory\t{digest}");
    }
    out
}

/// Fits models, each given by its name, its file and the folder of its data, and returns their lines.
fn fitted(models: &[(String, std::path::PathBuf)], data: &Path) -> String {
    let mut out = String::new();
    for (name, file) in models {
        let position = tempfile::tempdir().expect("a folder");
        let text = fs::read_to_string(file).expect("a model");
        // The data of rigs and of measured records lie elsewhere.
        let at = format!("data: {}/", data.display());
        let model = position.path().join(file.file_name().expect("a name"));
        fs::write(
            &model,
            text.replace("data: ../data/", &at)
                .replace("data: $DATA/", &at),
        )
        .expect("a model");
        let run = position.path().join("run");
        let mut command = Command::new(program());
        command
            .current_dir(repository("models"))
            .arg("fit")
            .arg(&model);
        let output = command
            .args(["--no-report", "--out"])
            .arg(&run)
            .output()
            .expect("the program runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            matches!(output.status.code(), Some(0 | 3)),
            "{name}: {said}"
        );
        out += &lines(name, &run);
    }
    out
}

/// The models of a folder in the order of their names.
fn models(folder: &str) -> Vec<(String, std::path::PathBuf)> {
    let files = fs::read_dir(repository(folder)).expect("a folder");
    let files = files.map(|file| file.expect("an entry").path());
    let files = files.filter(|file| file.extension().is_some_and(|ending| ending == "yaml"));
    let name = |file: &Path| {
        file.file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned()
    };
    let mut models: Vec<_> = files.map(|file| (name(&file), file)).collect();
    models.sort();
    models
}

/// Compares lines with the table `tests/golden/NAME.tsv`, or writes it.
fn compare(name: &str, found: &str) {
    let path = repository(&format!("tests/golden/{name}.tsv"));
    if std::env::var_os("KMCFIT_GOLDEN").is_some_and(|mode| mode == "write") {
        return fs::write(&path, found).expect("a table");
    }
    let golden = fs::read_to_string(&path).expect("a table");
    let mut wrong = String::new();
    assert_eq!(golden.lines().count(), found.lines().count(), "{found}");
    for (golden, found) in golden.lines().zip(found.lines()) {
        if !agree(golden, found) {
            let _ = writeln!(wrong, "golden {golden}\nfound  {found}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

fn agree(golden: &str, found: &str) -> bool {
    let [golden, found]: [Vec<&str>; 2] = [golden, found].map(|line| line.split('\t').collect());
    let is_same_row = golden.len() == found.len() && golden[..2] == found[..2];
    let numbers = |row: &[&str]| {
        row[2..]
            .iter()
            .map(|x| x.parse::<f64>().ok())
            .collect::<Vec<_>>()
    };
    let [expected, numbers] = [&golden, &found].map(|row| numbers(row));
    let margin = match expected[..] {
        [.., Some(low), Some(high)] if expected.len() == 5 && high > low => {
            STANDARD_ERRORS * (high - low) / (2.0 * HALF_WIDTH)
        }
        [Some(value), ..] => RELATIVE * value.abs(),
        _ => 0.0,
    };
    let is_near = |(expected, found): (&Option<f64>, &Option<f64>)| match (expected, found) {
        (Some(expected), Some(found)) => (expected - found).abs() <= margin,
        _ => expected.is_none() && found.is_none(),
    };
    let is_text = expected.iter().all(Option::is_none) && golden.len() == 3;
    is_same_row
        && if is_text {
            golden == found
        } else {
            expected.iter().zip(&numbers).all(is_near)
        }
}

#[test]
fn a_change_beyond_the_margins_is_found() {
    let row = "a\tmass\t1e0\t1e0\t1e0\t0.98e0\t1.02e0";
    assert!(agree(row, row) && agree(row, &row.replacen("1e0", "1.00001e0", 1)));
    assert!(!agree(row, &row.replacen("1e0", "1.00002e0", 1)));
    assert!(
        !agree(row, &row.replace("0.98e0", "-")) && !agree(row, &row.replace("mass", "damping"))
    );
    assert!(
        agree("a\tcost\t2e0", "a\tcost\t2.000001e0")
            && !agree("a\tcost\t2e0", "a\tcost\t2.00001e0")
    );
    assert!(
        agree("a\tverdict\tcheck", "a\tverdict\tcheck")
            && !agree("a\tverdict\tcheck", "a\tverdict\tadequate")
    );
}

#[test]
fn shipped_models() {
    const WITHOUT_FIT: [&str; 2] = ["paper-device", "paper-experiments"];
    let mut models = models("models");
    models.retain(|(name, _)| !WITHOUT_FIT.contains(&name.as_str()));
    compare("models", &fitted(&models, &repository("data")));
}

/// The records are not part of the project.
#[test]
fn measured_records() {
    let shared =
        std::env::var("KMCFIT_SHARED").map_or_else(|_| repository("../shared"), Into::into);
    let data = shared.join("data");
    match data.canonicalize() {
        Ok(data) => compare("shared", &fitted(&models("tests/golden/shared"), &data)),
        Err(_) => eprintln!("SKIPPED: no measured records in {}", data.display()),
    }
}

/// The rigs are made by `faults/make_rigs.py` of the shared folder; `KMCFIT_RIGS` names their folder.
#[test]
fn simulated_rigs() {
    match std::env::var("KMCFIT_RIGS") {
        Ok(data) => compare(
            "rigs",
            &fitted(&models("tests/golden/rigs"), Path::new(&data)),
        ),
        Err(_) if is_long() => panic!("KMCFIT_RIGS names no folder"),
        Err(_) => eprintln!("SKIPPED: the rigs are compared by `.ci/long rigs`"),
    }
}
