//! `kmcfit study`: analyses of a fit, and sequences.

use crate::workbench::Workbench;
use insta::assert_snapshot;
use serde_json::Value;

/// A damped system measured with noise, with all analyses of a study.
const MODEL: &str = "\
format: 1
title: Studied
experiments:
  - name: free decay
    data: samples.csv
    sigma: {displacement: 0.02}
    initial: {displacement: 1.0, velocity: estimate}
functions:
  mass:      {fixed: 1.0}
  damping:   {basis: constant, start: 0.1}
  stiffness: {basis: piecewise-linear, knots: 3, start: 4.0}
predict:
  - {displacement: 0.0, velocity: 1.0}
study:
  seed: 3
  profiles:
    - {function: stiffness, at: 5.0}
    - {function: damping}
    - {parameter: initial velocity of free decay}
  starts: 4
  spread: 1.5
  candidates:
    - {name: the same again, initial: {displacement: 1.0, velocity: 0.0}}
    - {name: a blow, initial: {displacement: 0.0, velocity: 3.0}, channel: acceleration, sigma: 0.1}
";

fn bench() -> Workbench {
    let bench = Workbench::empty();
    bench.write("model.yaml", MODEL);
    let mut text = String::from("t_s,y_m\n");
    for i in 0..201 {
        let t = 0.05 * f64::from(i);
        // Deterministic noise: a sum of tones that no system of the model contains.
        let noise = 0.01 * ((37.0 * t).sin() + (53.0 * t + 1.0).cos() + (71.0 * t).sin());
        let y = (-0.1 * t).exp() * (1.99 * t).cos() + noise;
        text += &format!("{t},{y}\n");
    }
    bench.write("samples.csv", &text);
    bench
}

fn document(bench: &Workbench, folder: &str) -> Value {
    serde_json::from_str(&bench.read(&format!("{folder}/study.json"))).expect("JSON")
}

#[test]
fn a_study_reports_all_its_analyses() {
    let bench = bench();
    let stdout = bench.run_to(0, &["study", "model.yaml"]);
    assert!(stdout.contains("damping is identified"), "{stdout}");
    // The order of the page.
    let headings = ["Candidate experiments", "Likelihood profiles", "Fit\n"];
    let at = headings.map(|heading| stdout.find(&format!("\n{heading}")));
    assert!(at.is_sorted() && at[0].is_some(), "{at:?} {stdout}");
    let study = document(&bench, "runs/model-study");
    assert_eq!(study["status"], "complete");
    assert_eq!(study["sensitivity"]["rank"], 5);
    let verdicts = study["bands"]["classification"]
        .as_array()
        .expect("verdicts");
    assert!(
        verdicts.iter().any(|v| v["verdict"] == "fixed"),
        "{verdicts:?}"
    );
    for profile in study["profiles"].as_array().expect("profiles") {
        assert_eq!(profile["verdict"], "identified", "{profile}");
    }
    let extremes = study["extremes"].as_array().expect("extremes");
    assert!(extremes.len() >= 3, "{extremes:?}");
    assert_eq!(
        study["multistart"]["clusters"]
            .as_array()
            .expect("clusters")
            .len(),
        1
    );
    assert_eq!(study["candidates"].as_array().expect("candidates").len(), 2);
    assert_eq!(study["failures"].as_array().expect("failures").len(), 0);
    let page = bench.read("runs/model-study/study.html");
    roxmltree::Document::parse(page.trim_start_matches("<!DOCTYPE html>\n")).expect("well-formed");
    for figure in ["bands", "profiles", "extremes", "waterfall"] {
        let svg = bench.read(&format!("runs/model-study/figures/{figure}.svg"));
        roxmltree::Document::parse(&svg).expect("XML");
    }
}

fn refused(bench: &Workbench, arguments: &[&str]) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!(code, 2, "{arguments:?}\n{stdout}\n{stderr}");
    assert_eq!(bench.contents(), before, "{arguments:?} left something");
    stderr
}

