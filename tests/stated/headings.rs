//! What a file states is applied, or named by `init` and by a reason of the verdict: units, scales, clocks, quantities.

use crate::workbench::Workbench;
use serde_json::Value;
use std::fmt::Write;

const GRAVITY: f64 = 9.80665;

/// Times (s), force (N) and acceleration (m/s²) of a system of 2 kg, 6 N s/m and 8 Hz under a force of several tones, by the method of Runge
/// and Kutta; every sample of the acceleration has an error of 1e-4 m/s².
pub fn forced(count: usize, spacing: f64) -> Vec<[f64; 3]> {
    let (m, c, k) = (
        2.0,
        6.0,
        2.0 * (2.0 * std::f64::consts::PI * 8.0f64).powi(2),
    );
    let tone = |t: f64| {
        let tones = [(3.1, 20.0), (7.3, 12.0), (8.9, 15.0), (13.7, 25.0)];
        tones
            .iter()
            .map(|(f, a)| a * (2.0 * std::f64::consts::PI * f * t).sin())
            .sum::<f64>()
    };
    let force: Vec<f64> = (0..count).map(|i| tone(spacing * i as f64)).collect();
    let mut state = [0.0, 0.0];
    let slope = |s: [f64; 2], f: f64| [s[1], (f - c * s[1] - k * s[0]) / m];
    let mut rows = Vec::new();
    for i in 0..count {
        let (f, next) = (force[i], force[(i + 1).min(count - 1)]);
        let noise = 1e-2 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
        rows.push([spacing * i as f64, f, slope(state, f)[1] + noise]);
        for j in 0..4 {
            let h = spacing / 4.0;
            let at = |part: f64| f + (next - f) * (f64::from(j) + part) / 4.0;
            let step = |by: f64, k: [f64; 2]| [state[0] + by * k[0], state[1] + by * k[1]];
            let k1 = slope(state, at(0.0));
            let k2 = slope(step(0.5 * h, k1), at(0.5));
            let k3 = slope(step(0.5 * h, k2), at(0.5));
            let k4 = slope(step(h, k3), at(1.0));
            for x in 0..2 {
                state[x] += h / 6.0 * (k1[x] + 2.0 * k2[x] + 2.0 * k3[x] + k4[x]);
            }
        }
    }
    rows
}

/// A table of this header whose columns are those of [`forced`], divided by the units of the file.
fn table(header: &str, units: [f64; 3]) -> String {
    let mut text = format!("{header}\n");
    let delimiter = if header.contains(';') { ';' } else { ',' };
    for row in forced(1500, 0.002) {
        let [t, f, a] = [0, 1, 2].map(|i| row[i] / units[i]);
        let _ = writeln!(text, "{t:.6}{delimiter}{f:.9e}{delimiter}{a:.9e}");
    }
    text
}

/// The result of a fit of a file with the arguments of `init`.
fn fitted(file: &str, text: &[u8], arguments: &[&str]) -> Value {
    let bench = Workbench::empty();
    bench.write_bytes(file, text);
    bench.run_to(
        0,
        &[&["init", file, "--out", "model.yaml"], arguments].concat(),
    );
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    serde_json::from_str(&bench.read("run/result.json")).expect("a document")
}

pub fn value(document: &Value, name: &str) -> f64 {
    document["estimates"][name]["value"]
        .as_f64()
        .unwrap_or(f64::NAN)
}

pub fn level(document: &Value) -> &str {
    document["verdict"]["level"].as_str().expect("a level")
}

/// Rows that alternate: times, and the numbers of further columns.
fn rows(delimiter: char, columns: usize) -> String {
    let row = |i: i32| {
        let numbers =
            (0..columns).map(|c| format!("{delimiter}{}", (c + 1) as f64 * f64::from(i).sin()));
        format!("{i}{}\n", numbers.collect::<String>())
    };
    (0..40).map(row).collect()
}

/// A row with one displacement `x` and the lines of `init`.
pub fn init(file: &str, text: &[u8], arguments: &[&str]) -> String {
    let bench = Workbench::empty();
    bench.write_bytes(file, text);
    let (code, out, err) = bench.run(&[&["init", file, "--out", "model.yaml"], arguments].concat());
    assert_eq!(code, 0, "{out}{err}");
    out + &bench.read("model.yaml")
}

