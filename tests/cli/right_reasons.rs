//! Simulated records with one known cause each: the reason of the verdict is that cause, and the advice is its cure.

use crate::oscillator::displacements;
use crate::workbench::Workbench;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::Value;
use std::f64::consts::TAU;

fn noise(seed: u64) -> impl FnMut(f64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move |size| {
        let unit: f64 = random.sample(StandardNormal);
        size * unit
    }
}

/// A table with equally spaced times from zero.
fn table(names: &str, spacing: f64, rows: impl Iterator<Item = Vec<f64>>) -> String {
    let mut text = format!("time (s),{names}\n");
    for (i, row) in rows.enumerate() {
        let values: Vec<String> = row.iter().map(|x| format!("{x:.8}")).collect();
        text += &format!("{:.6},{}\n", spacing * i as f64, values.join(","));
    }
    text
}

/// The result document of the model that `init` writes, with changes.
fn fit(text: &str, changes: &[&str]) -> Value {
    let bench = Workbench::empty();
    bench.write("a.csv", text);
    bench.run_to(0, &["init", "a.csv"]);
    let mut arguments = vec!["fit", "a.yaml", "--out", "run", "--no-report"];
    arguments.extend(changes.iter().flat_map(|change| ["--set", change]));
    bench.run_to(0, &arguments);
    serde_json::from_str(&bench.read("run/result.json")).expect("a document")
}

fn reasons(document: &Value) -> Vec<&Value> {
    let all = document["verdict"]["reasons"].as_array();
    all.expect("reasons").iter().collect()
}

fn has_reason(document: &Value, kind: &str) -> bool {
    reasons(document).iter().any(|r| r["kind"] == kind)
}

/// True if a candidate whose name contains this, alone or as good as others, is preferred to the model.
fn is_preferred(document: &Value, name: &str) -> bool {
    let preferred = reasons(document)
        .into_iter()
        .filter(|r| r["kind"] == "preferred");
    let mut all = preferred.flat_map(|r| r["candidates"].as_array().expect("candidates"));
    all.any(|candidate| {
        candidate["name"]
            .as_str()
            .is_some_and(|own| own.contains(name))
    })
}

fn first_advice(document: &Value) -> &str {
    document["advice"][0]["set"][0].as_str().unwrap_or_default()
}

/// Free decay from a displacement of 1, by the fourth-order method of Runge and Kutta in a tenth of the spacing, for the acceleration
/// `a(y, v)`.
fn decay(count: usize, spacing: f64, acceleration: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    // The motion about the displaced place, from rest.
    let from = |_: f64, y: f64, v: f64, _: f64| acceleration(1.0 + y, v);
    let all = displacements(&vec![0.0; count], spacing, 10, from);
    all.iter().step_by(10).map(|y| 1.0 + y).collect()
}

#[test]
fn the_missing_power_of_a_spring_is_named() {
    let omega = TAU * 2.0;
    for (power, size, name) in [
        (2, 0.15, "quadratic_stiffness"),
        (3, 0.1, "cubic_stiffness"),
        (5, 0.2, "quintic_stiffness"),
    ] {
        let response = decay(1000, 0.01, |y, v| {
            -0.04 * omega * v - omega * omega * (y + size * y.powi(power))
        });
        let mut error = noise(5);
        let rows = response.iter().map(|y| vec![y + error(0.002)]);
        let document = fit(&table("displacement (m)", 0.01, rows), &[]);
        assert!(
            is_preferred(&document, name),
            "{name}: {:?}",
            reasons(&document)
        );
        let advice = first_advice(&document);
        assert!(
            advice.starts_with(&format!("functions.{name}=")),
            "{advice}"
        );
        assert!(
            document["advice"][0]["tried"] == "tried: Adequate",
            "{}",
            document["advice"]
        );
    }
}

/// A force that steps at a sample: lines reach it half a sample too early.
#[test]
fn a_jump_of_the_force_is_named_and_held() {
    for (seed, ratio) in [(1, 0.03), (2, 0.1), (3, 0.3)] {
        let (omega, spacing) = (TAU * 8.0, 0.0025);
        // Displacement of a unit mass from rest, a step of 10 N at 0.5 s.
        let damped = omega * f64::sqrt(1.0 - ratio * ratio);
        let step = |t: f64| {
            let (sine, cosine) = (damped * t).sin_cos();
            let decay = (-ratio * omega * t).exp();
            10.0 / (omega * omega) * (1.0 - decay * (cosine + ratio * omega / damped * sine))
        };
        let mut error = noise(seed);
        let rows = (0..1600).map(|i| {
            let t = spacing * f64::from(i) - 0.5;
            match i >= 200 {
                true => vec![10.0, step(t) + error(2e-5)],
                false => vec![0.0, error(2e-5)],
            }
        });
        let text = table("force (N),displacement (m)", spacing, rows);
        let held = fit(&text, &[]);
        assert_eq!(held["verdict"]["level"], "adequate");
        let linear = fit(&text, &["experiments.0.force.interpolation=linear"]);
        let kinds: Vec<&Value> = reasons(&linear).iter().map(|r| &r["kind"]).collect();
        assert!(has_reason(&linear, "input_jump"), "{ratio}: {kinds:?}");
        for other in [
            "clock_difference",
            "delay",
            "input_pulses",
            "disturbed_input",
        ] {
            assert!(!has_reason(&linear, other), "{ratio}: {kinds:?}");
        }
        assert_eq!(
            first_advice(&linear),
            "experiments.0.force.interpolation=hold"
        );
    }
}

