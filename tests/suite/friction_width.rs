//! Width of Coulomb friction: a driven cart with the friction of the sign of the velocity, with sticking, from an independent integrator.

use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit::fitting::{ModelFit, fit_model};
use kmcfit_core::assessment::{Doubt, FitAssessment};
use kmcfit_core::solvers::Observer;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Mass (kg), damping (N s/m), stiffness (N/m) and friction (N).
const TRUTH: [f64; 4] = [95.0, 190.0, 4000.0, 40.0];
const NAMES: [&str; 4] = ["mass", "damping", "stiffness", "coulomb_friction"];
/// Sampling interval, s.
const SPACING: f64 = 0.01;
const SAMPLES: usize = 2001;
/// Steps of the data's integrator per sample: a step of 1e-5 s.
const SUBSTEPS: usize = 1000;
/// Noise of the displacement relative to its root mean square.
const NOISE: f64 = 0.03;

fn white(seed: u64, stream: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    (0..count)
        .map(|_| StandardNormal.sample(&mut random))
        .collect()
}

/// Force at the samples, linear in between.
fn force(seed: u64) -> Vec<f64> {
    let mut smooth = 0.0;
    let each = white(seed, 1, SAMPLES).into_iter().map(|e| {
        smooth = 0.95 * smooth + 0.3 * e;
        120.0 * smooth
    });
    each.collect()
}

/// Displacement at the samples, and the share of the time in which the cart sticks: the velocity steps without friction, and the
/// impulse of the friction then takes up to `h F/m` of it (time stepping of Moreau), which is exact at rest.
fn response(force: &[f64], friction: f64) -> (Vec<f64>, f64) {
    let [m, c, k, _] = TRUTH;
    let h = SPACING / SUBSTEPS as f64;
    let (mut y, mut v) = (0.0, 0.0f64);
    let mut sticks = 0;
    let mut displacement = vec![y];
    for pair in force.windows(2) {
        for s in 0..SUBSTEPS {
            let share = (s as f64 + 0.5) / SUBSTEPS as f64;
            let f = pair[0] + share * (pair[1] - pair[0]);
            // The midpoint rule for the smooth forces.
            let half = v + 0.5 * h * (f - c * v - k * y) / m;
            let free = v + h * (f - c * half - k * (y + 0.5 * h * v)) / m;
            let held = h * friction / m;
            let next = free.signum() * (free.abs() - held).max(0.0);
            y += 0.5 * h * (v + next);
            v = next;
            sticks += usize::from(v == 0.0);
        }
        displacement.push(y);
    }
    (
        displacement,
        sticks as f64 / ((SAMPLES - 1) * SUBSTEPS) as f64,
    )
}

fn write_record(folder: &Path, seed: u64, friction: f64, noise: f64) {
    let force = force(seed);
    let (displacement, sticks) = response(&force, friction);
    assert!((0.02..0.7).contains(&sticks), "{seed}: sticks for {sticks}");
    let squares: f64 = displacement.iter().map(|y| y * y).sum();
    let sigma = noise * (squares / SAMPLES as f64).sqrt();
    let mut table = "t_s,f_N,y_m\n".to_owned();
    let white = white(seed, 2, SAMPLES);
    for (i, (f, y)) in force.iter().zip(&displacement).enumerate() {
        writeln!(table, "{},{f},{}", SPACING * i as f64, y + sigma * white[i]).unwrap();
    }
    fs::write(folder.join("record.csv"), table).unwrap();
}

fn fitted(folder: &Path, width: &str) -> ModelFit {
    let yaml = format!(
        "format: 1\nexperiments:\n  - name: cart\n    data: record.csv\n    columns: {{displacement: y_m, force: f_N}}\n    \
         sigma: {{displacement: estimate}}\n    initial: {{displacement: 0.0, velocity: 0.0}}\nfunctions:\n  \
         mass: {{basis: constant, start: 120.0}}\n  damping: {{basis: constant, start: 100.0}}\n  \
         stiffness: {{basis: constant, start: 4500.0}}\n  \
         coulomb_friction: {{basis: constant, start: 20.0, width: {width}}}\n"
    );
    let file = ModelFile::parse(folder.join("model.yaml"), yaml).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    fit_model(&model, &mut Observer::new(&mut |_| {})).unwrap()
}

fn warning(found: &ModelFit) -> Option<Doubt> {
    let assessment = FitAssessment::of(&found.model.problem, &found.fit, false);
    let mut warnings = assessment.plausibility.warnings.into_iter();
    warnings.find(|w| matches!(w, Doubt::FrictionWidth { .. }))
}

/// A wide width is a warning that names an estimate and its shift.
#[test]
fn a_wide_width_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    write_record(folder.path(), 0, TRUTH[3], NOISE);
    let found = fitted(folder.path(), "0.02");
    let Some(Doubt::FrictionWidth {
        estimate,
        shift,
        errors: in_errors,
        width,
        ..
    }) = warning(&found)
    else {
        panic!("no warning");
    };
    println!("{estimate}: {shift:?}, {in_errors} standard errors");
    assert_eq!(width, 0.02);
    // The linearised shift is that of a fit with half the width.
    let j = NAMES.iter().position(|name| *name == estimate).unwrap();
    let half = fitted(folder.path(), "0.01");
    let moved = half.fit.best.parameters[j] - found.fit.best.parameters[j];
    let shift = shift.expect("a constant");
    println!("  refitted: {moved}");
    assert!((moved / shift - 1.0).abs() < 0.5, "{moved} {shift}");
}
