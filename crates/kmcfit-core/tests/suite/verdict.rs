//! Estimates with their intervals: a forced oscillator of 1 Hz with a damping ratio of 0.03, 50 cycles, 2 % noise; data by an independent
//! integrator.

use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::assessment::{
    Doubt, EstimateStatus, FitAssessment, estimates, verdict_assumptions, verdict_reasons,
};
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use std::f64::consts::TAU;

const SPACING: f64 = 0.05;
const SAMPLES: usize = 1000;
/// Mass (kg), damping (N s/m), stiffness (N/m).
const TRUTH: [f64; 3] = [2.0, 0.06 * TAU * 2.0, TAU * TAU * 2.0];

/// The problem of constants m, c, k for a forced record.
fn problem() -> Problem {
    with_stiffness(0.0, CoefficientSpec::constant(90.0))
}

/// Beats of a stiffness over the record.
const BEATS: f64 = 6.0;

/// The problem for a stiffness that varies by the share `beat` in [`BEATS`] cycles, with another function for it.
fn with_stiffness(beat: f64, stiffness: CoefficientSpec) -> Problem {
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    let force = broadband(white(0, 1, SAMPLES));
    let [m, c, k] = TRUTH;
    let duration = SPACING * (SAMPLES - 1) as f64;
    let states = response(SPACING, [0.0, 0.0], &force, |t, y, v, f| {
        let varied = 1.0 + beat * (TAU * BEATS * t / duration).sin();
        (f - c * v - k * varied * y) / m
    });
    let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
    let sigma = 0.02 * rms(&exact);
    let samples = exact.iter().zip(white(0, 2, SAMPLES));
    let samples: Vec<f64> = samples.map(|(y, e)| y + sigma * e).collect();
    let system = [
        CoefficientSpec::constant(1.5),
        CoefficientSpec::constant(0.5),
        stiffness,
    ];
    let record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .displacement(&times, &samples)
        .sigma(sigma);
    Builder::new(system)
        .record(record)
        .nodes(4 * (SAMPLES - 1) + 1)
        .build()
        .unwrap()
}

