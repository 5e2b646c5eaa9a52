//! Coverage of 95 % bands of a natural frequency that varies over 400 periods, by the equation error on automatic knots: 1 Hz, 20 samples a
//! second, forced and free; data by an independent integrator. Seeds are 0, 1, 2, ...

use crate::common::forced::{response, rms, white};
use kmcfit_core::assessment::EquationErrorIntervals;
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::identifiability::Band;
use kmcfit_core::model::{AutoWord, CoefficientSpec, KnotSpec};
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{FitSettings, Solver, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const MASS: f64 = 2.0;
const SPACING: f64 = 0.05;
const SAMPLES: usize = 8001;
/// Steps of the force per sample.
const FINE: usize = 10;

/// Square of the natural frequency over its level, as a function of the share of the record.
type Course = fn(f64) -> f64;

const COURSES: [Course; 5] = [
    |x| 1.0 + 0.15 * (TAU * x).sin(),
    |x| 1.0 + 0.15 * (3.0 * TAU * x).sin(),
    |x| 1.0 + 0.1 * (8.0 * TAU * x).sin(),
    |x| 1.0 + 0.05 * (12.0 * TAU * x).sin(),
    |x| 1.0 - 0.2 * (-((x - 0.5) / 0.03) * ((x - 0.5) / 0.03)).exp(),
];

/// Shares of the samples at which the bands of `k/m` and of `k` hold these, with `noise` relative to the root mean square of the
/// displacement.
fn coverage(course: Course, is_forced: bool, noise: f64, seed: u64) -> [f64; 2] {
    let zeta = if is_forced { 0.01 } else { 8e-4 };
    let squared = |t: f64| TAU * TAU * course(t / (SPACING * (SAMPLES - 1) as f64));
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    // Finer than the samples, as the response is that to a force that is linear in between.
    let fine = (0..(SAMPLES - 1) * FINE + 1).map(|i| SPACING * i as f64 / FINE as f64);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 2]> = (0..60)
        .map(|_| [random.random_range(0.2..3.0), random.random_range(0.0..1.0)])
        .collect();
    let size = if is_forced { 1.0 } else { 0.0 };
    let wave = |t: f64| {
        waves
            .iter()
            .map(move |[f, phase]| (TAU * (f * t + phase)).sin())
    };
    let force: Vec<f64> = fine.map(|t| size * wave(t).sum::<f64>()).collect();
    let at_rest = if is_forced { 0.0 } else { 1.0 };
    let spacing = SPACING / FINE as f64;
    let states = response(spacing, [at_rest, 0.0], &force, |t, y, v, f| {
        f / MASS - 2.0 * zeta * TAU * v - squared(t) * y
    });
    let states = states.into_iter().step_by(FINE);
    let force: Vec<f64> = force.into_iter().step_by(FINE).collect();
    let exact: Vec<f64> = states.map(|[y, ..]| y).collect();
    let sigma = noise * rms(&exact);
    let samples: Vec<f64> = (exact.iter().zip(white(seed, 1, SAMPLES)))
        .map(|(y, e)| y + sigma * e)
        .collect();
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
    channel.weighting = Some(Weighting::Sigma(sigma));
    let record = Record::new("long")
        .from_state(at_rest, 0.0)
        .channel(channel);
    let (record, mass) = match is_forced {
        true => (record.force(&times, &force), CoefficientSpec::constant(1.5)),
        false => (record, CoefficientSpec::fixed(MASS)),
    };
    let stiffness = CoefficientSpec::b_spline(2, 70.0).knots(KnotSpec::Auto(AutoWord));
    let builder = Builder::new([mass, CoefficientSpec::constant(0.2), stiffness]);
    let builder = builder.record(record).solver(Solver::EquationError);
    let problem = builder.build().expect("a problem");
    let settings = FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    };
    let found = fit(&problem, &problem.start(), &settings, &mut |_| {}).expect("no simulation");
    let intervals = EquationErrorIntervals::of(&problem, &found).expect("intervals");
    let bands = intervals.bands;
    let share = |band: &Band, scale: f64| {
        let holds = |(i, t): (usize, &f64)| {
            let point = &band.points[i];
            (point.value - scale * squared(*t)).abs() <= point.half_width()
        };
        let held = bands.times.iter().enumerate().filter(|at| holds(*at));
        held.count() as f64 / bands.times.len() as f64
    };
    let named = |all: &[Band], name: &str| all.iter().find(|band| band.name == name).cloned();
    let ratio = named(&bands.ratios, "k/m").expect("k/m");
    let stiffness = named(&bands.functions, "stiffness").expect("k");
    [share(&ratio, 1.0), share(&stiffness, MASS)]
}

/// Those of `k/m` hold at 80 % of the samples each, and all at 90 % on average. With 40 intervals, and without the error of the spline in
/// the band, twelve cycles held at 48 %. Those of `k`, known through the force, hold at 90 % on average.
#[test]
fn bands_of_a_frequency_that_varies_over_400_periods_hold() {
    let (mut ratios, mut stiffnesses) = (Vec::new(), Vec::new());
    for (i, course) in COURSES.into_iter().enumerate() {
        for (is_forced, noise) in [
            (true, 1e-3),
            (true, 5e-3),
            (true, 2e-2),
            (false, 1e-3),
            (false, 5e-3),
        ] {
            let [ratio, stiffness] = coverage(course, is_forced, noise, i as u64);
            println!("course {i}, forced {is_forced}, noise {noise}: {ratio:.3} {stiffness:.3}");
            assert!(
                ratio > 0.8,
                "course {i}, forced {is_forced}, noise {noise}: {ratio}"
            );
            ratios.push(ratio);
            if is_forced {
                stiffnesses.push(stiffness);
            }
        }
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    assert!(mean(&ratios) > 0.9, "{ratios:?}");
    assert!(mean(&stiffnesses) > 0.9, "{stiffnesses:?}");
}
