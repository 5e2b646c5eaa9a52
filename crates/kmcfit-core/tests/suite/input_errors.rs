//! Coverage of 95 % intervals with errors of the force: constants m, c, k of a forced oscillator of 1 Hz, 50 cycles, N = 1000,
//! 1 % noise of the displacement; data by an independent integrator. Seeds are 0, 1, 2, ...
//!
//! `.ci/long input` counts 200 seeds.

use crate::common::counts::{least_held, seeds, widened};
use crate::common::forced::{self, broadband, rms};
use kmcfit_core::assessment::{Doubt, Plausibility};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, InputNoiseKind, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, Status, fit_with_noise};
use kmcfit_core::system::{InputQuantity, Method};
use std::f64::consts::TAU;

const SPACING: f64 = 0.05;
const SAMPLES: usize = 1000;

/// Mass (kg), damping (N s/m) and stiffness (N/m) of a damping ratio.
fn truth(ratio: f64) -> [f64; 3] {
    [2.0, 2.0 * ratio * TAU * 2.0, TAU * TAU * 2.0]
}

fn white(seed: u64, stream: u64) -> Vec<f64> {
    forced::white(seed, stream, SAMPLES)
}

/// Broadband force at the samples, N.
fn force() -> Vec<f64> {
    broadband(white(99, 2))
}

/// Displacements under a force.
fn response(system: [f64; 3], force: &[f64]) -> Vec<f64> {
    states(system, force).into_iter().map(|[y, _]| y).collect()
}

/// Displacements and velocities under a force.
fn states([m, c, k]: [f64; 3], force: &[f64]) -> Vec<[f64; 2]> {
    let states = forced::response(SPACING, [0.0, 0.0], force, |_, y, v, f| {
        (f - c * v - k * y) / m
    });
    states.into_iter().map(|[y, v, _]| [y, v]).collect()
}

/// Accelerations under a force.
fn accelerations([m, c, k]: [f64; 3], force: &[f64]) -> Vec<f64> {
    let states = states([m, c, k], force).into_iter().zip(force);
    states.map(|([y, v], f)| (f - c * v - k * y) / m).collect()
}

/// A case: share of the noise in the force, damping ratio, what the noise is, and as what the fit treats it.
#[derive(Debug, Clone, Copy)]
struct Case {
    share: f64,
    ratio: f64,
    is: InputNoiseKind,
    stated: Option<InputNoiseKind>,
    /// Multiple of the true sigma of the force that is stated.
    factor: f64,
    /// True if the sigma of the channel is estimated.
    estimates_sigma: bool,
    /// First coefficient of autoregressive noise of the channel.
    correlation: f64,
    /// The channel: displacement or acceleration.
    kind: ChannelKind,
    nodes: usize,
}

impl Case {
    const PLAIN: Self = Self {
        share: 0.0,
        ratio: 0.03,
        is: InputNoiseKind::Sensor,
        stated: None,
        factor: 1.0,
        estimates_sigma: false,
        correlation: 0.0,
        kind: ChannelKind::Displacement,
        nodes: 2 * (SAMPLES - 1) + 1,
    };
}

fn fitted(case: Case, seed: u64) -> (Problem, Fit) {
    let truth = truth(case.ratio);
    let known = force();
    let size = case.share * rms(&known);
    let noise = white(seed, 3);
    let disturbed: Vec<f64> = known
        .iter()
        .zip(&noise)
        .map(|(f, e)| f + size * e)
        .collect();
    let (acting, measured) = match case.is {
        InputNoiseKind::Sensor => (&known, &disturbed),
        InputNoiseKind::Drive => (&disturbed, &known),
    };
    let clean = match case.kind {
        ChannelKind::Acceleration => accelerations(truth, acting),
        _ => response(truth, acting),
    };
    let sigma = 0.01 * rms(&clean);
    let mut noise = 0.0;
    let own = white(seed, 4).into_iter().map(|e| {
        noise = case.correlation * noise + (1.0 - case.correlation.powi(2)).sqrt() * e;
        sigma * noise
    });
    let samples: Vec<f64> = clean.iter().zip(own).map(|(y, e)| y + e).collect();
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    let mut channel = ChannelSpec::new(case.kind, &times, &samples);
    channel.weighting = Some(match case.estimates_sigma {
        true => Weighting::Estimated { sigma },
        false => Weighting::Sigma(sigma),
    });
    let mut record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&times, measured)
        .channel(channel);
    if let Some(kind) = case.stated {
        record = record.input_error(InputQuantity::Force, kind, case.factor * size);
    }
    let problem = Builder::new(truth.map(|p| CoefficientSpec::constant(1.02 * p)))
        .record(record)
        .nodes(case.nodes)
        .method(Method::Rk4)
        .build()
        .unwrap();
    let settings = FitSettings::default();
    fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {}).unwrap()
}