fn assessed(problem: &Problem) -> (Problem, Fit, FitAssessment) {
    let settings = FitSettings::default();
    let (problem, fit) = fit_with_noise(problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let assessment = FitAssessment::of(&problem, &fit, true);
    (problem, fit, assessment)
}

/// Reasons about functions that vary too fast, or with a beat.
fn reasons_of_variation(beat: f64, knots: usize) -> Vec<Doubt> {
    let spec = CoefficientSpec::piecewise_linear(knots, 90.0);
    let (problem, fit, assessment) = assessed(&with_stiffness(beat, spec));
    let mut reasons = verdict_reasons(&problem, &fit, Some(&assessment));
    reasons.retain(|reason| {
        matches!(
            reason,
            Doubt::FastVariation { .. } | Doubt::Oscillates { .. }
        )
    });
    reasons
}

/// Of 50 periods: more than one parameter in two periods can absorb what varies within a period.
#[test]
fn functions_with_more_than_one_parameter_in_two_periods_are_fast() {
    let found = reasons_of_variation(0.0, 32);
    let [Doubt::FastVariation { functions, .. }] = &found[..] else {
        panic!("{found:?}");
    };
    assert_eq!(functions, &["stiffness"]);
    assert_eq!(reasons_of_variation(0.0, 20), []);
}

/// The sine of a stiffness has the frequency of its cycles over the record.
#[test]
fn a_function_that_is_a_sine_oscillates() {
    let reasons = reasons_of_variation(0.2, 25);
    let [
        Doubt::Oscillates {
            function,
            frequency,
        },
    ] = &reasons[..]
    else {
        panic!("{reasons:?}");
    };
    assert_eq!(function, "stiffness");
    let expected = BEATS / (SPACING * (SAMPLES - 1) as f64);
    assert!((frequency / expected - 1.0).abs() < 1e-9, "{frequency}");
}

/// Intervals of the ratios by the delta method, written out, from the covariance of the parameters.
#[test]
fn intervals_of_ratios_follow_from_the_covariance() {
    let (problem, fit, assessment) = assessed(&problem());
    let found = estimates(&problem, &fit, assessment.quantities());
    let get = |name: &str| {
        &found
            .iter()
            .find(|(known, _)| known == name)
            .expect("an estimate")
            .1
    };
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    let expected = [
        "natural_frequency",
        "damping_ratio",
        "mass",
        "damping",
        "stiffness",
        "k_over_m",
        "c_over_m",
    ];
    assert_eq!(names, expected);
    assert!(
        found
            .iter()
            .all(|(_, e)| e.status == EstimateStatus::Estimated)
    );
    let [m, c, k] = [0, 1, 2].map(|j| fit.best.parameters[j]);
    let bands = assessment.bands.as_ref().expect("bands");
    let covariance = bands.covariance.as_ref().expect("identified constants");
    let error = |gradient: [f64; 3]| {
        let terms = (0..9).map(|i| gradient[i / 3] * covariance[(i / 3, i % 3)] * gradient[i % 3]);
        terms.sum::<f64>().sqrt()
    };
    let frequency = (k / m).sqrt() / TAU;
    let zeta = 0.5 * c / (k * m).sqrt();
    let cases = [
        (
            "natural_frequency",
            frequency,
            [-0.5 * frequency / m, 0.0, 0.5 * frequency / k],
        ),
        (
            "damping_ratio",
            zeta,
            [-0.5 * zeta / m, zeta / c, -0.5 * zeta / k],
        ),
        ("k_over_m", k / m, [-k / (m * m), 0.0, 1.0 / m]),
        ("c_over_m", c / m, [-c / (m * m), 1.0 / m, 0.0]),
        ("stiffness", k, [0.0, 0.0, 1.0]),
    ];
    for (name, value, gradient) in cases {
        let estimate = get(name);
        let [low, high] = estimate.ci95.expect("an interval");
        assert!((estimate.value / value - 1.0).abs() < 1e-12, "{name}");
        let half = 1.959_963_985 * error(gradient);
        assert!(
            (0.5 * (high - low) / half - 1.0).abs() < 1e-8,
            "{name}: {half} {low} {high}"
        );
        assert!((0.5 * (low + high) - value).abs() < 1e-9 * value, "{name}");
    }
}

/// Without a force the coefficients scale with the fixed mass, unless its value is stated with a standard deviation.
#[test]
fn free_records_determine_ratios_to_an_assumed_mass() {
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    let [m, c, k] = TRUTH;
    let still = vec![0.0; SAMPLES];
    let states = response(SPACING, [0.1, 0.0], &still, |_, y, v, f| {
        (f - c * v - k * y) / m
    });
    let noise = white(0, 2, SAMPLES);
    let samples = states.iter().zip(noise).map(|([y, ..], e)| y + 1e-4 * e);
    let samples: Vec<f64> = samples.collect();
    let with = |mass: CoefficientSpec| {
        let system = [
            mass,
            CoefficientSpec::constant(0.5),
            CoefficientSpec::constant(90.0),
        ];
        let record = Record::new("free")
            .from_state(0.1, 0.0)
            .displacement(&times, &samples)
            .sigma(1e-4);
        let problem = Builder::new(system)
            .record(record)
            .nodes(4 * (SAMPLES - 1) + 1)
            .build();
        let (problem, fit, assessment) = assessed(&problem.unwrap());
        let all = estimates(&problem, &fit, assessment.quantities());
        let reasons = verdict_reasons(&problem, &fit, Some(&assessment));
        (all, reasons, verdict_assumptions(&problem))
    };
    let (assumed, reasons, assumptions) = with(CoefficientSpec::fixed(2.0));
    let names: Vec<&str> = assumed
        .iter()
        .take(4)
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(
        names,
        ["natural_frequency", "damping_ratio", "k_over_m", "c_over_m"]
    );
    let status = |all: &[(String, _)], name: &str| {
        let of = |(known, _): &&(String, kmcfit_core::assessment::Estimate)| known == name;
        all.iter().find(of).expect("an estimate").1.status
    };
    assert_eq!(status(&assumed, "mass"), EstimateStatus::Fixed);
    assert_eq!(status(&assumed, "stiffness"), EstimateStatus::OnlyAsRatio);
    // A stated value is an assumption of the verdict, no reason.
    assert_eq!(reasons, []);
    let functions = vec!["mass".to_owned()];
    assert!(assumptions.contains(&Doubt::Scale { functions }));
    let (weighed, reasons, assumptions) = with(CoefficientSpec::uncertain(2.0, 0.01));
    assert_eq!(status(&weighed, "stiffness"), EstimateStatus::Estimated);
    assert_eq!(reasons, []);
    let is_scale = |a: &Doubt| matches!(a, Doubt::Scale { .. });
    assert!(!assumptions.iter().any(is_scale));
}
