//! `kmcfit compare`: table, figures and page of several runs.

use crate::program::program;
use crate::workbench::{Workbench, column};
use insta::assert_snapshot;
use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;
use std::process::Stdio;
use std::time::{Duration, Instant};

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

/// The rows of a CSV file as maps from header to field.
fn records(text: &str) -> Vec<std::collections::BTreeMap<String, String>> {
    // An independent CSV reader removes the quotes.
    let lines = text.lines().map(|line| {
        let (mut fields, mut quoted) = (vec![String::new()], false);
        let mut letters = line.chars().peekable();
        while let Some(c) = letters.next() {
            match c {
                '"' if quoted && letters.peek() == Some(&'"') => {
                    letters.next();
                    fields.last_mut().expect("a field").push('"');
                }
                '"' => quoted = !quoted,
                ',' if !quoted => fields.push(String::new()),
                c => fields.last_mut().expect("a field").push(c),
            }
        }
        fields
    });
    let mut lines = lines.collect::<Vec<_>>().into_iter();
    let headers = lines.next().expect("a header");
    lines
        .map(|fields| {
            assert_eq!(fields.len(), headers.len());
            headers.iter().cloned().zip(fields).collect()
        })
        .collect()
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

#[test]
fn the_table() {
    let bench = bench();
    let names = ["compare", "constants.yaml", "twice.yaml", "free.yaml"];
    let stdout = bench.run_to(0, &names);
    let mut settings = insta::Settings::clone_current();
    settings.add_filter(r"(?m)^time \(s\) .*$", "time (s) [seconds]");
    // The remaining errors at the optimum depend on the machine.
    settings.add_filter(r"to \de-1\d", "to [tiny]");
    settings.add_filter(r" \de-1\d", "[tiny]");
    settings.add_filter(r"\d\.\d{3}e-1\d", "   [tiny]");
    settings.add_filter(r"\d\.\d{3}e-[6-9]", "  [tiny]");
    settings.add_filter(r"\d\.\de-([6-9]|1\d)", "[tiny]");
    settings.bind(|| {
        assert_snapshot!(stdout, @"
        constants: Constants
          true system recovered: relative error of k/m and c/m at most [tiny]
        twice: Twice the mass
          true system recovered: relative error of k/m and c/m at most [tiny]; m, c and k are scaled by a common factor (error of m 100 %)
        free: One value per step
          response fitted (J/J0 [tiny]), but not by the true system: error of k/m 77 %, error of c/m 1142 %

        model      parameters  log-likelihood  AICc     BIC - best  fit      validation fit  f_n, Hz (95 % CI)             zeta (95 % CI)
        twice      2           3291.4          -6578.8  0           100.0 %  –               0.15915 (0.15903 to 0.15928)  0.05 (0.0499769 to 0.0500231)
        constants  2           3102.7          -6201.3  +377.5      100.0 %  –               0.15915 (0.15903 to 0.15928)  0.05 (0.0499768 to 0.0500231)

        The data favour `twice` over `constants` decisively (difference of BIC 380).

                                             constants      twice       free
        status                               converged  converged  converged
        method                                   lbfgs      lbfgs      lbfgs
        nodes                                      200        200        200
        parameters                                   2          2        600
        misfit (m² s)                           [tiny]     [tiny]     [tiny]
        worst fit of a channel (%)               100.0      100.0      99.89
        J/J0                                    [tiny]     [tiny]     [tiny]
        log-likelihood                            3103       3291          –
        AICc                                     -6201      -6579          –
        BIC                                      -6195      -6572          –
        BIC - best                               377.5          0          –
        f_n (Hz)                                0.1592     0.1592     0.1492
          +- (95 %) (Hz)                      1.232e-4   1.232e-4          –
        zeta                                   0.05000    0.05000     0.3011
          +- (95 %)                           2.314e-5   2.314e-5          –
        iterations                                   9          7         69
        time (s) [seconds]
        max error of m (kg)                          0      1.000      1.926
          of c (N s/m)                          [tiny]     0.1000      1.259
          of k (N/m)                            [tiny]      1.000     0.9349
          of k/m (1/s²)                         [tiny]     [tiny]     0.7749
          of c/m (1/s)                          [tiny]     [tiny]      1.142
        smallest m (kg)                          1.000      2.000      1.031
        smallest c (N s/m)                      0.1000     0.2000     0.1152
        largest violation (relative)                 0          0          0
        ∫(m″)² dt (kg²/s³)                           0          0      231.0
        ∫(c′)² dt (N² s/m²)                          0          0      6.914
        ∫(k′)² dt (N²/(m² s))                        0          0      3.845
        cost (m² s) from y = 0 m, v = 1 m/s     [tiny]     [tiny]      1.576

        results in runs/compare, the page is runs/compare/compare.html
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
    for file in [
        "both/compare.csv",
        "both/compare.html",
        "both/constants/result.json",
        "both/constants/figures/motion.svg",
        "both/free/trajectory.csv",
        "both/figures/functions.svg",
        "both/figures/ratios.svg",
        "both/figures/residuals.svg",
        "both/figures/convergence.svg",
    ] {
        assert!(bench.path(file).is_file(), "{file}");
    }
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

    let csv = bench.read("both/compare.csv");
    assert_snapshot!(csv.lines().next().expect("a header").replace(',', "\n"), @"
    name
    title
    status
    method
    nodes
    parameters
    misfit
    misfit_unit
    worst_fit_percent
    cost_ratio
    validation_fit_percent
    log_likelihood
    aicc
    bic
    bic_difference
    natural_frequency_Hz
    natural_frequency_half_width_Hz
    damping_ratio
    damping_ratio_half_width
    iterations
    seconds_s
    mass_error_kg
    damping_error_N_s_per_m
    stiffness_error_N_per_m
    k_over_m_error_per_s2
    c_over_m_error_per_s
    k_over_m_relative_error
    c_over_m_relative_error
    mass_min_kg
    damping_min_N_s_per_m
    max_violation
    mass_roughness_kg2_per_s3
    damping_roughness_N2_s_per_m2
    stiffness_roughness_N2_per_m2_s
    cost_from_0_m_1_m_per_s_m2_s
    verdict
    ");
    let records = records(&csv);
    let result = json(&bench.read("both/free/result.json"));
    assert_eq!(records.len(), 2);
    assert_eq!(records[1]["name"], "free");
    assert_eq!(records[1]["status"], "converged");
    let number = |header: &str| records[1][header].parse::<f64>().ok();
    assert_eq!(number("misfit"), result["cost"]["misfit"].as_f64());
    assert_eq!(number("cost_ratio"), result["cost"]["ratio"].as_f64());
    assert_eq!(number("seconds_s"), result["seconds"].as_f64());
    let mass = &result["functions"]["mass"];
    assert_eq!(number("mass_min_kg"), mass["min"].as_f64());
    assert_eq!(number("mass_error_kg"), mass["truth_max_error"].as_f64());
    let predicted = result["predictions"][0]["cost"].as_f64();
    assert_eq!(number("cost_from_0_m_1_m_per_s_m2_s"), predicted);
    assert_eq!(records[1]["max_violation"], "0");
}

#[test]
fn as_json() {
    let bench = bench();
    let stdout = bench.run_to(0, &["compare", "constants.yaml", "twice.yaml", "--json"]);
    let found = json(&stdout);
    assert_eq!(found["format"], 1);
    assert_eq!(found["left_out"], json("[]"));
    for (run, name) in [(0, "constants"), (1, "twice")] {
        assert_eq!(found["runs"][run]["name"], name);
        assert_eq!(found["runs"][run]["is_true_system"], true);
    }
    assert!(
        found["runs"][1]["errors"]["mass_relative"]
            .as_f64()
            .expect("a number")
            > 0.99
    );
}

/// A finished run is only read: its folder does not change, and it is not fitted again.
#[test]
fn models_and_finished_runs() {
    let bench = bench();
    bench.run_to(0, &["fit", "free.yaml"]);
    let result = bench.read("runs/free/result.json");
    let doctored = result.replacen("\"seconds\": ", "\"seconds\": 1000", 1);
    let violated = doctored
        .trim_end()
        .trim_end_matches('}')
        .trim_end()
        .to_owned()
        + ",\n  \"constraints\": {\"max_violation\": 0.25}\n}\n";
    bench.write("runs/free/result.json", &violated);
    bench.run_to(0, &["compare", "runs/free/", "constants.yaml"]);
    assert_eq!(bench.read("runs/free/result.json"), violated);
    let records = records(&bench.read("runs/compare/compare.csv"));
    assert_eq!(records[0]["name"], "free");
    assert!(records[0]["seconds_s"].parse::<f64>().expect("a number") > 999.0);
    assert_eq!(records[0]["max_violation"], "0.25");
    assert_eq!(records[1]["name"], "constants");
    assert!(!bench.path("runs/compare/free").exists());
}

#[test]
fn equal_names() {
    let bench = bench();
    for folder in ["a", "b"] {
        for file in ["constants.yaml", "samples.csv", "truth.csv"] {
            bench.write(&format!("{folder}/{file}"), &bench.read(file));
        }
    }
    bench.write("figures.yaml", &bench.read("constants.yaml"));
    let arguments = [
        "compare",
        "a/constants.yaml",
        "b/constants.yaml",
        "figures.yaml",
    ];
    bench.run_to(0, &arguments);
    for name in ["constants", "constants-2", "figures-2"] {
        assert!(
            bench
                .path(&format!("runs/compare/{name}/result.json"))
                .exists()
        );
    }
    // A finished run within the output folder is compared, not overwritten.
    let before = bench.read("runs/compare/constants/result.json");
    bench.run_to(
        0,
        &[
            "compare",
            "twice.yaml",
            "runs/compare/constants",
            "a/constants.yaml",
        ],
    );
    bench.run_to(
        0,
        &["compare", "a/constants.yaml", "runs/compare/constants"],
    );
    assert_eq!(bench.read("runs/compare/constants/result.json"), before);
}

#[test]
fn an_invalid_argument_ends_a_comparison_before_its_first_fit() {
    let bench = bench();
    bench.write(
        "bad.yaml",
        &bench.read("free.yaml").replace("nodal", "nodel"),
    );
    bench.write("empty/note.txt", "no run");
    let refused = |last: &str| {
        let before = bench.contents();
        let (code, stdout, stderr) = bench.run(&["compare", "constants.yaml", last]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{last}: {stderr}");
        assert_eq!(bench.contents(), before, "{last} left something");
        stderr
    };
    let stderr = refused("bad.yaml");
    assert!(stderr.starts_with("error: bad.yaml:10:"), "{stderr}");
    assert_snapshot!(refused("constant.yaml"), @"
    error: constant.yaml: no such file
      expected: a model file (YAML), or the folder of a finished run
      hint: did you mean `constants.yaml`?
    ");
    assert_snapshot!(refused("empty"), @"
    error: empty/result.json: no such file
      expected: the result of a finished run
    ");
    bench.run_to(0, &["fit", "constants.yaml"]);
    assert_snapshot!(refused("runs/constants/result.json"), @"
    error: runs/constants/result.json: a result file in place of a model file
      expected: a model file (YAML), or the folder of a finished run
      hint: give its folder: runs/constants
    ");
    assert_eq!(bench.run(&["compare"]).0, 2);
}

/// Twice the nodes, every second one with a sample: each run is drawn on its own times.
#[test]
fn different_grids() {
    let bench = bench();
    bench.write("fine.yaml", &model("Fine", 399, CONSTANTS, LOOSE));
    bench.run_to(0, &["compare", "constants.yaml", "fine.yaml"]);
    let records = records(&bench.read("runs/compare/compare.csv"));
    let nodes: Vec<&str> = records.iter().map(|r| r["nodes"].as_str()).collect();
    assert_eq!(nodes, ["200", "399"]);
    with_page(&bench, "runs/compare/compare.html", |page| {
        let text = text_of(page.root_element());
        assert!(!text.contains("truth of"), "one truth on two grids");
    });
}

#[test]
fn the_page() {
    let bench = bench();
    let hostile = "'<script>alert(1)</script>&\" =HYPERLINK'";
    bench.write("hostile.yaml", &model(hostile, 200, CONSTANTS, LOOSE));
    let stdout = bench.run_to(0, &["compare", "hostile.yaml", "twice.yaml", "free.yaml"]);
    assert!(stdout.contains("hostile: <script>alert(1)</script>&\" =HYPERLINK\n"));
    let records = records(&bench.read("runs/compare/compare.csv"));
    assert_eq!(
        records[0]["title"],
        "<script>alert(1)</script>&\" =HYPERLINK"
    );
    with_page(&bench, "runs/compare/compare.html", |page| {
        let all = |name: &'static str| page.descendants().filter(move |n| n.has_tag_name(name));
        let text = text_of(page.root_element());
        assert!(text.contains("<script>alert(1)</script>&\" =HYPERLINK"));
        assert!(text.contains("2 of the 3 runs with a known true system recover it."));
        for run in &records {
            assert!(text.to_lowercase().contains(&run["verdict"].to_lowercase()));
        }
        assert_eq!(
            all("div")
                .filter(|n| n.attribute("class") == Some("run"))
                .count(),
            3
        );
        // The main figure, and those of the sections.
        assert_eq!(all("figure").count(), 5);
        for figure in all("figure") {
            assert!(figure.descendants().any(|n| n.has_tag_name("figcaption")));
            let drawings: Vec<Node> = (figure.descendants())
                .filter(|n| n.has_tag_name("svg"))
                .collect();
            assert_eq!(drawings.len(), 1);
            for svg in drawings {
                let described = |tag: &str| {
                    svg.children()
                        .any(|n| n.has_tag_name(tag) && n.text().is_some())
                };
                assert_eq!(svg.attribute("role"), Some("img"));
                assert!(described("title") && described("desc"));
            }
        }
        let heads: Vec<String> = all("thead")
            .map(|head| {
                head.descendants()
                    .filter(|n| n.has_tag_name("th"))
                    .map(text_of)
                    .collect::<Vec<_>>()
                    .join(", ")
            })
            .collect();
        assert_eq!(heads[1], "quantity, hostile, twice, free");
    });
}

/// A run keeps its colour in every figure, in the legend and in the table.
#[test]
fn colours() {
    let bench = bench();
    bench.run_to(0, &["compare", "constants.yaml", "free.yaml"]);
    for figure in ["functions", "ratios", "residuals", "convergence"] {
        let svg = bench.read(&format!("runs/compare/figures/{figure}.svg"));
        let document = Document::parse(&svg).expect("XML");
        let strokes: Vec<&str> = (document.descendants())
            .filter_map(|n| n.attribute("stroke"))
            .collect();
        assert!(
            strokes.contains(&"#0072B2") && strokes.contains(&"#D55E00"),
            "{figure}"
        );
    }
}

#[test]
fn a_run_that_does_not_converge() {
    let bench = bench();
    let early = "{method: lbfgs, stop: {iterations: 3, cost_ratio: 1e-9}}";
    bench.write("early.yaml", &model("Early", 200, FREE, early));
    let stdout = bench.run_to(3, &["compare", "early.yaml", "constants.yaml"]);
    assert!(stdout.contains("response not fitted"), "{stdout}");
    assert!(bench.path("runs/compare/constants/result.json").exists());
}

/// A run that cannot begin is listed with its reason; the others are compared.
#[test]
fn a_run_without_motion() {
    let bench = bench();
    let heavy = FREE.replace("start: 2.0", "start: 1e-200");
    bench.write("heavy.yaml", &model("No motion", 200, &heavy, LOOSE));
    let (code, stdout, stderr) = bench.run(&["compare", "heavy.yaml", "constants.yaml"]);
    assert_eq!(code, 3);
    assert!(
        stderr.starts_with("failed: heavy: the start cannot be evaluated"),
        "{stderr}"
    );
    assert!(
        stdout.contains("heavy: no result\n  the start cannot be evaluated"),
        "{stdout}"
    );
    assert_eq!(records(&bench.read("runs/compare/compare.csv")).len(), 1);
    with_page(&bench, "runs/compare/compare.html", |page| {
        assert!(text_of(page.root_element()).contains("no result: the start cannot be evaluated"));
    });
}

/// With a sigma the misfit is a chi-square and is assessed against the noise; without a known true system no agreement with it
/// is reported.
#[test]
fn noise_and_no_truth() {
    let bench = bench();
    let noise = ["--noise", "0.05", "--seed", "1", "--out", "samples.csv"];
    bench.run_to(0, &[&["simulate", "device.yaml"][..], &noise].concat());
    let loose = "{method: lbfgs, stop: {iterations: 100, tolerance: 1e-10}}";
    let noisy = model("Noisy", 200, CONSTANTS, loose).replace(
        "    initial",
        "    sigma: {displacement: 0.05}\n    initial",
    );
    bench.write("noisy.yaml", &noisy);
    bench.write(
        "blind.yaml",
        &noisy.replace("truth: {data: truth.csv}\n", ""),
    );
    bench.run_to(0, &["compare", "noisy.yaml", "blind.yaml"]);
    let records = records(&bench.read("runs/compare/compare.csv"));
    assert_eq!(records[0]["misfit_unit"], "1");
    let [noisy, blind] = [0, 1].map(|i| records[i]["verdict"].as_str());
    assert!(noisy.starts_with("close to the true system: "), "{noisy}");
    assert!(noisy.contains("within the noise (chi-square "), "{noisy}");
    assert!(blind.ends_with("; true system not known"), "{blind}");
    assert_eq!(records[1]["mass_error_kg"], "");
}

/// Ctrl-C keeps the finished runs, and the best point of the interrupted one.
#[test]
#[cfg(unix)]
fn interrupt() {
    let bench = bench();
    let endless = "{method: steepest-descent, stop: {iterations: 100000000}}";
    bench.write("endless.yaml", &model("Endless", 200, FREE, endless));
    let arguments = ["compare", "constants.yaml", "endless.yaml", "twice.yaml"];
    let child = std::process::Command::new(program())
        .args(arguments)
        .current_dir(bench.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let begin = Instant::now();
    while !bench.path("runs/compare/constants/result.json").exists() {
        assert!(
            begin.elapsed() < Duration::from_secs(60),
            "nothing is finished"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(200));
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill runs");
    assert!(killed.success());
    let output = child.wait_with_output().expect("the program ends");
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(
        stdout.contains("twice: no result\n  not started: interrupted"),
        "{stdout}"
    );
    let records = records(&bench.read("runs/compare/compare.csv"));
    let statuses: Vec<&str> = records.iter().map(|r| r["status"].as_str()).collect();
    assert_eq!(statuses, ["converged", "interrupted"]);
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

/// `--set` applies to every model file.
#[test]
fn overrides_apply_to_all_models() {
    let bench = Workbench::with_small_model();
    bench.write("other.yaml", &bench.read("model.yaml"));
    let compare = [
        "compare",
        "model.yaml",
        "other.yaml",
        "--set",
        "fit.stop.iterations=3",
        "--json",
    ];
    let found: Value = serde_json::from_str(&bench.run_to(0, &compare)).expect("JSON");
    for i in 0..2 {
        assert_eq!(found["runs"][i]["iterations"], 3);
    }
    let (code, _, stderr) = bench.run(&[
        "compare",
        "runs/compare/model",
        "--set",
        "fit.stop.iterations=3",
    ]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr);
}

/// The page of ranked models leads with the best one, its table has the numbers of the document, and each model's prediction of the validation
/// record is drawn beside the samples.
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
        let table = class("stack");
        let rows: Vec<Vec<String>> = (table.descendants().filter(|n| n.has_tag_name("tr")))
            .map(|row| {
                row.children()
                    .map(|cell| text_of(cell).trim().to_owned())
                    .collect()
            })
            .collect();
        let names: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
        assert_eq!(names, ["model", "constant", "varying"]);
        let place = rows[0].iter().position(|heading| heading == "BIC - best");
        let place = place.expect("the column");
        let stored = document["runs"][0]["bic_difference"]
            .as_f64()
            .expect("a number");
        let shown: f64 = rows[2][place].parse().expect("a number");
        // One decimal place is shown.
        assert!((shown - stored).abs() <= 0.051, "{shown} {stored}");
        let figure = page
            .descendants()
            .find(|n| n.attribute("id") == Some("figure-validation"));
        let script = figure.and_then(|f| f.children().find(|n| n.has_tag_name("script")));
        let drawn: Value =
            serde_json::from_str(&text_of(script.expect("the numbers"))).expect("JSON");
        let panel = &drawn["panels"][0];
        assert_eq!(panel["title"], "second <b>");
        let labels: Vec<&str> = (panel["marks"].as_array().expect("marks").iter())
            .filter_map(|mark| mark["label"].as_str())
            .collect();
        assert_eq!(labels, ["measured", "varying", "constant"]);
        let stored = bench.read("runs/compare/varying/channels/validation-1-displacement.csv");
        let stored = column(&stored, "predicted");
        let shown = panel["marks"][1]["y"].as_array().expect("numbers");
        assert_eq!(shown.len(), stored.len());
        for (shown, stored) in shown.iter().zip(&stored) {
            // Charts have six digits.
            assert!((shown.as_f64().expect("a number") - stored).abs() < 1e-5);
        }
    });
}
