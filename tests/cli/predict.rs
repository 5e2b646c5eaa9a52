//! `kmcfit predict`.

use crate::workbench::{column, paper_run, table};
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
    y(0) m     v(0) m/s     cost m^2 s   energy m^2 s
      -3.3            1      3.97298e1      1.26929e2
       3.4          1.1     6.15327e-2      1.41498e2
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
