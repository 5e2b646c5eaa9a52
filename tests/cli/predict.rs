//! `kmcfit predict`: free responses of identified systems from other initial states.

use crate::workbench::{Workbench, column, paper_run, repository, table};
use insta::assert_snapshot;
use serde_json::Value;
use std::path::PathBuf;

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
    let mut lines = said.lines();
    let [header, row, band] = [0; 3].map(|_| lines.next().expect("three lines"));
    assert!(band.contains("0.1 to 0.1 rad, y at end -0.01"), "{band}");
    let words: Vec<&str> = header.split_whitespace().collect();
    assert_eq!(
        words.join(" "),
        "y(0) (rad) v(0) (rad/s) peak |y| (rad) y at end (rad)"
    );
    let motions = bench.read("predicted/predictions.csv");
    let bands = ["y_low_95_rad_1", "y_high_95_rad_1"];
    assert_eq!(
        table(&motions).0,
        [&["t_s", "y_rad_1"][..], &bands].concat()
    );
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

/// Displacement (m), velocity (m/s) and force (N) of an oscillator of 2 kg with 1.2 N s/m and 80 N/m under three sines, by its transfer
/// function, `count` samples 0.1 s apart from the time `from` (s).
fn under_sines(from: f64, count: usize) -> Vec<[f64; 4]> {
    let (m, c, k) = (2.0, 1.2, 80.0);
    let sines: [[f64; 3]; 3] = [[3.0, 3.1, 0.2], [2.0, 7.9, 1.1], [4.0, 13.7, 2.3]];
    let at = |i: usize| {
        let t = 0.1 * i as f64;
        let mut sums = [t, 0.0, 0.0, 0.0];
        for [size, w, phase] in sines {
            let (real, imaginary) = (k - m * w * w, c * w);
            let gain = size / f64::hypot(real, imaginary);
            let angle = w * (from + t) + phase;
            let lagged = angle - imaginary.atan2(real);
            sums[1] += gain * lagged.sin();
            sums[2] += gain * w * lagged.cos();
            sums[3] += size * angle.sin();
        }
        sums
    };
    (0..count).map(at).collect()
}

/// Noise without correlation, of the standard deviation 1/sqrt(12) and the mean 0.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898 + 4.1).sin() * 43_758.545_3;
    x - x.floor() - 0.5
}

/// Score of the first channel of a prediction under `test.csv` from the state there.
fn score(bench: &Workbench, run: &str, initial: &str) -> [f64; 2] {
    let predict = [
        "predict",
        run,
        "--force",
        "test.csv",
        "--initial",
        initial,
        "--json",
    ];
    let found: Value = serde_json::from_str(&bench.run_to(0, &predict)).expect("JSON");
    ["fit_percent", "within_band"].map(|key| {
        let pointer = format!("/0/score/{key}");
        found.pointer(&pointer).and_then(Value::as_f64).expect(key)
    })
}

/// With four and a half samples in a period of the fastest sine a linear force is wrong by several per cent.
#[test]
fn a_prediction_interpolates_as_the_run_does() {
    let bench = Workbench::empty();
    let mut initial = String::new();
    for (name, from) in [("train.csv", 0.0), ("test.csv", 57.3)] {
        let rows = under_sines(from, 400);
        initial = format!("{},{}", rows[0][1], rows[0][2]);
        let lines = rows
            .iter()
            .enumerate()
            .map(|(i, [t, y, _, f])| format!("{t:.1},{},{f}\n", y + 2e-4 * noise(i)));
        bench.write(name, &format!("t_s,y_m,f_N\n{}", lines.collect::<String>()));
    }
    let model = |interpolation: &str| {
        format!(
            "format: 1\nexperiments:\n  - data: train.csv\n    columns: {{time: t_s, displacement: y_m, force: f_N}}\n    \
             force: {{interpolation: {interpolation}}}\n    sigma: {{displacement: estimate}}\n    initial: estimate\nfunctions:\n  \
             mass: {{basis: constant}}\n  damping: {{basis: constant}}\n  stiffness: {{basis: constant}}\n"
        )
    };
    for interpolation in ["cubic", "linear"] {
        bench.write(&format!("{interpolation}.yaml"), &model(interpolation));
        bench.run(&["fit", &format!("{interpolation}.yaml"), "--no-report"]);
    }
    let [fit, within] = score(&bench, "runs/cubic", &initial);
    assert!(fit > 99.5 && within > 0.9, "{fit} {within}");
    let [fit, _] = score(&bench, "runs/linear", &initial);
    assert!(fit < 99.0, "{fit}");
}

