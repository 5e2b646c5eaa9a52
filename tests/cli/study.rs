//! `kmcfit study`: analyses of a fit.

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
        // Uniform pseudorandom noise.
        let noise = 0.035 * ((12.9898 * f64::from(i)).sin() * 43_758.545).fract();
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
      expected: a model file (YAML)
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

/// A record of 40 s of a mass that falls linearly from 50 to 38 kg on a spring of 2000 N/m.
fn falling_mass() -> String {
    let step = 0.005;
    let slope = |t: f64, y: f64, v: f64| [v, -(2000.0 * y + 4.0 * v) / (50.0 - 0.3 * t)];
    let (mut y, mut v) = (0.1, 0.0);
    let mut text = String::from("t_s,y_m\n");
    for i in 0..=8000 {
        let t = step * f64::from(i);
        if i % 4 == 0 {
            let x = (f64::from(i) * 12.9898 + 4.1).sin() * 43_758.545_3;
            text += &format!("{t:.2},{}\n", y + 2e-3 * (x - x.floor() - 0.5));
        }
        let a = slope(t, y, v);
        let b = slope(t + 0.5 * step, y + 0.5 * step * a[0], v + 0.5 * step * a[1]);
        let c = slope(t + 0.5 * step, y + 0.5 * step * b[0], v + 0.5 * step * b[1]);
        let d = slope(t + step, y + step * c[0], v + step * c[1]);
        y += step / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
        v += step / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
    }
    text
}

/// On 6001 nodes the bands have every second node; the means of functions and ratios are those of the estimates of the fit, with their
/// intervals, whether the model or its run is studied.
#[test]
fn a_study_has_the_means_of_the_fit() {
    let bench = Workbench::empty();
    bench.write("samples.csv", &falling_mass());
    bench.write(
        "model.yaml",
        "format: 1\nexperiments:\n  - data: samples.csv\n    sigma: {displacement: estimate}\n    initial: estimate\n\
         grid: {nodes: 6001}\nfunctions:\n  mass: {basis: polynomial, degree: 1, start: 45.0, min: 1.0}\n  \
         damping: {basis: constant}\n  stiffness: {fixed: 2000.0}\n",
    );
    bench.run_to(0, &["fit", "model.yaml", "--no-report"]);
    let fit: Value = serde_json::from_str(&bench.read("runs/model/result.json")).expect("JSON");
    for studied in ["model.yaml", "runs/model"] {
        let text = bench.run_to(0, &["study", studied, "--out", "studied"]);
        let study = document(&bench, "studied");
        let bands = study["bands"]["bands"].as_array().expect("bands");
        for (name, of_fit) in [
            ("mass", "mass"),
            ("damping", "damping"),
            ("k/m", "k_over_m"),
            ("c/m", "c_over_m"),
            ("natural frequency", "natural_frequency"),
            ("damping ratio", "damping_ratio"),
        ] {
            let band = bands.iter().find(|band| band["name"] == name).expect(name);
            let estimate = &fit["estimates"][of_fit];
            let number = |value: &Value| value.as_f64().expect(name);
            let ends = |value: &Value| [number(&value[0]), number(&value[1])];
            let [low, high] = ends(&estimate["ci95"]);
            let error = 0.25 * (high - low);
            let off = number(&band["mean"]) - number(&estimate["value"]);
            assert!(
                off.abs() < 1e-3 * error,
                "{studied}, {name}: {off} of {error}"
            );
            let [from, to] = ends(&band["mean_95"]);
            assert!(
                (from - low).abs() < 1e-3 * error && (to - high).abs() < 1e-3 * error,
                "{name}"
            );
        }
        // The mean over the record, exactly 44 kg, in the text.
        assert!(text.contains("mass: mean 4"), "{text}");
    }
}