fn changed(from: &str, to: &str) -> String {
    let bench = bench();
    assert!(MODEL.contains(from), "{from}");
    bench.write("model.yaml", &MODEL.replacen(from, to, 1));
    refused(&bench, &["study", "model.yaml"])
}

#[test]
fn mistakes() {
    let bench = bench();
    bench.write("old/result.json", "{\"format\": 0}\n");
    let all = [
        changed("seed: 3", "confidence: 1.0"),
        changed("seed: 3", "confidence: 95"),
        changed("spread: 1.5", "spread: 1.0"),
        changed("starts: 4", "starts: 0"),
        changed("starts: 4", "starts: 9000000000000000000"),
        changed("seed: 3", "bootstrap: 40"),
        changed("seed: 3", "constancy_test: true"),
        changed("seed: 3", "extremes: []"),
        changed("at: 5.0", "at: 50.0"),
        changed("{function: damping}", "{function: mass}"),
        changed("{function: damping}", "{function: offset}"),
        changed("{function: damping}", "{function: stiffness}"),
        changed(
            "{parameter: initial velocity",
            "{parameter: initial velocty",
        ),
        changed("sigma: 0.1", "sigma: 0"),
        changed("seed: 3", "misfit_limit: -1"),
        refused(&bench, &["study", "old"]),
        refused(&bench, &["study", "model.yaml", "--threads", "0"]),
    ];
    assert_snapshot!(all.join("\n"));
}

/// In a record at rest no parameter combination is identifiable; the study reports this and ends.
#[test]
fn a_record_at_rest_is_refused() {
    let bench = bench();
    let mut text = String::from("t_s,y_m\n");
    for i in 0..101 {
        text += &format!("{},0\n", 0.1 * f64::from(i));
    }
    bench.write("samples.csv", &text);
    let model = MODEL
        .replace(
            "displacement: 1.0, velocity: estimate",
            "displacement: 0.0, velocity: 0.0",
        )
        .replace("    - {parameter: initial velocity of free decay}\n", "");
    bench.write("model.yaml", &model);
    let (code, _, stderr) = bench.run(&["study", "model.yaml"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(
        stderr.contains("columns.displacement: all samples are equal"),
        "{stderr}"
    );
    assert!(stderr.contains("found: 101 samples, all 0 m\n"), "{stderr}");
}

/// A run holds its model: the analyses equal those of a study of its model file, and need no longer that file.
#[test]
fn a_study_of_a_run_is_that_of_its_model() {
    let bench = bench();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    bench.run_to(0, &["study", "model.yaml", "--out", "of-model"]);
    std::fs::rename(bench.path("model.yaml"), bench.path("moved.yaml")).expect("renamed");
    bench.run_to(0, &["study", "run", "--out", "of-run"]);
    let [of_model, of_run] = ["of-model", "of-run"].map(|folder| document(&bench, folder));
    for key in ["sensitivity", "bands", "extremes", "predictions"] {
        assert_eq!(of_model[key], of_run[key], "{key}");
    }
    let (code, _, stderr) = bench.run(&["study", "runn"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr, @"
    error: runn: no such file
      expected: a model file or a sequence (YAML), or the folder of a finished run
      hint: did you mean `run`?
    ");
}

/// The coefficients of a rotation have the units of a moment per angle.
#[test]
fn a_study_of_a_rotation_has_its_units() {
    let bench = Workbench::with_shipped_models();
    let text = bench.run_to(0, &["study", "models/roll-decay.yaml"]);
    for unit in ["kg m^2", "N m s/rad", "N m/rad^3"] {
        assert!(text.contains(unit), "{unit}\n{text}");
    }
    for unit in ["kg (", "N s/m", "N/m^3"] {
        assert!(!text.contains(unit), "{unit}\n{text}");
    }
}
