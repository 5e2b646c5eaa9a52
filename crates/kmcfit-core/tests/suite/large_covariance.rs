//! Covariance of fits with more than 64 parameters, by the banded factor, beside dense decompositions.

use crate::common::forced::{broadband, response, white};
use kmcfit_core::assessment::quantities_of_many;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::constraints::Constraint;
use kmcfit_core::functions::WeightRule;
use kmcfit_core::identifiability::{Bands, CovarianceKind, Quantities};
use kmcfit_core::model::{CoefficientSpec, PenaltySpec, WeightChoice};
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use kmcfit_core::structure::CoefficientKind;

const SIGMA: f64 = 2e-3;

/// A forced record, samples `spacing` (s) apart, of a system whose stiffness falls, `k = 60 - 15 t/T`.
fn record(spacing: f64, samples: usize, seed: u64) -> Record {
    let times: Vec<f64> = (0..samples).map(|i| spacing * i as f64).collect();
    let force = broadband(white(seed, 1, samples));
    let duration = spacing * (samples - 1) as f64;
    let states = response(spacing, [0.0, 0.0], &force, |t, y, v, f| {
        (f - 1.2 * v - (60.0 - 15.0 * t / duration) * y) / 2.0
    });
    let noise = white(seed, 2, samples);
    let values = states.iter().zip(noise).map(|([y, ..], e)| y + SIGMA * e);
    Record::new("shaker")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .displacement(&times, &values.collect::<Vec<f64>>())
        .sigma(SIGMA)
}

fn fitted(problem: &Problem) -> (Problem, Fit) {
    let settings = FitSettings::default();
    fit_with_noise(problem, &problem.start(), &settings, &mut |_| {}).unwrap()
}

/// Standard errors of all means by the banded factor, and by dense decompositions along all parameters.
fn both(problem: &Problem) -> (Quantities, Vec<[f64; 2]>) {
    let (problem, fit) = fitted(problem);
    let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
    let large = quantities_of_many(&problem, theta, evaluation).expect("a covariance");
    let bands = Bands::at(&problem, theta, evaluation);
    assert_eq!(bands.undetermined, 0);
    assert_eq!(bands.quantities.kind, large.kind);
    let dense = bands.quantities;
    let of_functions = large.functions.iter().zip(&dense.functions);
    let mut pairs: Vec<[f64; 2]> = of_functions
        .map(|(a, b)| [a.standard_error, b.standard_error])
        .collect();
    for (a, b) in large.ratios.iter().zip(&dense.ratios) {
        assert_eq!(a.name, b.name);
        pairs.push([a.standard_error, b.standard_error]);
    }
    (large, pairs)
}

/// A stiffness with one value per step, smoothed by its second derivative.
fn nodal(spacing: f64, samples: usize, seed: u64, weight: WeightChoice) -> Builder {
    let stiffness = CoefficientSpec::nodal(55.0).penalty(PenaltySpec::tikhonov(2, weight));
    Builder::new([
        CoefficientSpec::constant(2.0),
        CoefficientSpec::constant(1.0),
        stiffness,
    ])
    .record(record(spacing, samples, seed))
}

/// The largest relative difference of the pairs.
fn largest(pairs: &[[f64; 2]]) -> f64 {
    let each = pairs.iter().map(|[a, b]| (a - b).abs() / b);
    each.fold(0.0, f64::max)
}

/// Differences of two orthogonal factorisations of well-conditioned problems.
const TOLERANCE: f64 = 1e-6;

#[test]
fn standard_errors_are_those_of_dense_decompositions() {
    let given = WeightChoice::Number(0.02);
    let rule = WeightChoice::Rule(WeightRule::RestrictedLikelihood);
    let start = Constraint::Value {
        of: CoefficientKind::STIFFNESS,
        at: 0.0,
        value: 60.0,
    };
    let spline = CoefficientSpec::b_spline(70, 55.0).min(0.0);
    let splines = Builder::new([
        CoefficientSpec::constant(2.0),
        CoefficientSpec::constant(1.0),
        spline,
    ]);
    let cases = [
        (CovarianceKind::Penalised, nodal(0.05, 200, 1, given)),
        (
            CovarianceKind::Penalised,
            nodal(0.05, 200, 1, given).constrain(start),
        ),
        (CovarianceKind::Bayesian, nodal(0.05, 200, 2, rule)),
        (
            CovarianceKind::Information,
            splines.record(record(0.05, 800, 3)).nodes(1600),
        ),
    ];
    for (kind, builder) in cases {
        let (large, pairs) = both(&builder.build().unwrap());
        assert_eq!(large.kind, kind);
        assert!(largest(&pairs) < TOLERANCE, "{kind:?}: {pairs:?}");
    }
}

#[test]
fn intervals_of_the_mean_stiffness_hold() {
    let mut inside = 0;
    for seed in 0..40 {
        let builder = nodal(
            0.05,
            200,
            100 + seed,
            WeightChoice::Rule(WeightRule::RestrictedLikelihood),
        );
        let (problem, fit) = fitted(&builder.build().unwrap());
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        let large = quantities_of_many(&problem, theta, evaluation).unwrap();
        let [low, high] = large.functions[2].interval().unwrap();
        inside += u32::from((low..=high).contains(&52.5));
    }
    // At 95 % fewer than 33 have a probability of 1e-4.
    assert!(inside >= 33, "{inside} of 40");
}
