//! Records on which the program once misled: reasons, advice and analyses of what they say now.

use crate::workbench::{Workbench, repository};
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

/// Forced vibration at five samples a period of its natural frequency, in steady state: lines lose a tenth of the force, which is no reason to doubt
/// its stated noise. The times have eight significant digits.
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
        assert!(
            !reasons.contains(&"contradicted_input_sigma"),
            "{reasons:?}"
        );
    }
}

/// A sweep through the natural frequency: at seven samples a period lines take a share of the force that looks like a cubic stiffness, and at
/// 28 they hide none that is there.
#[test]
fn a_loss_by_lines_is_no_term_and_hides_none() {
    for (every, cubic) in [(40, 0.0), (10, 3e7)] {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let force = |t: f64| 3.0 * (TAU * (20.0 + t) * t).sin();
        let acceleration = |t: f64, y: f64, v: f64| {
            (force(t) - 3.7385 * v - 41_107.0 * y - cubic * y.powi(3)) / 0.85
        };
        let (mut y, mut v, step) = (0.0, 0.0, 1e-4);
        let mut text = String::from("time (s),force (N),displacement (mm)\n");
        for i in 0..200_000 {
            let t = step * f64::from(i);
            if i % every == 0 {
                let [f, y] = [(force(t), 0.1), (1e3 * y, 0.004)]
                    .map(|(exact, sigma)| exact + noise(&mut random, sigma));
                writeln!(text, "{t:.3},{f:.5},{y:.6}").expect("a text");
            }
            // The midpoint rule: its relative error of the frequency, (omega h)^2 / 6, is 8e-5.
            let middle = (y + 0.5 * step * v, v + 0.5 * step * acceleration(t, y, v));
            y += step * middle.1;
            v += step * acceleration(t + 0.5 * step, middle.0, middle.1);
        }
        let bench = Workbench::empty();
        bench.write("sweep.csv", &text);
        bench.run_to(0, &["init", "sweep.csv"]);
        let arguments = [
            "sweep.yaml",
            "--set",
            "experiments.0.force.interpolation=linear",
            "--set",
            "experiments.0.sigma={displacement: 4e-6, force: {value: 0.1, kind: sensor}}",
        ];
        let document = fit(&bench, &arguments);
        let reasons = kinds(&document["verdict"]["reasons"]);
        let is_there = cubic > 0.0;
        assert!(reasons.contains(&"interpolation_loss"), "{reasons:?}");
        // What the table shows is no other answer.
        let list = document["candidates"]["list"].as_array().expect("a list");
        let term = list.iter().find(|c| c["name"] == "cubic_stiffness");
        let gain = term.and_then(|c| c["gain"].as_f64()).expect("a gain");
        assert_eq!(gain >= 6.0, is_there, "{gain}");
        let best = &list[0];
        assert_eq!(best["name"] == "cubic_stiffness", is_there, "{best}");
    }
}

/// A steady response at 3 Hz of a system of 10 Hz, stated to begin at rest: what oscillates beside it at 10 Hz is the system, at 25 Hz another
/// source.
#[test]
fn a_tone_of_the_system_has_no_other_cause() {
    let (stiffness, damping) = (2.0 * (TAU * 10.0).powi(2), 0.8);
    let drive = TAU * 3.0;
    let (real, imaginary) = (stiffness - 2.0 * drive * drive, damping * drive);
    for (tone, is_other) in [(10.0, false), (25.0, true)] {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut text = String::from("time (s),force (N),displacement (mm)\n");
        for i in 0..1600 {
            let t = 0.005 * f64::from(i);
            let y = 10.0 / real.hypot(imaginary) * (drive * t - imaginary.atan2(real)).sin();
            let decay = if is_other { 0.0 } else { damping / 4.0 };
            let beside = 0.3 * (-decay * t).exp() * (TAU * tone * t).sin();
            let y = 1e3 * y + beside + noise(&mut random, 0.002);
            writeln!(text, "{t:.3},{:.6},{y:.6}", 10.0 * (drive * t).sin()).expect("a text");
        }
        let initial = match is_other {
            true => "estimate",
            false => "{displacement: 0.0, velocity: 0.0}",
        };
        let bench = Workbench::empty();
        bench.write("record.csv", &text);
        let parts = format!(
            "mass: {{fixed: 2.0}}, damping: {{fixed: {damping}}}, stiffness: {{basis: constant, start: {stiffness}}}"
        );
        bench.write(
            "model.yaml",
            &format!(
                "format: 1\nexperiments:\n  - {{data: record.csv, columns: {{time: 1, force: 2, displacement: 3}}, force: {{interpolation: cubic}}, sigma: {{displacement: estimate}}, initial: {initial}}}\nfunctions: {{{parts}}}\n"
            ),
        );
        let document = fit(&bench, &["model.yaml"]);
        let pattern = &document["experiments"][0]["channels"][0]["pattern"]["tone"];
        let found = pattern["frequency"].as_f64().expect("a tone");
        assert!((found / tone - 1.0).abs() < 0.05, "{found}");
        let advice = kinds(&document["advice"]);
        assert_eq!(advice.contains(&"restrict_band"), is_other, "{advice:?}");
        let mut all = document["advice"].as_array().expect("advice").iter();
        if let Some(band) = all.find(|advice| advice["kind"] == "restrict_band") {
            let set = band["set"][0].as_str().expect("a change");
            let (_, limit) = set.split_once("band.max=").expect("an upper limit");
            let limit: f64 = limit.parse().expect("a frequency");
            assert!((12.0..20.0).contains(&limit), "{set} cuts the system");
        }
    }
}

/// The friction of the shipped record is smoothed over 0.01 m/s: that width is no doubt about the model, and from others the advice leads to it. The
/// gain of a sensor beside free coefficients is the width by another name.
#[test]
fn the_width_of_friction_is_that_of_the_record() {
    let model = repository("models/friction.yaml");
    let model = model.to_str().expect("a path");
    let bench = Workbench::empty();
    for width in [0.01f64, 0.02, 0.0025, 0.000_625] {
        let key = "functions.coulomb_friction.width=";
        let document = fit(&bench, &[model, "--set", &format!("{key}{width}")]);
        let reasons = kinds(&document["verdict"]["reasons"]);
        let expected: &[&str] = if width == 0.01 {
            &[]
        } else {
            &["friction_width"]
        };
        assert_eq!(reasons, expected, "{width}");
        let advice = &document["advice"][0];
        if width != 0.01 {
            let tried = advice["tried"].as_str().expect("an outcome");
            let set = advice["set"][0].as_str().expect("an override");
            let to: f64 = set
                .strip_prefix(key)
                .expect("a width")
                .parse()
                .expect("a number");
            let far = |width: f64| (width / 0.01).ln().abs();
            assert!(
                tried.starts_with("tried") && far(to) < far(width),
                "{width}: {advice}"
            );
        }
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