/// Standardised errors of m, c and k, one for each seed.
fn errors(case: Case, seeds: u64) -> Vec<[f64; 3]> {
    let each = (0..seeds).map(|seed| {
        let (problem, fit) = fitted(case, seed);
        assert_eq!(fit.outcome.status, Status::Converged, "{case:?} {seed}");
        let covariance = problem.covariance(&fit.best.evaluation).unwrap();
        let truth = truth(case.ratio);
        std::array::from_fn(|j| (fit.best.parameters[j] - truth[j]) / covariance[(j, j)].sqrt())
    });
    each.collect()
}

/// Counts of intervals that hold, and means of the standardised errors.
fn summary(errors: &[[f64; 3]]) -> ([usize; 3], [f64; 3]) {
    let holds = |j: usize| errors.iter().filter(|e| e[j].abs() <= 1.96).count();
    let mean = |j: usize| errors.iter().map(|e| e[j]).sum::<f64>() / errors.len() as f64;
    (std::array::from_fn(holds), std::array::from_fn(mean))
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for is in [InputNoiseKind::Sensor, InputNoiseKind::Drive] {
        for ratio in [0.01, 0.03] {
            for share in [0.01, 0.05, 0.1] {
                cases.push(Case {
                    share,
                    ratio,
                    is,
                    stated: Some(is),
                    ..Case::PLAIN
                });
            }
        }
    }
    cases
}

/// An acceleration has the error of the force at its own time, whatever the nodes: neither is the stated sigma contradicted nor are the intervals
/// too narrow with nodes between the samples.
#[test]
fn errors_of_the_force_pass_into_accelerations_between_nodes() {
    let seeds = seeds(6, 20);
    let case = Case {
        share: 0.05,
        stated: Some(InputNoiseKind::Sensor),
        kind: ChannelKind::Acceleration,
        nodes: 4 * SAMPLES / 3,
        ..Case::PLAIN
    };
    for seed in 0..seeds {
        let (problem, fit) = fitted(case, seed);
        let warnings = Plausibility::at(&problem, &fit.best.evaluation).warnings;
        let is_contradiction = |w: &Doubt| matches!(w, Doubt::ContradictedInputSigma { .. });
        assert!(
            !warnings.iter().any(is_contradiction),
            "{seed}: {warnings:?}"
        );
    }
    let (counts, _) = summary(&errors(case, seeds));
    let hold = counts.iter().all(|held| *held >= least_held(seeds));
    assert!(hold, "{counts:?}");
}

/// Of a free mass an acceleration has the error of the force at its own time, over the mass, also with nodes between the samples.
#[test]
fn an_acceleration_has_the_error_of_the_force_at_its_time() {
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    let (mass, sigma) = (2.0, 0.1);
    let accelerations: Vec<f64> = force().iter().map(|f| f / mass).collect();
    let mut channel = ChannelSpec::new(ChannelKind::Acceleration, &times, &accelerations);
    channel.weighting = Some(Weighting::Sigma(0.01));
    let record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&times, &force())
        .channel(channel)
        .input_error(InputQuantity::Force, InputNoiseKind::Drive, sigma);
    let parts = [
        CoefficientSpec::constant(mass),
        CoefficientSpec::fixed(0.0),
        CoefficientSpec::fixed(0.0),
    ];
    let problem = Builder::new(parts)
        .record(record)
        .nodes(4 * SAMPLES / 3)
        .method(Method::Rk4)
        .build()
        .unwrap();
    let settings = FitSettings::default();
    let (problem, fit) =
        fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let mass = fit.best.parameters[0];
    let correlation = problem.experiments[0].channels[0].correlation();
    let effect = correlation.and_then(|c| c.input_errors());
    let errors = white(1, 5);
    let found = effect.expect("errors of the force").response(&errors);
    for (found, error) in found.iter().zip(&errors) {
        assert!((found - error / mass).abs() < 1e-12, "{found} {error}");
    }
}

