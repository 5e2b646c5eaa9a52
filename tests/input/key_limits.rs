//! The ranges and companions that the documentation of the keys states are those that the reader demands.

use kmcfit::config::key_documentation::all;
use kmcfit::config::{BuildMode, ModelFile, Override, build};
use std::collections::BTreeSet;
use std::path::Path;

/// Settings beyond a stated range: a shipped model, key and value.
const BEYOND: &[(&str, &str)] = &[
    ("linear-mass", "grid.nodes=2"),
    ("paper-device", "grid.duration=0"),
    ("knots", "functions.mass.knots=1"),
    ("linear-mass", "functions.mass.start=-1"),
    ("linear-mass", "functions.mass={fixed: 0.0}"),
    (
        "linear-mass",
        "functions.mass={basis: constant, start: 1.0, known_part: 0.0}",
    ),
    ("camera", "functions.mass={fixed: {value: 1.0, sigma: 0}}"),
    (
        "linear-mass",
        "functions.mass={basis: constant, start: 1.0, min: 2.0, max: 1.0}",
    ),
    ("friction", "functions.coulomb_friction.width=0"),
    (
        "knots",
        "functions.mass.penalty={kind: tikhonov, order: 3, weight: 1}",
    ),
    (
        "knots",
        "functions.mass.penalty={kind: tikhonov, order: 1, weight: -1}",
    ),
    (
        "linear-mass",
        "constraints=[{function: mass, slope: {min: 1, max: 0}}]",
    ),
    (
        "linear-mass",
        "constraints=[{function: mass, at: 30.0, value: 1.0}]",
    ),
    ("linear-mass", "constraints=[{equal: [mass]}]"),
    (
        "linear-mass",
        "constraints=[{equal: [mass, damping], ratio: 0}]",
    ),
    ("linear-mass", "constraints=[{frequency: {min: 0}}]"),
    ("linear-mass", "constraints=[{damping_ratio: {min: 0.1}}]"),
    (
        "linear-mass",
        "constraints=[{function: mass, max: 3, soft: 0}]",
    ),
    ("paper-lbfgs", "fit.memory=0"),
    ("linear-mass", "fit.stop.cost_ratio=0"),
    ("linear-mass", "fit.stop.gradient_ratio=0"),
    ("linear-mass", "fit.stop.tolerance=0"),
    ("linear-mass", "fit.stop.step=0"),
    ("linear-mass", "fit.stop.seconds=0"),
    (
        "linear-mass",
        "experiments.0.columns={displacement: {column: y_m, sample_rate: 0}}",
    ),
    ("linear-mass", "experiments.0.window={min: 3, max: 2}"),
    ("linear-mass", "experiments.0.decimate=0"),
    ("linear-mass", "experiments.0.band={min: 0.1, max: 200}"),
    (
        "linear-mass",
        "experiments=[{data: ../data/paper.csv, columns: {velocity: y_m}, sigma: {velocity: 0}, initial: estimate}]",
    ),
    ("hammer-and-shaker", "experiments.2.sigma={acceleration: 0}"),
    ("linear-mass", "experiments.0.sigma={displacement: 0}"),
    (
        "paper-forced",
        "experiments.0.sigma={displacement: 1, force: {value: 0, kind: sensor}}",
    ),
    (
        "camera",
        "experiments.0.loss={displacement: {name: huber, threshold: 0}}",
    ),
    (
        "camera",
        "experiments.0.loss={displacement: {name: student-t, degrees: 0}}",
    ),
    ("camera", "experiments.0.noise={displacement: {ar: 13}}"),
    ("camera", "experiments.0.sensors={displacement: {gain: 0}}"),
    (
        "camera",
        "experiments.0.sensors={displacement: {gain: {prior: {mean: 1, sigma: 0}}}}",
    ),
    (
        "linear-mass",
        "experiments.0.force={shape: sine, amplitude: 1, frequency: 0}",
    ),
    (
        "linear-mass",
        "experiments.0.force={shape: half-sine, amplitude: 1, duration: 0}",
    ),
    ("linear-mass", "study={confidence: 1}"),
    ("linear-mass", "study={extremes: [99]}"),
    ("linear-mass", "study={misfit_limit: 0}"),
    ("linear-mass", "study={starts: 0}"),
    ("linear-mass", "study={starts: 2, spread: 1}"),
    ("linear-mass", "study={starts: 2, merge_tolerance: 0}"),
    (
        "linear-mass",
        "study={profiles: [{function: mass, at: 99}]}",
    ),
    (
        "linear-mass",
        "study={equivalent_systems: [{name: a, mass: 0}]}",
    ),
];

