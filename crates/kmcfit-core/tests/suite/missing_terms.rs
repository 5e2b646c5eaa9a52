//! Tests of the equation error for missing terms: forced oscillators of 1 Hz with one term that the model does not have, and without;
//! 1 % noise on the displacement, data by an independent integrator. Seeds are 0, 1, 2, ...

use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{FitSettings, MissingTerm, Solver, fit, missing_terms};
use kmcfit_core::structure::CoefficientKind;
use std::f64::consts::TAU;

const MASS: f64 = 2.0;
const STIFFNESS: f64 = TAU * TAU * MASS;
const SAMPLES: usize = 3000;
const KINDS: [CoefficientKind; 4] = [
    CoefficientKind::STATIC_FORCE,
    CoefficientKind::COULOMB_FRICTION,
    CoefficientKind::QUADRATIC_DAMPING,
    CoefficientKind::CUBIC_STIFFNESS,
];

/// Terms found missing in the record of a seed, which has `term`; `spacing` in s.
fn found(seed: u64, term: Option<CoefficientKind>, spacing: f64) -> Vec<MissingTerm> {
    let damping = 2.0 * MASS * TAU * [0.01, 0.03, 0.05][seed as usize % 3];
    let force: Vec<f64> = {
        // The same band at every sampling rate.
        let coarse = broadband(white(seed, 1, SAMPLES));
        let ratio = spacing / 0.05;
        let at = |i: usize| {
            let x = i as f64 * ratio;
            let j = (x as usize).min(SAMPLES - 2);
            coarse[j] + (x - j as f64) * (coarse[j + 1] - coarse[j])
        };
        (0..SAMPLES).map(at).collect()
    };
    // The size of the linear response sets those of the terms: each has about two per cent of the force of the spring.
    let linear = response(spacing, [0.0, 0.0], &force, |_, y, v, f| {
        (f - damping * v - STIFFNESS * y) / MASS
    });
    let part = |q: usize| rms(&linear.iter().map(|state| state[q]).collect::<Vec<f64>>());
    let [y, v] = [part(0), part(1)];
    let size = 0.02 * STIFFNESS * y;
    let extra = move |at: f64, speed: f64| match term {
        None => 0.0,
        Some(CoefficientKind::STATIC_FORCE) => size,
        Some(CoefficientKind::COULOMB_FRICTION) => size * (speed / (1e-3 * v)).tanh(),
        Some(CoefficientKind::QUADRATIC_DAMPING) => size / (v * v) * speed * speed.abs(),
        Some(_) => size / (y * y * y) * at * at * at,
    };
    let states = response(spacing, [0.0, 0.0], &force, |_, y, v, f| {
        (f - damping * v - STIFFNESS * y - extra(y, v)) / MASS
    });
    let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
    let sigma = 0.01 * rms(&exact);
    let noise = white(seed, 2, SAMPLES);
    let samples: Vec<f64> = exact
        .iter()
        .zip(noise)
        .map(|(y, e)| y + sigma * e)
        .collect();
    let times: Vec<f64> = (0..SAMPLES).map(|i| spacing * i as f64).collect();
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
    channel.weighting = Some(Weighting::Sigma(sigma));
    let record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .channel(channel);
    let parts = [MASS, damping, STIFFNESS].map(CoefficientSpec::constant);
    let builder = Builder::new(parts).record(record);
    let problem = builder.solver(Solver::EquationError).build().unwrap();
    let settings = FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    };
    let fit = fit(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    missing_terms(&problem, &fit.best.parameters)
}

/// Five records of each term at 20 or 50 samples per period: the first named term is the missing one in at least 19 of 20. Of 40
/// records with terms of a hundredth, all were named.
#[test]
fn the_missing_term_is_named() {
    let mut right = 0;
    for seed in 0..20 {
        let term = KINDS[seed as usize % 4];
        let spacing = [0.05, 0.02][seed as usize / 4 % 2];
        let found = found(seed, Some(term), spacing);
        right += usize::from(found.first().is_some_and(|first| first.term == term));
    }
    assert!(right >= 19, "{right}");
}

/// None of 200 records had a named term.
#[test]
fn no_term_is_named_where_none_is_missing() {
    let mut none = 0;
    for seed in 0..20 {
        let spacing = [0.05, 0.02][seed as usize / 4 % 2];
        let found = found(seed, None, spacing);
        none += usize::from(found.is_empty());
    }
    assert!(none >= 19, "{none}");
}