#[test]
fn intervals_hold_with_errors_of_the_force() {
    let seeds = seeds(6, 20);
    let (mut held, mut all) = (0, 0);
    for case in cases().into_iter().filter(|case| case.share > 0.01) {
        let (counts, _) = summary(&errors(case, seeds));
        let hold = counts.iter().all(|held| *held >= least_held(seeds));
        assert!(hold, "{case:?}: {counts:?}");
        held += counts.iter().sum::<usize>();
        all += 3 * seeds;
    }
    // Those of one record are correlated.
    let share = held as f64 / all as f64;
    assert!(share >= 0.95 - widened(0.05, 360, all), "{share}");
}

/// The same noise without its sigma: most intervals miss the truth, so that the test above detects a fit that ignores it.
#[test]
fn intervals_that_ignore_errors_of_the_force_are_too_short() {
    let case = Case {
        share: 0.1,
        ..Case::PLAIN
    };
    let (counts, _) = summary(&errors(case, 20));
    assert!(counts.iter().sum::<usize>() < 30, "{counts:?}");
}

/// The warnings of a fit.
fn warnings(case: Case, seed: u64) -> Vec<Doubt> {
    let (problem, fit) = fitted(case, seed);
    Plausibility::at(&problem, &fit.best.evaluation).warnings
}

fn is_disturbed(case: Case, seed: u64) -> bool {
    let warnings = warnings(case, seed);
    let mut each = warnings.iter();
    each.any(|w| matches!(w, Doubt::DisturbedInput { .. }))
}

/// Without a stated sigma of the force: its errors are found in nine of ten records at least, and in one record with white or autoregressive
/// noise of the channel at most, of 80 in the long test.
#[test]
fn errors_of_the_force_are_found() {
    let case = Case {
        estimates_sigma: true,
        ..Case::PLAIN
    };
    let seeds = seeds(12, 40);
    for share in [0.01, 0.05, 0.1] {
        let found = (0..seeds)
            .filter(|seed| is_disturbed(Case { share, ..case }, *seed))
            .count();
        assert!(10 * found >= 9 * seeds as usize, "{share}: {found}");
    }
    let false_alarms: usize = [0.0, 0.8]
        .into_iter()
        .map(|correlation| {
            let each = 0..seeds;
            each.filter(|seed| {
                is_disturbed(
                    Case {
                        correlation,
                        ..case
                    },
                    *seed,
                )
            })
            .count()
        })
        .sum();
    assert!(false_alarms <= 1, "{false_alarms}");
}

/// A stated sigma of half or twice the true one is contradicted, with the likely one; the true one is not.
#[test]
fn a_wrong_sigma_of_the_force_is_contradicted() {
    let case = Case {
        share: 0.05,
        stated: Some(InputNoiseKind::Sensor),
        ..Case::PLAIN
    };
    let size = 0.05 * rms(&force());
    for seed in 0..10 {
        assert_eq!(warnings(case, seed), [], "{seed}");
        for factor in [0.5, 2.0] {
            let warnings = warnings(Case { factor, ..case }, seed);
            let contradiction = warnings.iter().find_map(|w| match w {
                Doubt::ContradictedInputSigma { given, likely, .. } => Some((*given, *likely)),
                _ => None,
            });
            let (given, likely) =
                contradiction.unwrap_or_else(|| panic!("{factor} {seed}: {warnings:?}"));
            assert!((given / (factor * size) - 1.0).abs() < 1e-12);
            // From 1000 samples: the standard error of a logarithm is about 0.05.
            assert!(
                (likely / size).ln().abs() < 0.25,
                "{factor} {seed}: {likely} {size}"
            );
        }
    }
}

