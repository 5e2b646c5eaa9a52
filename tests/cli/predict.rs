//! `kmcfit predict`: free responses of identified systems from other initial states.

use crate::workbench::{Workbench, column, paper_run, table};
use insta::assert_snapshot;
use serde_json::Value;

/// The paper's optimum matches its own record and does not predict another one.
#[test]
fn the_optimum_does_not_predict() {
    let (bench, _) = paper_run();
    let predict = [
        "predict",
        "runs/paper",
        "--initial",
        "-3.3,1",
        "--initial",
        "3.4,1.1",
    ];
    assert_snapshot!(bench.run_to(0, &predict), @"
    y(0) (m)   v(0) (m/s) int (y - y_true)^2 dt (m² s) int y_true^2 dt (m² s)
        -3.3            1                    3.97298e1              1.26929e2
         3.4          1.1                   6.15327e-2              1.41498e2
    ");

    let json = bench.run_to(0, &[&predict[..], &["--json"]].concat());
    let found: Value = serde_json::from_str(&json).expect("JSON");
    let near = |pointer: &str, expected: f64, tolerance: f64| {
        let value = found
            .pointer(pointer)
            .and_then(Value::as_f64)
            .expect(pointer);
        assert!((value - expected).abs() <= tolerance, "{pointer}: {value}");
    };
    near("/0/cost", 39.730, 5e-4);
    near("/0/energy", 126.9, 0.05);
    near("/1/cost", 0.061533, 5e-7);
    let result: Value = serde_json::from_str(&bench.read("runs/paper/result.json")).expect("JSON");
    assert_eq!(found[0], result["predictions"][4]);
}

#[test]
fn motions_are_written() {
    let (bench, _) = paper_run();
    let predict = [
        "predict",
        "runs/paper",
        "--initial",
        "-1,0",
        "--out",
        "predicted",
    ];
    bench.run_to(0, &predict);
    let motions = bench.read("predicted/predictions.csv");
    assert_eq!(table(&motions).0, ["t_s", "y_m_1", "true_y_m_1"]);
    assert_eq!(column(&motions, "y_m_1")[0], -1.0);
    let svg = bench.read("predicted/figures/predictions.svg");
    roxmltree::Document::parse(&svg).expect("XML");
}

/// A rotation has angular units in all outputs; without a known true system a prediction reports the range of the response.
#[test]
fn a_rotation_has_angular_units() {
    let bench = Workbench::with_shipped_models();
    let model = "models/roll-decay.yaml";
    let more = ["--no-report", "--set", "fit.stop.iterations=20"];
    for out in ["roll", "again"] {
        bench.run_to(0, &[&["fit", model, "--out", out], &more[..]].concat());
    }
    let predict = [
        "predict",
        "roll",
        "--initial",
        "0.1,0",
        "--out",
        "predicted",
    ];
    let said = bench.run_to(0, &predict);
    let (header, row) = said.trim_end().split_once('\n').expect("two lines");
    let words: Vec<&str> = header.split_whitespace().collect();
    assert_eq!(
        words.join(" "),
        "y(0) (rad) v(0) (rad/s) peak |y| (rad) y at end (rad)"
    );
    let motions = bench.read("predicted/predictions.csv");
    assert_eq!(table(&motions).0, ["t_s", "y_rad_1"]);
    let motion = column(&motions, "y_rad_1");
    let numbers: Vec<f64> = row
        .split_whitespace()
        .map(|x| x.parse().expect(row))
        .collect();
    assert_eq!(numbers[..2], [0.1, 0.0]);
    let largest = motion.iter().fold(0.0f64, |most, y| most.max(y.abs()));
    for (shown, exact) in [
        (numbers[2], largest),
        (numbers[3], motion[motion.len() - 1]),
    ] {
        assert!((shown - exact).abs() <= 1e-5 * exact.abs(), "{said}");
    }
}

/// The record of a fit as a new one: its force file scores the prediction, whose band with noise holds about 95 % of the samples.
#[test]
fn a_force_of_a_file_predicts_and_scores() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["fit", "models/friction.yaml", "--no-report"]);
    let result: Value =
        serde_json::from_str(&bench.read("runs/friction/result.json")).expect("JSON");
    let state = |i: usize| {
        let pointer = format!("/nuisance_parameters/{i}/value");
        result
            .pointer(&pointer)
            .and_then(Value::as_f64)
            .unwrap_or(0.0)
    };
    let initial = format!("{},{}", state(0), state(1));
    let predict = [
        "predict",
        "runs/friction",
        "--force",
        "data/friction.csv",
        "--initial",
        &initial,
        "--out",
        "predicted",
    ];
    let found: Value =
        serde_json::from_str(&bench.run_to(0, &[&predict[..], &["--json"]].concat()))
            .expect("JSON");
    let number = |key: &str| found.pointer(key).and_then(Value::as_f64).expect(key);
    let stated = result
        .pointer("/experiments/0/channels/0/fit_percent")
        .and_then(Value::as_f64)
        .expect("a fit");
    assert!((number("/0/score/fit_percent") - stated).abs() < 0.1);
    // Of 1201 samples the share within a 95 % band has a standard deviation of 0.6 %.
    assert!((0.93..0.97).contains(&number("/0/score/within_band")));
    let table_of_curves = bench.read("predicted/predictions.csv");
    assert_eq!(
        table(&table_of_curves).0,
        [
            "t_s",
            "displacement_m",
            "displacement_low_95_m",
            "displacement_high_95_m",
            "displacement_sample_low_95_m",
            "displacement_sample_high_95_m",
            "displacement_measured_m"
        ]
    );
    let svg = bench.read("predicted/figures/predictions.svg");
    roxmltree::Document::parse(&svg).expect("XML");
}

