//! `kmcfit simulate`: responses with reproducible noise.

use crate::workbench::{MODEL, Workbench, column};
use serde_json::Value;

const SIGMA: f64 = 0.1;

fn noisy(bench: &Workbench, seed: &str, out: &str) -> String {
    let model = ["simulate", "models/paper-device.yaml", "--noise", "0.1"];
    bench.run_to(0, &[&model[..], &["--seed", seed, "--out", out]].concat());
    bench.read(out)
}

#[test]
fn equal_seeds_give_equal_noise() {
    let bench = Workbench::with_shipped_models();
    let first = noisy(&bench, "7", "a.csv");
    assert!(first == noisy(&bench, "7", "b.csv"));
    assert!(first != noisy(&bench, "8", "c.csv"));
    assert_eq!(bench.read("a.csv.json"), bench.read("b.csv.json"));
}

#[test]
fn the_noise_has_the_given_standard_deviation() {
    let bench = Workbench::with_shipped_models();
    let clean = column(&bench.read("data/paper.csv"), "y_m");
    let noisy = column(&noisy(&bench, "1", "a.csv"), "y_m");
    let noise: Vec<f64> = noisy.iter().zip(&clean).map(|(a, b)| a - b).collect();
    let mean = noise.iter().sum::<f64>() / noise.len() as f64;
    let squares = noise.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let deviation = (squares / (noise.len() - 1) as f64).sqrt();
    assert!((deviation / SIGMA - 1.0).abs() < 0.05, "{deviation}");
    // Four standard errors.
    assert!(
        mean.abs() < 4.0 * SIGMA / (noise.len() as f64).sqrt(),
        "{mean}"
    );
}

#[test]
fn the_provenance_file_reproduces_the_record() {
    let bench = Workbench::with_shipped_models();
    // More digits than a double has: a seed must not be rounded.
    noisy(&bench, "9007199254740993", "deep/a.csv");
    let record: Value = serde_json::from_str(&bench.read("deep/a.csv.json")).expect("JSON");
    assert_eq!(record["made_by"], "kmcfit simulate");
    assert_eq!(record["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(record["model"], "models/paper-device.yaml");
    assert_eq!(record["experiment"], "free decay");
    assert_eq!(record["nodes"], 2000);
    assert_eq!(record["noise"]["sigma"], 0.1);
    assert_eq!(record["noise"]["seed"], 9_007_199_254_740_993_u64);
}

/// With the table on standard output there is no provenance file: the seed is reported on standard error.
#[test]
fn samples_on_standard_output_report_their_seed() {
    let bench = Workbench::with_shipped_models();
    let model = ["simulate", "models/paper-device.yaml"];
    let (code, stdout, stderr) = bench.run(&model);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout == bench.read("data/paper.csv"));
    let (code, stdout, stderr) =
        bench.run(&[&model[..], &["--noise", "0.1", "--seed", "7"]].concat());
    assert_eq!(code, 0);
    assert!(stdout == noisy(&bench, "7", "a.csv"));
    assert_eq!(stderr, "noise: sigma 0.1 m, seed 7\n");
}

/// Steps of 0.1 s let an oscillation at 22 rad/s grow: a simulation is refused, a search, which may leave its start, has a note; automatic grids
/// do not, nor does the equation error, which needs no response.
#[test]
fn unstable_steps_are_refused() {
    let bench = Workbench::with_small_model();
    let stiff = MODEL.replace(
        "{basis: nodal, start: 1.0}",
        "{basis: nodal, start: 1.0e+3}",
    );
    bench.write("stiff.yaml", &stiff);
    let (_, _, stderr) = bench.run(&["check", "stiff.yaml"]);
    let note = "grid: with 21 nodes the steps are unstable at the start values of the functions; at least 26 nodes have stable ones";
    assert!(stderr.contains(note), "{stderr}");
    let (code, stdout, stderr) = bench.run(&["simulate", "stiff.yaml", "--nodes", "21"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    insta::assert_snapshot!(stderr, @"
    error: --nodes: the steps are unstable at the start values of the functions
      found: 21 nodes, steps of 0.1 s
      expected: at least 26 nodes
      hint: a response to these steps grows, whatever the system does
    ");
    bench.run_to(0, &["simulate", "stiff.yaml", "--nodes", "26"]);
    // Fixed functions have no other start; without a number there is one node for each sample.
    let fixed = ["2.0", "1.0", "1.0e+3"].map(|value| format!("{{fixed: {value}}}"));
    let names = ["mass:      ", "damping:   ", "stiffness: "];
    let of = |line: &str| {
        names
            .iter()
            .position(|name| line.trim_start().starts_with(name))
    };
    let lines = stiff.replace("nodes: 21, ", "");
    let lines = lines.lines().map(|line| match of(line) {
        Some(i) => format!("  {}{}\n", names[i], fixed[i]),
        None => format!("{line}\n"),
    });
    bench.write("fixed.yaml", &lines.collect::<String>());
    let (code, _, stderr) = bench.run(&["fit", "fixed.yaml"]);
    assert!(
        code == 2 && stderr.contains("at least 26 nodes"),
        "{stderr}"
    );
    bench.write("auto.yaml", &stiff.replace("nodes: 21", "nodes: auto"));
    bench.run_to(0, &["fit", "auto.yaml"]);
    bench.run_to(
        0,
        &["fit", "stiff.yaml", "--set", "fit={method: equation-error}"],
    );
}
