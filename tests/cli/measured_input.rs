//! Mistakes in measured records: exit code 2, a message with location and problem, no file written; and warnings about
//! suspicious records.

use crate::workbench::Workbench;
use insta::assert_snapshot;

const MODEL: &str = "\
format: 1
title: Forced
experiments:
  - name: shaker
    data: shaker.csv
    columns: {time: t, acceleration: a, displacement: y, force: f}
    sigma: {acceleration: 0.1, displacement: 0.01}
    initial: {displacement: 1.0, velocity: estimate}
  - name: hammer
    data: hammer.csv
    columns: {time: t, displacement: y}
    sigma: {displacement: 0.01}
    initial: {displacement: 1.0, velocity: 0.0}
grid: {nodes: 41}
functions:
  mass:      {basis: constant, start: 1.5}
  damping:   {basis: constant, start: 0.1}
  stiffness: {basis: constant, start: 9.0}
fit: {stop: {iterations: 2}}
";

/// A cosine of 0.5 Hz over 2 s at 20 Hz with a column of a force.
fn shaker(force_until: usize) -> String {
    let mut text = String::from("t,y,a,f,s\n");
    for i in 0..41 {
        let t = 0.05 * f64::from(i);
        let (y, omega) = ((std::f64::consts::PI * t).cos(), std::f64::consts::PI);
        let force = if (i as usize) <= force_until {
            "0.5"
        } else {
            ""
        };
        text += &format!("{t},{y},{},{force},0.01\n", -omega * omega * y);
    }
    text
}

fn bench() -> Workbench {
    let bench = Workbench::empty();
    bench.write("model.yaml", MODEL);
    bench.write("shaker.csv", &shaker(41));
    let mut text = String::from("t,y\n");
    for i in 0..21 {
        let t = 0.1 * f64::from(i);
        text += &format!("{t},{}\n", (std::f64::consts::PI * t).cos());
    }
    bench.write("hammer.csv", &text);
    bench
}

/// The message about the model with some places changed; it must write nothing.
fn changed(changes: &[(&str, &str)]) -> String {
    let bench = bench();
    let mut model = MODEL.to_owned();
    for (from, to) in changes {
        assert!(model.contains(from), "{from}");
        model = model.replacen(from, to, 1);
    }
    bench.write("model.yaml", &model);
    refused(&bench)
}

fn refused(bench: &Workbench) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(&["fit", "model.yaml", "--out", "out"]);
    assert_eq!(code, 2, "{stdout}\n{stderr}");
    assert_eq!(stdout, "");
    assert_eq!(bench.contents(), before, "something was left");
    stderr
}

#[test]
fn channels() {
    let all = [
        changed(&[("acceleration: a,", "acceleration: acc,")]),
        changed(&[("acceleration: a,", "acceleration: 9,")]),
        changed(&[("acceleration: a,", "acceleration: 0,")]),
        changed(&[("displacement: y, force", "displacement: t, force")]),
        changed(&[("acceleration: a, displacement: y, force", "force")]),
        changed(&[("sigma: {acceleration: 0.1", "sigma: {velocity: 0.1")]),
        changed(&[(
            "sigma: {acceleration: 0.1, displacement: 0.01}",
            "sigma: {displacement: 0.01}",
        )]),
        changed(&[("acceleration: 0.1", "acceleration: 0.0")]),
        changed(&[("acceleration: 0.1", "acceleration: -1")]),
        changed(&[("acceleration: 0.1", "acceleration: noise")]),
        changed(&[("acceleration: 0.1", "acceleration: y")]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "units: {acceleration: gg}\n    initial: estimate",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "initial: estimated",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "initial: {displacement: 1.0, velocity: {prior: {mean: 0.0, sigma: 0.0}}}",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "loss: {acceleration: hubert}\n    initial: estimate",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "loss: {acceleration: {name: huber, degrees: 3}}\n    initial: estimate",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "sensors: {acceleration: {gain: 0}}\n    initial: estimate",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "sensors: {acceleration: {absolute: true}}\n    initial: estimate",
        )]),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn times() {
    let extra = |line: &str| {
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            &format!("{line}\n    initial: estimate"),
        )])
    };
    let all = [
        extra("sample_rate: 20"),
        changed(&[
            ("{time: t, acceleration", "{acceleration"),
            (
                "initial: {displacement: 1.0, velocity: estimate}",
                "sample_rate: 0\n    initial: estimate",
            ),
        ]),
        changed(&[("{time: t, acceleration", "{acceleration")]),
        extra("window: {min: 1.0, max: 0.5}"),
        extra("window: {min: 10.0}"),
        extra("window: {min: 0.5}"),
        extra("decimate: 0"),
        extra("band: {min: 3.0, max: 2.0}"),
        extra("band: {max: 20.0}"),
        extra("format: {delimiter: comma, decimal: comma}"),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn forces() {
    let force = |line: &str| {
        changed(&[
            (", force: f}", "}"),
            (
                "initial: {displacement: 1.0, velocity: estimate}",
                &format!("{line}\n    initial: estimate"),
            ),
        ])
    };
    let short = bench();
    let rows: Vec<String> = shaker(41).lines().map(str::to_owned).collect();
    short.write("force.csv", &(rows[..30].join("\n") + "\n"));
    let model = MODEL.replacen("force: f}", "force: {data: force.csv, column: f}}", 1);
    short.write("model.yaml", &model);
    let gap = bench();
    gap.write("shaker.csv", &shaker(20));
    let all = [
        refused(&short),
        refused(&gap),
        force("force: {interpolation: hold}"),
        force("force: {shape: sine, amplitude: 1.0}"),
        force("force: {shape: sine, amplitude: 1.0, frequency: -1.0}"),
        force("force: {shape: step, amplitude: 1.0, frequency: 1.0}"),
        force("force: {shape: sinus, amplitude: 1.0, frequency: 1.0}"),
        force("base: {interpolation: hold}"),
        changed(&[(
            "force: f}",
            "force: f, base_acceleration: s, base_displacement: t}",
        )]),
        changed(&[(
            "initial: {displacement: 1.0, velocity: estimate}",
            "force: {shape: constant, amplitude: 1.0}\n    initial: estimate",
        )]),
        changed(&[("force: f}", "force: y}")]),
    ];
    assert_snapshot!(all.join("\n"));
}