/// Settings without what the key needs.
const ALONE: &[(&str, &str)] = &[
    ("linear-mass", "functions.stiffness={fixed: 1.0, knots: 3}"),
    ("linear-mass", "functions.stiffness={fixed: 1.0, min: 0.5}"),
    ("linear-mass", "functions.damping.width=1"),
    ("paper-lbfgs", "functions.mass.min=0.1"),
    (
        "knots",
        "functions.mass.penalty={kind: tv, weight: 1, order: 1}",
    ),
    (
        "knots",
        "functions.mass.penalty={kind: tv, weight: discrepancy}",
    ),
    (
        "knots",
        "functions.mass.penalty={kind: tikhonov, order: 1, weight: discrepancy}",
    ),
    (
        "knots",
        "functions.mass.penalty={kind: tikhonov, order: 1, weight: period}",
    ),
    (
        "knots",
        "functions.mass.penalty={kind: tikhonov, order: 1, weight: 1, reference: 2}",
    ),
    (
        "paper-lbfgs",
        "functions.mass.penalty={kind: tv, weight: 1}",
    ),
    ("linear-mass", "constraints=[{min: 1.0}]"),
    ("linear-mass", "constraints=[{function: mass, at: 1.0}]"),
    (
        "linear-mass",
        "constraints=[{damping_ratio: {max: 0.1}, soft: 1}]",
    ),
    ("linear-mass", "fit.memory=3"),
    ("paper-lbfgs", "fit.qp=auto"),
    ("moving-support", "fit.initial=data"),
    ("moving-support", "fit.gradient=discrete"),
    ("noisy", "fit.gradient=continuous"),
    ("linear-mass", "experiments.0.sample_rate=100"),
    ("camera", "experiments.0.decimate=2"),
    ("camera", "functions.mass={fixed: {value: 1.0}}"),
    ("camera", "functions.mass={fixed: {sigma: 1.0}}"),
    ("camera", "functions.mass={fixed: {data: camera.csv}}"),
    ("camera", "functions.mass={fixed: {column: mass_kg}}"),
    ("camera", "functions.mass={fixed: 1.0, known_part: 1.0}"),
    (
        "linear-mass",
        "functions.mass={fixed: {value: 1.0, sigma: 0.1}}",
    ),
    ("linear-mass", "experiments.0.loss={displacement: huber}"),
    ("linear-mass", "experiments.0.base={interpolation: cubic}"),
    ("linear-mass", "experiments.0.validation=true"),
    ("linear-mass", "experiments.0.sigma={velocity: 1}"),
    (
        "linear-mass",
        "experiments.0.sigma={displacement: 1, force: {value: 1, kind: sensor}}",
    ),
    (
        "linear-mass",
        "experiments.0.sigma={displacement: 1, base_acceleration: {value: 1, kind: drive}}",
    ),
    (
        "camera",
        "experiments.0.sensors={displacement: {absolute: true}}",
    ),
    ("linear-mass", "experiments.0.force={interpolation: cubic}"),
    ("linear-mass", "experiments.0.force={amplitude: 1}"),
    ("linear-mass", "study={profiles: [{function: stiffness}]}"),
];

fn is_refused(model: &str, setting: &str) -> bool {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("models/{model}.yaml"));
    let file = ModelFile::read(path).expect(model);
    let change = Override::parse(setting).expect(setting);
    let file = file.with_overrides(&[change]).expect(setting);
    let mode = match file.spec.experiments.iter().any(|e| e.data.is_some()) {
        true => BuildMode::Fit,
        false => BuildMode::Simulate { nodes: None },
    };
    build(&file, mode).is_err()
}

#[test]
fn values_beyond_a_range_and_keys_alone_are_refused() {
    for (model, setting) in BEYOND.iter().chain(ALONE) {
        assert!(is_refused(model, setting), "{model}: {setting}");
    }
}

#[test]
fn every_stated_range_is_tested() {
    let word = |c: char| !c.is_alphanumeric() && c != '_';
    let tested: BTreeSet<&str> = BEYOND.iter().flat_map(|(_, s)| s.split(word)).collect();
    for key in all()
        .iter()
        .map(|found| found.key)
        .filter(|key| key.range.is_some())
    {
        assert!(tested.contains(key.name), "{}", key.name);
    }
}