/// Coefficients that vary are identified over their own record alone; every other mistake has its place and what is expected.
#[test]
fn mistakes_of_inputs() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["fit", "models/friction.yaml", "--no-report"]);
    bench.run_to(0, &["fit", "models/linear-mass.yaml", "--no-report"]);
    bench.write("short.csv", "t_s,f_N\n0,1\n1,2\n");
    bench.write("gaps.csv", "t_s,f_N\n0,1\n1,\n2,1\n3,1\n");
    bench.write("long.csv", "t_s,f_N\n0,1\n10,1\n20,1\n40,1\n");
    bench.write("base.csv", "t_s,base_acc_m_per_s2\n0,1\n1,2\n2,1\n");
    bench.write("times.csv", "t_s,f_N\n0,1\n2,2\n1,1\n3,1\n");
    let refused = |arguments: &[&str]| {
        let before = bench.contents();
        let (code, stdout, stderr) = bench.run(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?} {stderr}");
        assert_eq!(bench.contents(), before);
        stderr
    };
    let of = |run: &str, more: &[&str]| {
        let first = ["predict", run, "--out", "out"];
        refused(&[&first[..], more].concat())
    };
    let run = "runs/friction";
    assert_snapshot!(of("models/friction.yaml", &["--force", "short.csv"]));
    assert_snapshot!(of(run, &["--force", "nowhere.csv"]));
    assert_snapshot!(of(run, &["--force", "data/paper.csv"]));
    assert_snapshot!(of(run, &["--base", "data/friction.csv"]));
    assert_snapshot!(of(run, &["--force", "short.csv"]));
    assert_snapshot!(of(run, &["--force", "gaps.csv"]));
    assert_snapshot!(of(run, &["--force", "times.csv"]));
    assert_snapshot!(of(run, &["--force", "long.csv", "--base", "base.csv"]));
    assert_snapshot!(of("runs/linear-mass", &["--force", "long.csv"]));
    assert_snapshot!(of(run, &["--force", "long.csv", "--channel", "acc"]));
    assert_snapshot!(of(run, &["--initial", "1,0", "--channel", "velocity"]));
    assert_snapshot!(of(run, &["--forse", "long.csv"]));
    bench.write("far.csv", "t_s,f_N\n0,1\n1e7,1\n2e7,1\n3e7,1\n");
    assert_snapshot!(of(run, &["--force", "far.csv"]));
    let parameters = bench.read("runs/friction/parameters.json");
    bench.write(
        "runs/friction/parameters.json",
        &parameters.replacen("\"name\": \"damping\"", "\"name\": \"dumping\"", 1),
    );
    assert_snapshot!(of(run, &["--force", "data/friction.csv"]));
}