/// Sigma of the channel beside that of the force: within a fifth of the truth (1 %), where the force explains most of the residuals.
#[test]
fn the_sigma_of_the_channel_is_estimated_beside_that_of_the_force() {
    let case = Case {
        share: 0.05,
        stated: Some(InputNoiseKind::Sensor),
        estimates_sigma: true,
        ..Case::PLAIN
    };
    let known = force();
    for seed in 0..10 {
        let (problem, _) = fitted(case, seed);
        let found = problem.experiments[0].channels[0]
            .weighting()
            .sigma(0)
            .unwrap();
        let truth = 0.01 * rms(&response(truth(case.ratio), &known));
        assert!((found / truth - 1.0).abs() < 0.2, "{seed}: {found} {truth}");
    }
    let (counts, _) = summary(&errors(case, 20));
    assert!(counts.iter().all(|c| *c >= 15), "{counts:?}");
}

/// Noise of the sensor of the base, 5 %, for sensors of the displacement relative to the base and of the absolute acceleration: the
/// errors are estimated, and the intervals of c and k at a known mass hold. The residuals stay those of the measured input.
#[test]
fn intervals_hold_with_errors_of_the_base() {
    let system = truth(0.03);
    let [m, c, k] = system;
    let base: Vec<f64> = force().iter().map(|f| -f / m).collect();
    let clean = states(system, &force());
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    for kind in [ChannelKind::Displacement, ChannelKind::Acceleration] {
        let exact: Vec<f64> = (clean.iter())
            .map(|[y, v]| match kind {
                ChannelKind::Displacement => *y,
                _ => -(c * v + k * y) / m,
            })
            .collect();
        let (sigma, size) = (0.01 * rms(&exact), 0.05 * rms(&base));
        let mut counts = [0, 0];
        for seed in 0..20 {
            let with = |values: &[f64], sigma: f64, stream: u64| -> Vec<f64> {
                let pairs = values.iter().zip(white(seed, stream));
                pairs.map(|(y, e)| y + sigma * e).collect()
            };
            let record = |error: bool| {
                let mut channel = ChannelSpec::new(kind, &times, &with(&exact, sigma, 4));
                channel.weighting = Some(Weighting::Sigma(sigma));
                let record = Record::new("moved")
                    .from_state(0.0, 0.0)
                    .base_acceleration(&times, &with(&base, size, 3))
                    .channel(channel);
                match error {
                    true => record.input_error(
                        InputQuantity::BaseAcceleration,
                        InputNoiseKind::Sensor,
                        size,
                    ),
                    false => record,
                }
            };
            let built = |error: bool| {
                let parts = [
                    CoefficientSpec::fixed(m),
                    CoefficientSpec::constant(1.02 * c),
                    CoefficientSpec::constant(1.02 * k),
                ];
                let builder = Builder::new(parts).record(record(error));
                builder
                    .nodes(2 * (SAMPLES - 1) + 1)
                    .method(Method::Rk4)
                    .build()
                    .unwrap()
            };
            let problem = built(true);
            let settings = FitSettings::default();
            let found = fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {});
            let (problem, fit) = found.unwrap();
            let covariance = problem.covariance(&fit.best.evaluation).unwrap();
            for (j, truth) in [c, k].into_iter().enumerate() {
                let error = (fit.best.parameters[j] - truth).abs();
                counts[j] += usize::from(error <= 1.96 * covariance[(j, j)].sqrt());
            }
            // The system is linear: the response to the estimated errors is subtracted exactly, up to the last change of the parameters.
            let plain = built(false).evaluate(&fit.best.parameters).unwrap();
            let pairs = fit.best.evaluation.predictions[0][0]
                .iter()
                .zip(&plain.predictions[0][0]);
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 0.02 * sigma, "{kind:?} {seed}: {apart} {sigma}");
        }
        assert!(counts.iter().all(|n| *n >= 15), "{kind:?}: {counts:?}");
    }
}

/// Counts of 200 seeds, as a table.
#[test]
#[ignore = "minutes: .ci/long"]
fn coverage_of_200_seeds() {
    println!(
        "| errors of the force | damping ratio | share | m | c | k | mean error of m, c, k, standard errors |"
    );
    println!("|---|---|---|---|---|---|---|");
    for case in cases() {
        let seeds = 200;
        let (counts, means) = summary(&errors(case, seeds));
        let [m, c, k] = counts.map(|n| format!("{:.1} %", 100.0 * n as f64 / seeds as f64));
        let [a, b, d] = means;
        println!(
            "| {:?} | {} | {} % | {m} | {c} | {k} | {a:.2}, {b:.2}, {d:.2} |",
            case.is,
            case.ratio,
            100.0 * case.share
        );
    }
}