/// A force that steps between two samples is late by a part of a spacing. After one event a clock of another rate would explain the
/// acceleration as well.
#[test]
fn a_step_between_samples_is_a_delay() {
    let (omega, ratio, begin) = (TAU * 6.12, 0.0195, 0.5003);
    let damped = omega * f64::sqrt(1.0 - ratio * ratio);
    let mut error = noise(4);
    let rows = (0..2000).map(|i| {
        let t = 0.002 * f64::from(i) - begin;
        let (sine, cosine) = (damped * t).sin_cos();
        let acceleration = (-ratio * omega * t).exp() * (cosine - ratio * omega / damped * sine);
        match t > 0.0 {
            true => vec![30.0, 15.0 * acceleration + error(0.05)],
            false => vec![0.0, error(0.05)],
        }
    });
    let document = fit(&table("force (N),acceleration (m/s2)", 0.002, rows), &[]);
    let kinds: Vec<&Value> = reasons(&document).iter().map(|r| &r["kind"]).collect();
    let preferred = reasons(&document)
        .into_iter()
        .find(|r| r["kind"] == "preferred");
    let best = &preferred.unwrap_or_else(|| panic!("{kinds:?}"))["candidates"][0]["name"];
    assert_eq!(best, "delay of record 1", "{kinds:?}");
}

/// Two modes from 4 to 30 % apart, the weaker one of 10 to 100 % of the other, and one mode alone.
#[test]
fn two_modes_are_named_whatever_their_distance() {
    let mode = |t: f64, f: f64, ratio: f64| {
        let omega = TAU * f;
        (-ratio * omega * t).exp() * (omega * (1.0 - ratio * ratio).sqrt() * t + f).cos()
    };
    let record = |seed: u64, apart: f64, size: f64| {
        let mut error = noise(seed);
        let rows = (0..3000).map(|i| {
            let t = 0.01 * f64::from(i);
            let second = size * mode(t, 3.0 * (1.0 + apart), 0.006);
            vec![mode(t, 3.0, 0.005) + second + error(0.01)]
        });
        table("acceleration (m/s^2)", 0.01, rows)
    };
    for (seed, apart, size) in [
        (1, 0.04, 0.75),
        (2, 0.06, 1.0),
        (3, 0.1, 0.4),
        (4, 0.15, 0.1),
        (5, 0.3, 0.2),
    ] {
        let document = fit(&record(seed, apart, size), &[]);
        let found = reasons(&document)
            .into_iter()
            .find(|r| r["kind"] == "preferred");
        let found = found.unwrap_or_else(|| panic!("{apart}: {:?}", reasons(&document)));
        let best = &found["candidates"][0];
        assert_eq!(best["name"], "second mode in acceleration", "{apart}");
        let estimates = best["estimates"].as_array().expect("estimates").iter();
        let frequencies = estimates.filter(|q| q["unit"] == "Hz");
        let mut frequencies: Vec<f64> = frequencies.filter_map(|q| q["value"].as_f64()).collect();
        frequencies.sort_by(f64::total_cmp);
        for (f, truth) in frequencies.iter().zip([3.0, 3.0 * (1.0 + apart)]) {
            // A tenth of the frequency spacing.
            assert!((f - truth).abs() < 0.0033, "{apart}: {frequencies:?}");
        }
    }
    for seed in 10..14 {
        let document = fit(&record(seed, 0.1, 0.0), &[]);
        assert!(!is_preferred(&document, "second mode"), "{seed}");
    }
}

/// A code for missing samples that a model does not state.
#[test]
fn a_code_that_is_not_stated_is_named() {
    let mut error = noise(6);
    let rows = (0..800).map(|i| {
        let t = 0.004 * f64::from(i);
        let y = (-0.7 * t).exp() * (47.0 * t).cos() + error(0.01);
        vec![if matches!(i, 5 | 300 | 301) {
            -9999.0
        } else {
            y
        }]
    });
    let text = table("acceleration (m/s^2)", 0.004, rows);
    let stated = fit(&text, &[]);
    assert_eq!(stated["verdict"]["level"], "adequate");
    let document = fit(&text, &["experiments.0.missing=[]"]);
    assert_eq!(first_advice(&document), "experiments.0.missing=[-9999.0]");
    assert_eq!(document["advice"][0]["tried"], "tried: Adequate");
    let named = reasons(&document)
        .into_iter()
        .find(|r| r["kind"] == "missing_codes");
    assert_eq!(named.expect("a reason")["channels"][0], "acceleration");
}

/// A damping that the model fixes at ten times that of the decay, and right ones beside a bias of the sensor.
#[test]
fn a_decay_contradicts_a_wrong_damping_alone() {
    let omega = TAU * 3.2;
    for (seed, bias) in [(1, 0.0), (2, 0.15), (3, -0.15)] {
        let mut error = noise(seed);
        let rows = (0..700).map(|i| {
            let t = 0.005 * f64::from(i);
            vec![(-0.03 * omega * t).exp() * (omega * t).cos() + bias + error(0.006)]
        });
        let text = table("displacement (m)", 0.005, rows);
        let right = fit(&text, &[]);
        assert!(!has_reason(&right, "classical_disagrees"), "{bias}");
        let fixed = format!("functions.damping={{fixed: {}}}", 0.6 * omega);
        let wrong = fit(&text, &["functions.mass.fixed=1", &fixed]);
        assert!(has_reason(&wrong, "classical_disagrees"), "{bias}");
    }
}