/// The force in kN and a displacement in mm without units in the file, an estimated offset, a stated gain and a stated delay.
#[test]
fn a_prediction_has_the_sensors_and_units_of_the_run() {
    let bench = Workbench::empty();
    let mut initial = String::new();
    for (name, from) in [("train.csv", 0.0), ("test.csv", 31.4)] {
        let rows = under_sines(from, 400);
        initial = format!("{},{}", rows[0][1], rows[0][2]);
        // The displacement at the time before, by a delay of one sample.
        let before = under_sines(from - 0.1, 400);
        let lines = (0..400).map(|i| {
            let sample = 2.0 * before[i][1] + 0.05 + 2e-4 * noise(i);
            format!("{:.1};{};{}\n", rows[i][0], 1e3 * sample, 1e-3 * rows[i][3])
        });
        bench.write(
            name,
            &format!("clock;s1;drive\n{}", lines.collect::<String>()),
        );
    }
    bench.write(
        "model.yaml",
        "format: 1\nexperiments:\n  - data: train.csv\n    columns: {time: clock, displacement: s1, force: drive}\n    \
         units: {time: s, displacement: mm, force: kN}\n    force: {interpolation: cubic}\n    \
         sensors: {displacement: {gain: 2.0, offset: estimate, delay: 0.1}}\n    sigma: {displacement: estimate}\n    \
         initial: estimate\nfunctions:\n  mass: {basis: constant}\n  damping: {basis: constant}\n  stiffness: {basis: constant}\n",
    );
    bench.run(&["fit", "model.yaml", "--no-report"]);
    let [fit, within] = score(&bench, "runs/model", &initial);
    assert!(fit > 99.5 && within > 0.9, "{fit} {within}");
}

/// A folder of the shared data (`KMCFIT_SHARED`, by default `../shared`); `None` with a message where there is none.
fn shared(folder: &str) -> Option<PathBuf> {
    let root =
        std::env::var_os("KMCFIT_SHARED").map_or_else(|| repository("../shared"), PathBuf::from);
    let found = Some(root.join(folder)).filter(|path| path.is_dir());
    if found.is_none() {
        eprintln!("SKIPPED: no shared `{folder}`; set KMCFIT_SHARED to check against it");
    }
    found
}

/// The record of the shared folder, whose model states a cubic force: 99.98 % as a validation record.
#[test]
fn a_shared_record_is_predicted_with_its_interpolation() {
    let Some(folder) = shared("faults/models/predict-ignores-interpolation") else {
        return;
    };
    let bench = Workbench::empty();
    for name in ["model.yaml", "train.csv", "test.csv"] {
        let text = std::fs::read_to_string(folder.join(name)).expect(name);
        bench.write(name, &text);
    }
    bench.run(&["fit", "model.yaml", "--no-report"]);
    let [fit, within] = score(&bench, "runs/model", "0,0");
    assert!(fit > 99.95 && within > 0.9, "{fit} {within}");
}

/// A free response has the 95 % band of the parameters' covariance: at the start it vanishes, later it holds the response.
#[test]
fn a_free_response_has_a_band() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["fit", "models/friction.yaml", "--no-report"]);
    let predict = [
        "predict",
        "runs/friction",
        "--initial",
        "0.01,0",
        "--out",
        "predicted",
    ];
    let text = bench.run_to(0, &predict);
    assert!(
        text.contains("95 % band from y = 0.01, v = 0: peak |y| "),
        "{text}"
    );
    let motions = bench.read("predicted/predictions.csv");
    let [y, low, high] =
        ["y_m_1", "y_low_95_m_1", "y_high_95_m_1"].map(|name| column(&motions, name));
    assert_eq!((low[0], high[0]), (y[0], y[0]));
    assert!((0..y.len()).all(|i| low[i] <= y[i] && y[i] <= high[i]));
    let json = bench.run_to(0, &[&predict[..4], &["--json"]].concat());
    let found: Value = serde_json::from_str(&json).expect("JSON");
    let ends = ["/0/last_95/0", "/0/last", "/0/last_95/1"]
        .map(|key| found.pointer(key).and_then(Value::as_f64).expect(key));
    assert!(ends[0] < ends[1] && ends[1] < ends[2], "{ends:?}");
    assert_eq!([ends[0], ends[2]], [low[y.len() - 1], high[y.len() - 1]]);
}
