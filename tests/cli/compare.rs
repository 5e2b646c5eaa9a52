//! `kmcfit compare`: table and page of several runs.

use crate::workbench::{Workbench, column};
use insta::assert_snapshot;
use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;

/// A model of the damped system below: `functions` and `fit` as given.
fn model(title: &str, nodes: usize, functions: &str, fit: &str) -> String {
    format!(
        "format: 1
title: {title}
experiments:
  - name: free decay
    data: samples.csv
    columns: {{time: t_s, displacement: y_m}}
    initial: {{displacement: 1.0, velocity: 0.5}}
grid: {{nodes: {nodes}, method: midpoint}}
functions:
{functions}
fit: {fit}
truth: {{data: truth.csv}}
predict:
  - {{displacement: 0.0, velocity: 1.0}}
"
    )
}

const DEVICE: &str = "format: 1
experiments:
  - initial: {displacement: 1.0, velocity: 0.5}
grid: {nodes: 200, method: midpoint, duration: 10.0}
functions:
  mass: {fixed: 1.0}
  damping: {fixed: 0.1}
  stiffness: {fixed: 1.0}
";

const CONSTANTS: &str = "  mass: {fixed: 1.0}
  damping: {basis: constant, start: 0.3}
  stiffness: {basis: constant, start: 1.2}";

const TWICE: &str = "  mass: {fixed: 2.0}
  damping: {basis: constant, start: 0.3}
  stiffness: {basis: constant, start: 1.5}";

const FREE: &str = "  mass: {basis: nodal, start: 2.0}
  damping: {basis: nodal, start: 1.0}
  stiffness: {basis: nodal, start: 1.0}";

const TO_THE_END: &str = "{method: lbfgs, stop: {iterations: 200, cost_ratio: 1e-12}}";
const LOOSE: &str = "{method: lbfgs, stop: {iterations: 400, cost_ratio: 1e-6}}";

