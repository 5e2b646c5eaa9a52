//! The width of the bump functions of the weak form, which is chosen from the record: a carriage of 95 kg on a positioning axis with ten
//! reversals in 24 s, at 1 kHz, with position and force. A controller follows trapezoidal velocities; data by an independent integrator. Seeds
//! are 0, 1, 2, ...

use crate::common::forced::white;
use kmcfit_core::assessment::EquationErrorIntervals;
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{
    Fit, FitSettings, MissingTerm, Solver, equation_balance, fit, missing_terms,
};
use kmcfit_core::structure::CoefficientKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Mass (kg), damping (N s/m), friction (N) and its width (m/s); noise of the encoder (m).
const MASS: f64 = 95.0;
const DAMPING: f64 = 200.0;
const FRICTION: f64 = 20.0;
const WIDTH: f64 = 2e-3;
const NOISE: f64 = 5e-6;
/// Samples per second, and in all.
const RATE: f64 = 1000.0;
const SAMPLES: usize = 24_001;

fn sign(v: f64) -> f64 {
    v / (v * v + WIDTH * WIDTH).sqrt()
}

/// Reference velocity: ten trapezia of alternating sign, with ramps of 0.1 to 0.3 s.
fn reference(seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut v = vec![0.0; SAMPLES];
    for j in 0..10 {
        let direction = if j % 2 == 0 { 1.0 } else { -1.0 };
        let size = direction * random.random_range(0.08..0.14);
        let ramp = random.random_range(0.1..0.3);
        for (i, v) in v.iter_mut().enumerate() {
            let since = i as f64 / RATE - 0.1 - 2.4 * f64::from(j);
            *v += size * f64::min(since / ramp, (2.16 - since) / ramp).clamp(0.0, 1.0);
        }
    }
    v
}

/// Force of the controller and displacement of the carriage with the force `friction(y, v)` beside that of the damping: the classical
/// method of Runge and Kutta with two steps a sample, under a force that is linear between its samples.
fn motion(seed: u64, friction: impl Fn(f64, f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let h = 0.5 / RATE;
    let acceleration = |y: f64, v: f64, f: f64| (f - DAMPING * v - friction(y, v)) / MASS;
    let (mut force, mut samples) = (vec![0.0], vec![0.0]);
    let [mut wanted, mut y, mut v, mut f] = [0.0; 4];
    for speed in reference(seed).into_iter().skip(1) {
        let next = 4e4 * (wanted - y) + 2500.0 * (speed - v);
        wanted += speed / RATE;
        for half in [0.0, 0.5] {
            let [f0, f1, f2] = [0.0, 0.25, 0.5].map(|part| f + (half + part) * (next - f));
            let a0 = acceleration(y, v, f0);
            let (y1, v1) = (y + 0.5 * h * v, v + 0.5 * h * a0);
            let a1 = acceleration(y1, v1, f1);
            let (y2, v2) = (y + 0.5 * h * v1, v + 0.5 * h * a1);
            let a2 = acceleration(y2, v2, f1);
            let (y3, v3) = (y + h * v2, v + h * a2);
            y += h / 6.0 * (v + 2.0 * v1 + 2.0 * v2 + v3);
            v += h / 6.0 * (a0 + 2.0 * a1 + 2.0 * a2 + acceleration(y3, v3, f2));
        }
        f = next;
        force.push(f);
        samples.push(y);
    }
    (force, samples)
}

/// The carriage with such a force, and a model with simple friction and a static force where `has_friction`.
fn carriage(seed: u64, has_friction: bool, friction: impl Fn(f64, f64) -> f64) -> Problem {
    let (force, exact) = motion(seed, friction);
    let noise = white(seed, 1, SAMPLES);
    let samples: Vec<f64> = (exact.iter().zip(noise))
        .map(|(y, e)| y + NOISE * e)
        .collect();
    let times: Vec<f64> = (0..SAMPLES).map(|i| i as f64 / RATE).collect();
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
    channel.weighting = Some(Weighting::Sigma(NOISE));
    let record = Record::new("carriage")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .channel(channel);
    let parts = [
        CoefficientSpec::constant(50.0),
        CoefficientSpec::constant(100.0),
        CoefficientSpec::fixed(0.0),
    ];
    let builder = Builder::new(parts)
        .record(record)
        .solver(Solver::EquationError);
    let builder = match has_friction {
        true => builder
            .coulomb_friction(CoefficientSpec::constant(10.0), WIDTH)
            .offset(CoefficientSpec::constant(0.0)),
        false => builder,
    };
    builder.build().expect("a problem")
}

fn fitted(problem: &Problem) -> Fit {
    let settings = FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    };
    fit(problem, &problem.start(), &settings, &mut |_| {}).expect("no simulation")
}

