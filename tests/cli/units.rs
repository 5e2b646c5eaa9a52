//! Wrong units: warned where a second channel, or a force with a known mass, shows them, and where the magnitudes are implausible; otherwise the
//! assumed units stand on the screens of `init`, `check` and `fit`.

use crate::workbench::Workbench;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.80665;

/// Times (s) with displacement, velocity and acceleration of a decay of `frequency` Hz and 1 % damping from `amplitude`.
fn decay(frequency: f64, amplitude: f64) -> Vec<[f64; 4]> {
    let (omega, rate) = (TAU * frequency, 0.01 * TAU * frequency);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut row = |i: i32| {
        let t = f64::from(i) / (50.0 * frequency);
        let (sine, cosine) = (omega * t).sin_cos();
        let y = amplitude * (-rate * t).exp();
        // Noise of one per cent, the same in all columns.
        let n = 0.01 * amplitude * random.random_range(-1.0..1.0);
        let [a, b] = [rate * rate - omega * omega, 2.0 * rate * omega];
        [
            t,
            y * cosine + n,
            y * (-rate * cosine - omega * sine) + omega * n,
            y * (a * cosine + b * sine) + omega * omega * n,
        ]
    };
    (0..500).map(&mut row).collect()
}

/// A table with columns of rows, each with a factor.
fn table(header: &str, rows: &[[f64; 4]], columns: &[(usize, f64)]) -> String {
    let mut text = format!("{header}\n");
    for row in rows {
        let numbers: Vec<String> = columns
            .iter()
            .map(|(i, factor)| format!("{:e}", factor * row[*i]))
            .collect();
        let _ = writeln!(text, "{}", numbers.join(","));
    }
    text
}

/// What `check` says on standard error about the model that `init` writes.
fn warned(text: &str, options: &[&str]) -> String {
    let bench = Workbench::empty();
    bench.write("record.csv", text);
    bench.run_to(0, &[&["init", "record.csv"], options].concat());
    bench.run(&["check", "record.yaml"]).2
}

/// Two channels of one response: the factor between the units is named; with the right units nothing is.
#[test]
fn two_channels_show_a_wrong_unit() {
    let rows = decay(2.0, 0.02);
    for (columns, named) in [
        // mm read as m.
        (
            [(0, 1.0), (1, 1e3), (3, 1.0)],
            "the factor 1/1000 between mm and m",
        ),
        // g read as m/s^2.
        (
            [(0, 1.0), (1, 1.0), (3, 1.0 / GRAVITY)],
            "the factor 1/9.81",
        ),
        ([(0, 1.0), (1, 1.0), (3, 1.0)], ""),
    ] {
        let text = table("t [s],y [m],acc [m/s^2]", &rows, &columns);
        let said = warned(&text, &[]);
        match named {
            "" => assert!(!said.contains("warning"), "{said}"),
            named => assert!(said.contains(named), "{named}: {said}"),
        }
    }
    // Times in min read as s: the frequency is 60 times as large.
    let slow = decay(0.2, 0.02);
    let text = table(
        "t [s],y [m],vel [m/s]",
        &slow,
        &[(0, 1.0 / 60.0), (1, 1.0), (2, 1.0)],
    );
    let said = warned(&text, &[]);
    assert!(said.contains("the factor 1/60 between s and min"), "{said}");
    // Times in ms read as s.
    let text = table(
        "t [s],y [m],vel [m/s]",
        &rows,
        &[(0, 1e3), (1, 1.0), (2, 1.0)],
    );
    let said = warned(&text, &[]);
    assert!(said.contains("the factor 1000"), "{said}");
    // Degrees read as rad beside a rate in rad/s.
    for (factor, is_warned) in [(180.0 / PI, true), (1.0, false)] {
        let text = table(
            "t [s],roll [rad],vel [rad/s]",
            &rows,
            &[(0, 1.0), (1, factor), (2, 1.0)],
        );
        let said = warned(&text, &[]);
        assert_eq!(
            said.contains("the factor 1/57.3 between deg and rad"),
            is_warned,
            "{said}"
        );
    }
}

