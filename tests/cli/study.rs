//! `kmcfit study` and `kmcfit resume`: analyses of a fit, their journal, and sequences.

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
  bootstrap: 40
  constancy_test: true
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
    let headings = [
        "Constancy test",
        "Candidate experiments",
        "Likelihood profiles",
        "Fit\n",
    ];
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
    for figure in ["bands", "spectrum", "profiles", "extremes", "waterfall"] {
        let svg = bench.read(&format!("runs/model-study/figures/{figure}.svg"));
        roxmltree::Document::parse(&svg).expect("XML");
    }
}

/// Finished analyses are kept, and a continued study is bit-identical to an uninterrupted one, with any number of
/// threads.
#[test]
fn an_interrupted_study_is_resumed() {
    let bench = bench();
    bench.run_to(
        0,
        &["study", "model.yaml", "--out", "whole", "--threads", "1"],
    );
    let journal = bench.read("whole/study.journal");
    let lines: Vec<&str> = journal.lines().collect();
    assert!(lines.len() > 8, "{}", lines.len());
    // Truncated after some analyses, within a line.
    for kept in [1, 3, 6] {
        let half = &lines[kept][..lines[kept].len() / 2];
        let part = lines[..kept].join("\n") + "\n" + half;
        bench.write("part/study.journal", &part);
        bench.run_to(0, &["resume", "part", "--threads", "2"]);
        for file in ["study.json", "study.html", "study.journal"] {
            let (a, b) = (
                bench.read(&format!("whole/{file}")),
                bench.read(&format!("part/{file}")),
            );
            assert!(a == b, "{file} after {kept} lines");
        }
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
    bench.run_to(0, &["study", "model.yaml", "--out", "done"]);
    bench.write("model.yaml", &MODEL.replacen("seed: 3", "seed: 4", 1));
    let other_model = refused(&bench, &["resume", "done"]);
    bench.write(
        "done/study.journal",
        "{\"format\": 9, \"model\": \"m\", \"fingerprint\": \"\"}\n",
    );
    let other_format = refused(&bench, &["resume", "done"]);
    bench.write("old/result.json", "{\"format\": 0}\n");
    let all = [
        changed("seed: 3", "confidence: 1.0"),
        changed("seed: 3", "confidence: 95"),
        changed("spread: 1.5", "spread: 1.0"),
        changed("starts: 4", "starts: 0"),
        changed("starts: 4", "starts: 9000000000000000000"),
        changed("bootstrap: 40", "bootstrap: 2"),
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
        other_model,
        other_format,
        refused(&bench, &["resume", "nowhere"]),
        refused(&bench, &["study", "old"]),
        refused(&bench, &["study", "model.yaml", "--threads", "0"]),
    ];
    assert_snapshot!(all.join("\n"));
}

/// The conclusions on a sequence are computed from the measures of its runs.
#[test]
fn a_sequence() {
    let bench = Workbench::with_shipped_models();
    bench.write(
        "models/short.yaml",
        "format: 1\ntitle: Two runs\nsequence: [paper-positive.yaml, linear-mass.yaml]\n",
    );
    let stdout = bench.run_to(0, &["study", "models/short.yaml"]);
    assert!(stdout.contains("paper-positive has J/J0"), "{stdout}");
    assert!(
        stdout.contains(
            "linear-mass is the first run that recovers the true system, including its scale."
        ),
        "{stdout}"
    );
    assert!(
        bench
            .read("runs/short-study/compare.html")
            .contains("Conclusions")
    );
    // Resumed after the second fit was lost: the first is unchanged, and the results are the same.
    let first = bench.read("runs/short-study/paper-positive/result.json");
    let second = bench.read("runs/short-study/linear-mass/functions.csv");
    std::fs::remove_file(bench.path("runs/short-study/linear-mass/result.json")).expect("removed");
    let again = bench.run_to(0, &["resume", "runs/short-study"]);
    assert_eq!(again, stdout);
    assert!(first == bench.read("runs/short-study/paper-positive/result.json"));
    assert!(second == bench.read("runs/short-study/linear-mass/functions.csv"));
    bench.write(
        "models/short.yaml",
        "format: 1\nsequence: [linear-mass.yaml, nowhere.yaml]\n",
    );
    let missing = refused(
        &bench,
        &["study", "models/short.yaml", "--out", "runs/other"],
    );
    assert!(missing.contains("nowhere.yaml: no such file"), "{missing}");
    bench.write("models/short.yaml", "format: 1\nsequence: []\n");
    let before = refused(&bench, &["study", "models/short.yaml"]);
    assert!(before.contains("the sequence has no model"), "{before}");
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

/// A study of a run starts from its fit: the analyses equal those of a study of its model, which fits again.
#[test]
fn a_study_of_a_run_starts_from_its_fit() {
    let bench = bench();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    bench.run_to(0, &["study", "model.yaml", "--out", "of-model"]);
    let (code, _, stderr) = bench.run(&["study", "run", "--out", "of-run"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("starting from the fit of this run"),
        "{stderr}"
    );
    let [of_model, of_run] = ["of-model", "of-run"].map(|folder| document(&bench, folder));
    for key in ["sensitivity", "bands", "extremes", "predictions"] {
        assert_eq!(of_model[key], of_run[key], "{key}");
    }
    // With other values the model is fitted again.
    let other = [
        "study",
        "run",
        "--out",
        "again",
        "--set",
        "functions.damping.start=0.2",
    ];
    let (code, _, stderr) = bench.run(&other);
    assert_eq!(code, 0, "{stderr}");
    assert!(!stderr.contains("starting from the fit"), "{stderr}");
}

/// The model file of a run is relative to the folder of the fit.
#[test]
fn a_run_of_another_folder() {
    let bench = bench();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    std::fs::rename(bench.path("model.yaml"), bench.path("moved.yaml")).expect("renamed");
    let (code, _, stderr) = bench.run(&["study", "run"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr, @"
    error: run/result.json: model.file: the model file of this run was not found
      found: `model.yaml`, relative to the current folder
      expected: the model file that was fitted
      hint: run this command in the folder in which the fit was started, or give the model file
    ");
    let (code, _, stderr) = bench.run(&["study", "runn"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr, @"
    error: runn: no such file
      expected: a model file or a sequence (YAML), or the folder of a finished run
      hint: did you mean `run`?
    ");
}

/// In an edited journal the edited analyses are computed again, without a panic.
#[test]
fn a_journal_of_another_shape() {
    let bench = Workbench::with_shipped_models();
    let run = ["study", "models/linear-mass.yaml", "--out", "run"];
    bench.run_to(0, &run);
    let (journal, study) = (
        bench.read("run/study.journal"),
        bench.read("run/study.json"),
    );
    for (from, to) in [
        ("\"parameters\":[", "\"parameters\":[1.0,"),
        ("\"sigmas\":[", "\"sigmas\":[1.0,"),
    ] {
        assert!(journal.contains(from), "{from}");
        bench.write("run/study.journal", &journal.replacen(from, to, 1));
        bench.run_to(0, &["resume", "run"]);
        assert_eq!(bench.read("run/study.json"), study, "{from}");
    }
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