/// Mass and its standard error, and the length of the bump functions (s).
fn mass(problem: &Problem) -> (f64, f64, f64) {
    let found = fitted(problem);
    let theta = &found.best.parameters;
    let intervals = EquationErrorIntervals::of(problem, &found).expect("intervals");
    let covariance = intervals.bands.covariance.expect("a covariance");
    let balance = equation_balance(problem, theta).expect("a balance");
    (theta[0], covariance[(0, 0)].sqrt(), balance.bump_lengths[0])
}

fn springs(problem: &Problem) -> Vec<MissingTerm> {
    let mut found = missing_terms(problem, &fitted(problem).best.parameters);
    let is_spring = |m: &MissingTerm| m.term.name().contains("stiffness");
    found.retain(is_spring);
    found
}

/// Friction that depends on speed (Stribeck), position and direction.
fn real_friction(y: f64, v: f64) -> f64 {
    let of_speed = 1.0 + 0.5 * (-(v / 0.02) * (v / 0.02)).exp();
    let of_place = 1.0 + 0.25 * (TAU * y / 0.15).sin();
    let of_direction = if v > 0.0 { 1.15 } else { 0.85 };
    FRICTION * sign(v) * of_speed * of_place * of_direction
}

/// With friction that the model has only approximately the bump functions are shortened, and the mass is within its interval; a width of 1.5 s
/// gives 99 to 104 kg with a standard error of 3 kg.
#[test]
fn misfit_of_friction_shortens_the_bump_functions() {
    for seed in 0..4 {
        let (mass, error, length) = mass(&carriage(seed, true, real_friction));
        println!("{seed}: {mass} +- {error} kg, {length} s");
        assert!(length < 0.5, "{seed}: {length} s");
        assert!(
            (mass - MASS).abs() < 2.0 * error,
            "{seed}: {mass} +- {error}"
        );
        assert!(error < 2.0, "{seed}: {error}");
    }
}

/// Where the model is right the widest bump functions, 0.7 periods of the acceleration, have the smallest errors.
#[test]
fn a_right_model_keeps_the_widest_bump_functions() {
    for seed in 0..4 {
        let (mass, error, length) = mass(&carriage(seed, false, |_, _| 0.0));
        println!("{seed}: {mass} +- {error} kg, {length} s");
        assert!(length > 1.0, "{seed}: {length} s");
        assert!(
            (mass - MASS).abs() < 3.0 * error,
            "{seed}: {mass} +- {error}"
        );
    }
}

/// Neither friction that the model has only approximately nor none makes a spring missing; one that is missing is a linear one, not a
/// cubic one.
#[test]
fn a_missing_spring_is_a_spring() {
    let rough = springs(&carriage(0, true, real_friction));
    assert!(rough.is_empty(), "{rough:?}");
    let none = springs(&carriage(1, false, |_, _| 0.0));
    assert!(none.is_empty(), "{none:?}");
    let found = springs(&carriage(2, false, |y, _| 30.0 * y));
    let kinds: Vec<CoefficientKind> = found.iter().map(|m| m.term).collect();
    assert_eq!(kinds, [CoefficientKind::STIFFNESS]);
}
