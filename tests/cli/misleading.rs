//! Records on which the program once misled: reasons, advice and analyses of what they say now.

use crate::workbench::Workbench;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;

fn fit(bench: &Workbench, arguments: &[&str]) -> Value {
    let all = [&["fit"], arguments, &["--out", "run", "--no-report"]].concat();
    bench.run_to(0, &all);
    let document = serde_json::from_str(&bench.read("run/result.json")).expect("a document");
    std::fs::remove_dir_all(bench.path("run")).expect("a folder");
    document
}

/// Kinds of the objects of a list.
fn kinds(list: &Value) -> Vec<&str> {
    let all = list.as_array().expect("a list");
    all.iter()
        .filter_map(|item| item["kind"].as_str())
        .collect()
}

fn noise(random: &mut ChaCha8Rng, size: f64) -> f64 {
    let unit: f64 = random.sample(StandardNormal);
    size * unit
}

/// Forced vibration at five samples a period of its natural frequency, in steady state: lines lose a tenth of the force. The times have eight digits, from
/// which no exact rate follows.
#[test]
fn the_loss_by_lines_is_named_at_any_sampling_rate() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mass, damping, stiffness) = (0.85, 3.7, 41_000.0);
    let tones: Vec<(f64, f64)> = (0..40)
        .map(|i| (TAU * f64::from(20 + i), random.random_range(0.0..TAU)))
        .collect();
    let mut text = String::from("time (s),force (N),acceleration (m/s2)\n");
    for i in 0..3000 {
        let t = f64::from(i) / 180.0;
        let (mut force, mut acceleration) = (noise(&mut random, 0.02), noise(&mut random, 0.05));
        for (omega, phase) in &tones {
            let (real, imaginary) = (stiffness - mass * omega * omega, damping * omega);
            let size = omega * omega / real.hypot(imaginary);
            force += (omega * t + phase).sin();
            acceleration -= size * (omega * t + phase - imaginary.atan2(real)).sin();
        }
        let digits = (7 - t.max(1.0).log10().floor() as usize).min(8);
        writeln!(text, "{t:.digits$},{force:.6},{acceleration:.6}").expect("a text");
    }
    let bench = Workbench::empty();
    bench.write("record.csv", &text);
    bench.run_to(0, &["init", "record.csv"]);
    for sigma in ["estimate", "{value: 0.02, kind: sensor}"] {
        let sigma = match sigma {
            "estimate" => Vec::new(),
            stated => vec![
                "--set".to_owned(),
                format!("experiments.0.sigma.force={stated}"),
            ],
        };
        let mut arguments = vec![
            "record.yaml",
            "--set",
            "experiments.0.force.interpolation=linear",
        ];
        arguments.extend(sigma.iter().map(String::as_str));
        let document = fit(&bench, &arguments);
        let reasons = kinds(&document["verdict"]["reasons"]);
        assert!(
            reasons.contains(&"interpolation_loss"),
            "{sigma:?}: {reasons:?}"
        );
    }
}

/// A decay whose frequency rises by 60 %: constants do not fit, and no force is why.
#[test]
fn no_force_is_proposed_for_a_decay() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut text = String::from("time (s),displacement (m)\n");
    for i in 0..2000 {
        let t = 0.01 * f64::from(i);
        let y = (-0.08 * t).exp() * (TAU * (2.0 * t + 0.03 * t * t)).cos();
        writeln!(text, "{t:.2},{:.6}", y + noise(&mut random, 0.002)).expect("a text");
    }
    let bench = Workbench::empty();
    bench.write("decay.csv", &text);
    let document = fit(&bench, &["decay.csv"]);
    assert_eq!(document["verdict"]["level"], "inadequate");
    let advice = kinds(&document["advice"]);
    assert!(!advice.contains(&"equation_of_motion"), "{advice:?}");
}

/// The jumps that a fit with total variation finds have parameters of their own: the study is of these.
#[test]
fn a_fit_that_finds_jumps_is_studied() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (mut y, mut v, step) = (1.0, 0.0, 1e-3);
    let mut text = String::from("time (s),displacement (m)\n");
    for i in 0..8000 {
        let t = step * f64::from(i);
        if i % 20 == 0 {
            writeln!(text, "{t:.2},{:.6}", y + noise(&mut random, 0.002)).expect("a text");
        }
        let stiffness = if t < 4.0 { 160.0 } else { 120.0 };
        // Symplectic: no drift of the amplitude.
        v -= step * (0.1 * v + stiffness * y);
        y += step * v;
    }
    let bench = Workbench::empty();
    bench.write("jump.csv", &text);
    bench.run_to(0, &["init", "jump.csv", "--mass", "1"]);
    let stiffness =
        "functions.stiffness={basis: nodal, start: 140, penalty: {kind: tv, weight: bic}}";
    bench.run_to(
        0,
        &["study", "jump.yaml", "--set", stiffness, "--out", "study"],
    );
    let study: Value = serde_json::from_str(&bench.read("study/study.json")).expect("a document");
    assert_eq!(study["status"], "complete");
}