/// Units in headings of any form are those of the model: the mass is 2 kg.
#[test]
fn units_in_headings_are_read() {
    for (header, units) in [
        (
            "Time (s) Run #1,Force (N) Run #1,Acceleration (g) Run #1",
            [1.0, 1.0, GRAVITY],
        ),
        ("t/ms;F/N;a/g", [1e-3, 1.0, GRAVITY]),
        (
            "Time [s],Force (kgf),Acceleration in g",
            [1.0, GRAVITY, GRAVITY],
        ),
        ("time,F [daN] filtered,a_z [cm/s/s] ch1", [1.0, 10.0, 0.01]),
        ("Time (s);Force, kN;Acceleration, mm/s^2", [1.0, 1e3, 1e-3]),
        (
            "time: ms;force: kip;acc: %g",
            [1e-3, 4_448.221_615_260_5, 0.01 * GRAVITY],
        ),
        (
            "Time (s),Force (lbf) A,X (16g)",
            [1.0, 4.448_221_615_260_5, GRAVITY],
        ),
        ("t_s,f_kgf,acc_mg", [1.0, GRAVITY, 1e-3 * GRAVITY]),
        ("Time s,Force dyn,Acceleration ft/s^2", [1.0, 1e-5, 0.3048]),
    ] {
        let document = fitted("record.csv", table(header, units).as_bytes(), &[]);
        let mass = value(&document, "mass");
        assert!((mass / 2.0 - 1.0).abs() < 0.01, "{header}: {mass} kg");
    }
}

/// A unit that is not known is named by `init` and a reason of the verdict.
#[test]
fn units_that_are_not_known_are_named() {
    for unit in ["dBm", "Pa", "counts", "furlong/s2", "raw", "a.u."] {
        let header = format!("time (s),force (N),acceleration ({unit})");
        let text = table(&header, [1.0; 3]);
        let said = init("record.csv", text.as_bytes(), &[]);
        assert!(said.contains("stated unit is not known"), "{unit}: {said}");
        let document = fitted("record.csv", text.as_bytes(), &[]);
        assert_ne!(level(&document), "adequate", "{unit}");
        let reasons = document["verdict"]["reasons"].to_string();
        assert!(reasons.contains(unit), "{unit}: {reasons}");
    }
}

/// Volts stand for a response only where no mechanical column does, and need a sensitivity.
#[test]
fn volts_need_a_sensitivity() {
    let cart = format!("Time [s];Position [cm];U [V]\n{}", rows(';', 2));
    let said = init("r.csv", cart.as_bytes(), &[]);
    assert!(
        said.contains("`Position [cm]`: displacement, cm") && said.contains("not used: `U [V]`"),
        "{said}"
    );
    let drive = format!("time (s),drive_V,angle (deg)\n{}", rows(',', 2));
    let said = init("r.csv", drive.as_bytes(), &[]);
    assert!(
        said.contains("not used: `drive_V`") && !said.contains("acceleration"),
        "{said}"
    );
    let text = table("time (s),force (N),acceleration (V)", [1.0, 1.0, 10.0]);
    let document = fitted("record.csv", text.as_bytes(), &[]);
    let reasons = document["verdict"]["reasons"].to_string();
    assert!(
        level(&document) != "adequate" && reasons.contains("sensitivity"),
        "{reasons}"
    );
    let text = table("time (s),force (N),a (mV)", [1.0, 1.0, 0.01]);
    let stated = ["--units", "a (mV)=0.1 V/(m/s2)"];
    let document = fitted("record.csv", text.as_bytes(), &stated);
    assert!(
        (value(&document, "mass") / 2.0 - 1.0).abs() < 0.01,
        "{document}"
    );
}

/// Quantities by their names.
#[test]
fn names_state_quantities() {
    for (name, quantity) in [
        ("angular_velocity", "velocity"),
        ("omega", "velocity"),
        ("gyro_z", "velocity"),
        ("linear_acceleration.z", "acceleration"),
        ("AccelX", "acceleration"),
        ("Beschleunigung_Z", "acceleration"),
        ("left_position", "displacement"),
        ("y1", "displacement"),
        ("ax", "acceleration"),
    ] {
        let text = format!("t,{name}\n{}", rows(',', 1));
        let said = init("r.csv", text.as_bytes(), &[]);
        assert!(
            said.contains(&format!("`{name}`: {quantity}")),
            "{name}: {said}"
        );
    }
    let said = init("r.csv", format!("t,ch 1\n{}", rows(',', 1)).as_bytes(), &[]);
    assert!(said.contains("quantity and unit are assumed"), "{said}");
}