/// Samples of force and acceleration of a mass of 2 kg on a spring, driven by noise that passes through both in closed form: the force is that of
/// a prescribed motion.
fn driven() -> Vec<[f64; 4]> {
    let (m, c, k) = (2.0, 4.0, 800.0);
    let tones: Vec<[f64; 3]> = (1..60)
        .map(|i| {
            [
                0.1 * f64::from(i),
                f64::from((i * 37) % 60),
                1e-3 / (1.0 + 0.05 * f64::from(i)),
            ]
        })
        .collect();
    let row = |i: i32| {
        let t = 0.01 * f64::from(i);
        let mut sums = [0.0; 3];
        for [frequency, phase, amplitude] in &tones {
            let omega = TAU * frequency;
            let (sine, cosine) = (omega * t + phase).sin_cos();
            sums[0] += amplitude * sine;
            sums[1] += amplitude * omega * cosine;
            sums[2] -= amplitude * omega * omega * sine;
        }
        let [y, v, a] = sums;
        [t, m * a + c * v + k * y, y, a]
    };
    (0..2000).map(row).collect()
}

/// A force and a stated mass: the implied mass shows the unit.
#[test]
fn a_force_with_a_known_mass_shows_a_wrong_unit() {
    let rows = driven();
    for (force, acceleration, named) in [
        (1.0, 1.0, ""),
        (1e-3, 1.0, "the factor 1/1000"),
        (1.0, 1e3, "the factor 1/1000"),
        (1.0, 1.0 / GRAVITY, "the factor 9.81"),
        (GRAVITY, 1.0, "the factor 9.81"),
        (1.0, 180.0 / PI, "the factor 1/60"),
    ] {
        let text = table(
            "t [s],force [N],acc [m/s^2]",
            &rows,
            &[(0, 1.0), (1, force), (3, acceleration)],
        );
        let said = warned(&text, &["--mass", "2"]);
        let is_named = said.contains("imply a mass of");
        match named {
            "" => assert!(!is_named, "{said}"),
            named => assert!(is_named && said.contains(named), "{named}: {said}"),
        }
        // Without a known mass the force cannot show it.
        assert!(!warned(&text, &[]).contains("imply a mass of"));
    }
}

/// One channel: implausible magnitudes have a reading; plausible ones of unknown units stand on each screen.
#[test]
fn one_channel_shows_what_is_implausible() {
    for (frequency, amplitude, time, named) in [
        (
            2.0,
            4e-3,
            1e3,
            "the times read as ms and the displacement read as mm give 2 Hz and 3.9 mm",
        ),
        (
            2.0,
            4e-3,
            1.0,
            "the displacement read as mm gives 2 Hz and 3.9 mm",
        ),
    ] {
        let text = table("t,y", &decay(frequency, amplitude), &[(0, time), (1, 1e3)]);
        let said = warned(&text, &[]);
        assert!(said.contains(named), "{named}: {said}");
    }
    let degrees = table(
        "t [s],roll [rad]",
        &decay(0.1, 20.0 * PI / 180.0),
        &[(0, 1.0), (1, 180.0 / PI)],
    );
    let said = warned(&degrees, &[]);
    assert!(
        said.contains("the displacement read as deg gives 0.1 Hz and 19 deg"),
        "{said}"
    );
    // Minutes read as s and g read as m/s^2 are plausible: the units stand on every screen.
    let bench = Workbench::empty();
    bench.write(
        "record.csv",
        &table(
            "t,a",
            &decay(0.5, 0.02),
            &[(0, 1.0 / 60.0), (3, 1.0 / GRAVITY)],
        ),
    );
    let init = bench.run_to(0, &["init", "record.csv"]);
    assert!(
        init.contains("column `t`: time, s; the unit is assumed, please check\n"),
        "{init}"
    );
    assert!(
        init.contains("column `a`: acceleration, m/s²; the unit is assumed, please check\n"),
        "{init}"
    );
    let assumed = "acceleration in m/s² and time in s: assumed";
    let check = bench.run_to(0, &["check", "record.yaml"]);
    assert!(check.contains(assumed), "{check}");
    let fit = bench.run_to(0, &["fit", "record.yaml", "--no-report"]);
    assert!(fit.contains(&format!("Units  {assumed}")), "{fit}");
}