/// Samples of a damped system with 200 nodes over 10 s, its truth, and models of it:
/// `constants`, `twice` the mass, and one value per step in `free`.
fn bench() -> Workbench {
    let bench = Workbench::empty();
    bench.write("device.yaml", DEVICE);
    bench.run_to(0, &["simulate", "device.yaml", "--out", "samples.csv"]);
    bench.write(
        "truth.csv",
        "t_s,mass_kg,damping_N_s_per_m,stiffness_N_per_m\n0,1,0.1,1\n10,1,0.1,1\n",
    );
    let write = |name: &str, text: &str| bench.write(&format!("{name}.yaml"), text);
    write("constants", &model("Constants", 200, CONSTANTS, TO_THE_END));
    write("twice", &model("Twice the mass", 200, TWICE, TO_THE_END));
    write("free", &model("One value per step", 200, FREE, LOOSE));
    bench
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// The page, which must be well-formed and self-contained; `tests/page` tests its contents.
fn with_page(bench: &Workbench, file: &str, look: impl Fn(&Document)) {
    let html = bench.read(file);
    for forbidden in [
        "http:",
        "https:",
        "src=",
        "href=\"/",
        "@import",
        "<script>alert",
    ] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    let options = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    let page = Document::parse_with_options(&html, options).expect("well-formed");
    look(&page);
}

fn text_of(node: Node) -> String {
    let texts = node.descendants().filter(Node::is_text);
    texts.filter_map(|n| n.text()).collect()
}

/// The table has a row for each run: verdict, criteria, fit, estimates and errors; without a known true system and without validation
/// records it has no columns for them.
#[test]
fn the_table() {
    let bench = bench();
    let stdout = bench.run_to(0, &["compare", "constants.yaml", "twice.yaml", "free.yaml"]);
    let mut settings = insta::Settings::clone_current();
    // Likelihoods of rounding errors depend on the machine.
    settings.add_filter(r" (-?\d{4}|\+\d{3})\.\d\b", " [likelihood]");
    settings.add_filter(r"difference of BIC \d+", "difference of BIC [size]");
    settings.add_filter(r" {2,}", "  ");
    settings.bind(|| {
        assert_snapshot!(stdout, @"
        model  verdict  parameters  log-likelihood  AICc  BIC - best  fit  f_n, Hz (95 % CI)  zeta (95 % CI)  error of k/m  error of c/m  error of m
        constants  Check  2  [likelihood]  [likelihood]  [likelihood]  100.0 %  0.15915 (0.15903 to 0.15928)  0.050000 (0.049977 to 0.050023)  < 0.01 %  < 0.01 %  < 0.01 %
        twice  Check  2  [likelihood]  [likelihood]  0  100.0 %  0.15915 (0.15903 to 0.15928)  0.050000 (0.049977 to 0.050023)  < 0.01 %  < 0.01 %  100 %
        free  Check  600  –  –  –  99.9 %  0.1492  0.3011  77 %  1100 %  190 %

        The data favour `twice` over `constants` decisively (difference of BIC [size]).

        Page  runs/compare/compare.html
        ");
    });
}

#[test]
fn files() {
    let bench = bench();
    bench.run_to(
        0,
        &["compare", "constants.yaml", "free.yaml", "--out", "both"],
    );
    // The folder of a run has the files that `fit` writes.
    bench.run_to(0, &["fit", "constants.yaml", "--out", "alone"]);
    for file in [
        "functions.csv",
        "trajectory.csv",
        "history.csv",
        "figures/motion.svg",
    ] {
        assert_eq!(
            bench.read(&format!("both/constants/{file}")),
            bench.read(&format!("alone/{file}"))
        );
    }
    // A run keeps its colour in every figure.
    let svg = bench.read("both/figures/functions.svg");
    assert!(svg.contains("#0072B2") && svg.contains("#D55E00"));
}

/// A finished run is only read: its folder does not change, and it is not fitted again.
#[test]
fn models_and_finished_runs() {
    let bench = bench();
    bench.run_to(0, &["fit", "free.yaml"]);
    let result = bench.read("runs/free/result.json");
    let doctored = result.replacen("\"seconds\": ", "\"seconds\": 1000", 1);
    bench.write("runs/free/result.json", &doctored);
    let arguments = ["compare", "runs/free/", "constants.yaml", "--json"];
    let found = json(&bench.run_to(0, &arguments));
    assert_eq!(bench.read("runs/free/result.json"), doctored);
    assert_eq!(found["runs"][0]["name"], "free");
    assert!(found["runs"][0]["seconds"].as_f64() > Some(999.0));
    assert_eq!(found["runs"][1]["name"], "constants");
    assert!(!bench.path("runs/compare/free").exists());
}

/// Titles and names are texts in table, CSV and page, which loads nothing.
#[test]
fn the_page() {
    let bench = bench();
    let hostile = "'<script>alert(1)</script>&\" =HYPERLINK'";
    bench.write("hostile.yaml", &model(hostile, 200, CONSTANTS, LOOSE));
    bench.run_to(0, &["compare", "hostile.yaml", "twice.yaml", "free.yaml"]);
    with_page(&bench, "runs/compare/compare.html", |page| {
        assert_eq!(
            page.descendants()
                .filter(|n| n.has_tag_name("figure"))
                .count(),
            1
        );
        let rows = page.descendants().filter(|n| n.has_tag_name("tr")).count();
        assert_eq!(rows, 4);
    });
}

/// The criteria of a comparison follow from the residuals in the tables, and a linear spring is rejected within a cubic one.
#[test]
fn models_are_selected_by_their_likelihood() {
    let bench = Workbench::with_shipped_models();
    let model = bench.read("models/duffing.yaml");
    let lines = model
        .lines()
        .filter(|line| !line.contains("cubic_stiffness"));
    let linear: Vec<&str> = lines.collect();
    bench.write("models/linear.yaml", &(linear.join("\n") + "\n"));
    let compare = ["compare", "models/duffing.yaml", "models/linear.yaml"];
    let found: Value =
        serde_json::from_str(&bench.run_to(0, &[&compare[..], &["--json"]].concat()))
            .expect("JSON");
    let number = |pointer: &str| {
        found
            .pointer(pointer)
            .and_then(Value::as_f64)
            .expect(pointer)
    };
    for (i, name) in ["duffing", "linear"].into_iter().enumerate() {
        let text = bench.read(&format!("runs/compare/{name}/channels/1-displacement.csv"));
        let residuals = column(&text, "residual");
        let n = residuals.len() as f64;
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let expected = -0.5 * n * ((std::f64::consts::TAU * squares / n).ln() + 1.0);
        let result: Value =
            serde_json::from_str(&bench.read(&format!("runs/compare/{name}/result.json")))
                .expect("JSON");
        let noise = result.pointer("/experiments/0/channels/0/noise");
        if noise.is_some() {
            // Autocorrelated residuals have another likelihood.
            continue;
        }
        let likelihood = number(&format!("/runs/{i}/likelihood/log_likelihood"));
        assert!(
            (likelihood - expected).abs() < 1e-6 * expected.abs(),
            "{name}"
        );
        let k = number(&format!("/runs/{i}/parameters"));
        let bic = number(&format!("/runs/{i}/likelihood/bic"));
        assert!((bic - (k * n.ln() - 2.0 * expected)).abs() < 1e-6 * bic.abs());
        let aicc = number(&format!("/runs/{i}/likelihood/aicc"));
        let correction = 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0);
        assert!((aicc - (correction - 2.0 * expected)).abs() < 1e-6 * aicc.abs());
    }
    assert_eq!(number("/runs/0/bic_difference"), 0.0);
    assert!(number("/runs/1/bic_difference") > 10.0);
    let said = bench.run_to(0, &compare);
    assert!(
        said.contains("The data favour `duffing` over `linear` decisively"),
        "{said}"
    );
    assert!(said.contains("BIC - best"), "{said}");
}

/// The page of ranked models leads with the best one, and draws each model's prediction of the validation record beside the samples.
#[test]
fn ranked_models_and_their_predictions() {
    let bench = Workbench::empty();
    let mut samples = String::from("t_s,y_m\n");
    for i in 0..201 {
        let t = 0.05 * f64::from(i);
        // Deterministic noise: tones that no system of the models contains.
        let noise = 0.01 * ((37.0 * t).sin() + (53.0 * t + 1.0).cos() + (71.0 * t).sin());
        let y = (-0.1 * t).exp() * (1.99 * t).cos() + noise;
        samples += &format!("{t},{y}\n");
    }
    bench.write("samples.csv", &samples);
    let record = "data: samples.csv, sigma: {displacement: 0.02}, initial: {displacement: 1.0, velocity: 0.0}";
    for (name, stiffness) in [
        ("varying", "{basis: piecewise-linear, knots: 5, start: 4.0}"),
        ("constant", "{basis: constant, start: 4.0}"),
    ] {
        let model = format!(
            "format: 1
experiments:
  - {{name: first, {record}}}
  - {{name: 'second <b>', validation: true, {record}}}
functions:
  mass: {{fixed: 1.0}}
  damping: {{basis: constant, start: 0.1}}
  stiffness: {stiffness}
"
        );
        bench.write(&format!("{name}.yaml"), &model);
    }
    let (_, stdout, stderr) = bench.run(&["compare", "varying.yaml", "constant.yaml", "--json"]);
    let document: Value = serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{e}: {stderr}"));
    with_page(&bench, "runs/compare/compare.html", |page| {
        let class = |name: &'static str| {
            let found = page
                .descendants()
                .find(|n| n.attribute("class") == Some(name));
            found.unwrap_or_else(|| panic!("{name}"))
        };
        assert_eq!(text_of(class("state good")), "Best: constant");
        let figure = page
            .descendants()
            .find(|n| n.attribute("id") == Some("figure-validation"));
        let figure = figure.expect("the figure");
        let labels: Vec<&str> = (figure.descendants())
            .filter_map(|n| n.attribute("data-label"))
            .collect();
        assert_eq!(labels, ["measured", "varying", "constant"]);
        assert!(text_of(figure).contains("second <b>"));
    });
    assert!(
        document["runs"][0]["bic_difference"].as_f64() > Some(2.0),
        "{document}"
    );
}

/// Runs of another content of the same file are not ranked, whatever the kind of their samples.
#[test]
fn a_file_that_changed_is_another_record() {
    let bench = bench();
    bench.run_to(0, &["fit", "constants.yaml", "--out", "before"]);
    let samples = bench.read("samples.csv");
    let ranked = bench.run_to(0, &["compare", "before", "twice.yaml"]);
    assert!(ranked.contains("The data favour"), "{ranked}");
    bench.write("samples.csv", &format!("# measured again\n{samples}"));
    let (_, stdout, stderr) = bench.run(&["compare", "before", "twice.yaml"]);
    assert!(stdout.contains("different records"), "{stdout}{stderr}");
}
