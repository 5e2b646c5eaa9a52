//! Advice, followed literally: a change that is said to improve the fit does, and none ends in an error.

use crate::program::{is_long, program};
use crate::workbench::repository;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Models whose advice is followed in every test; `KMCFIT_LONG` follows that of all shipped models and of the records in `KMCFIT_RIGS`.
const SHORT: [&str; 4] = [
    "models/footbridge.yaml",
    "models/knots.yaml",
    "models/noisy.yaml",
    "models/roll-decay.yaml",
];
/// Decrease of BIC that counts as better.
const BETTER: f64 = 6.0;

/// The result of a fit with these overrides; the message of an error.
fn fit(file: &Path, overrides: &[&str], out: &Path) -> Result<Value, String> {
    let mut command = Command::new(program());
    command
        .arg("fit")
        .arg(file)
        .args(["--no-report", "--out"])
        .arg(out);
    overrides.iter().for_each(|set| {
        command.args(["--set", set]);
    });
    let output = command.output().expect("the program runs");
    match output.status.code() {
        Some(0 | 3) => {
            let text = fs::read_to_string(out.join("result.json")).expect("a result");
            Ok(serde_json::from_str(&text).expect("JSON"))
        }
        _ => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

/// 0 for Adequate, 1 for Check, 2 for Inadequate.
fn level(document: &Value) -> usize {
    let levels = ["adequate", "check", "inadequate"];
    let own = document["verdict"]["level"].as_str();
    levels
        .iter()
        .position(|level| Some(*level) == own)
        .expect("a level")
}

/// Follows each piece of advice on a fit; returns how many were tried before.
fn follow(file: &Path) -> usize {
    let position = tempfile::tempdir().expect("a folder");
    let before = match fit(file, &[], &position.path().join("run")) {
        Ok(document) => document,
        Err(message) => panic!("{}: {message}", file.display()),
    };
    let mut tried = 0;
    for advice in before["advice"].as_array().into_iter().flatten() {
        let text = &advice["text"];
        let Some(set) = advice["set"].as_array() else {
            continue;
        };
        let set: Vec<&str> = set.iter().filter_map(Value::as_str).collect();
        let after = match fit(file, &set, &position.path().join("followed")) {
            Ok(document) => document,
            Err(message) => panic!("{}: {text}: {message}", file.display()),
        };
        if advice["tried"]
            .as_str()
            .is_some_and(|tried| tried.starts_with("tried"))
        {
            tried += 1;
            let bic = |document: &Value| document["statistics"]["bic"].as_f64();
            let gain = bic(&before)
                .zip(bic(&after))
                .map(|(before, after)| before - after);
            let is_better = level(&after) < level(&before)
                || level(&after) == level(&before) && gain.is_some_and(|gain| gain > BETTER);
            assert!(is_better, "{}: {text}: {gain:?}", file.display());
        }
    }
    tried
}

/// Files of a folder with these endings, and of its subfolders.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries
        .flat_map(|entry| match entry.path() {
            path if path.is_dir() => files(&path, endings),
            path => vec![path],
        })
        .filter(|path| {
            let ending = path.extension().and_then(|ending| ending.to_str());
            ending.is_some_and(|ending| endings.contains(&ending))
        })
        .collect();
    found.sort();
    found
}

#[test]
fn advice_that_was_tried_improves_the_fit() {
    if !is_long() {
        SHORT.iter().for_each(|model| {
            follow(&repository(model));
        });
        return;
    }
    let mut all = files(&repository("models"), &["yaml"]);
    // A simulation, and two models of several runs.
    all.retain(|model| {
        let name = model
            .file_stem()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        !["paper-device", "paper-experiments"].contains(&name)
    });
    let rigs = std::env::var("KMCFIT_RIGS").expect("KMCFIT_RIGS names a folder");
    all.extend(files(Path::new(&rigs), &["csv", "txt"]));
    let tried: usize = all.iter().map(|file| follow(file)).sum();
    println!(
        "{} runs, {tried} pieces of advice were tried and followed",
        all.len()
    );
    assert!(all.len() >= 30);
}
