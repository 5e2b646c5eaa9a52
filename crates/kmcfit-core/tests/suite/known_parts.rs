//! Known parts of coefficients, and known values with a standard deviation.

use crate::common::closed_form::constant_coefficients;
use crate::common::counts::{seeds, widened};
use crate::common::forced::{broadband, response, white};
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::constraints::TimeHistory;
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::State;
use nalgebra::DMatrix;

const SPACING: f64 = 0.02;
/// Noise of the forced records, m.
const SIGMA: f64 = 1e-3;

fn times(samples: usize) -> Vec<f64> {
    (0..samples).map(|i| SPACING * i as f64).collect()
}

fn fitted(problem: &Problem) -> (Problem, Fit) {
    let settings = FitSettings::default();
    fit_with_noise(problem, &problem.start(), &settings, &mut |_| {}).unwrap()
}

fn covariance(problem: &Problem, fit: &Fit) -> DMatrix<f64> {
    let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
    let found = problem.covariance_of_estimates(theta, evaluation);
    found.expect("identified parameters")
}

/// Derivatives of all weighted predictions by central differences.
fn jacobian(problem: &Problem, theta: &[f64], sigma: f64) -> DMatrix<f64> {
    let predictions = |theta: &[f64]| -> Vec<f64> {
        let evaluation = problem.evaluate(theta).unwrap();
        let all = evaluation.predictions.iter().flatten().flatten();
        all.copied().collect()
    };
    let column = |j: usize| -> Vec<f64> {
        let step = 1e-5 * theta[j].abs().max(1e-3);
        let at = |by: f64| {
            let mut moved = theta.to_vec();
            moved[j] += by;
            predictions(&moved)
        };
        let pairs = at(step).into_iter().zip(at(-step));
        pairs.map(|(a, b)| (a - b) / (2.0 * step * sigma)).collect()
    };
    let columns: Vec<Vec<f64>> = (0..theta.len()).map(column).collect();
    DMatrix::from_fn(columns[0].len(), theta.len(), |i, j| columns[j][i])
}

/// Two forced records with a shared mass on four knots, of which the second carries a weighed block and the first a known part over
/// time.
fn carriage(samples: usize) -> Builder {
    let times = times(samples);
    let force = broadband(white(3, 1, samples));
    let record = |name: &str, added: f64| {
        let states = response(SPACING, [0.0, 0.0], &force, |_, y, v, f| {
            (f - 1.5 * v - 700.0 * y) / (2.0 + added)
        });
        let noise = white(3, 2, samples);
        let samples = states.iter().zip(noise).map(|([y, ..], e)| y + SIGMA * e);
        Record::new(name)
            .from_state(0.0, 0.0)
            .force(&times, &force)
            .displacement(&times, &samples.collect::<Vec<f64>>())
            .sigma(SIGMA)
    };
    let slowly = times.iter().map(|t| 0.3 + 0.01 * t).collect();
    let known = CoefficientSpec::known(TimeHistory::Nodal {
        name: "known".into(),
        values: slowly,
    });
    let block = CoefficientSpec::uncertain(1.4, 0.05);
    let part = |spec: CoefficientSpec| CoefficientSpec::default().known_part(spec);
    Builder::new([
        CoefficientSpec::piecewise_linear(4, 2.0),
        CoefficientSpec::uncertain(1.5, 0.2),
        CoefficientSpec::constant(700.0).known_part(CoefficientSpec::fixed(50.0)),
    ])
    .record(record("bare", 0.3).coefficient(CoefficientKind::MASS, part(known)))
    .record(record("block", 1.4).coefficient(CoefficientKind::MASS, part(block)))
}

/// A parameter vector away from the start, priors and their known values.
fn moved(problem: &Problem) -> Vec<f64> {
    let start = problem.start().into_iter().enumerate();
    let factor = |j: usize| 1.0 + 0.05 * (j as f64 + 1.0).sin();
    start.map(|(j, p)| p * factor(j)).collect()
}

/// The response is that of the sums: the same cost as with the sums as start values of plain functions.
#[test]
fn coefficients_are_sums() {
    let problem = carriage(300).build().unwrap();
    let names: Vec<String> = problem.functions.iter().map(|f| f.name()).collect();
    let expected = [
        "mass",
        "damping",
        "stiffness",
        "known part of stiffness",
        "known part of mass of bare",
        "known part of mass of block",
    ];
    assert_eq!(names, expected);
    let theta = problem.start();
    let evaluation = problem.evaluate(&theta).unwrap();
    for (record, mass) in [("bare", 2.3), ("block", 3.4)] {
        let of = (problem.experiments.iter()).find(|e| e.name == record);
        let mut nodal = problem.functions.empty_nodal();
        let set = of.expect("a record").coefficient_set;
        problem.functions.nodal_into(&theta, set, &mut nodal);
        assert!((nodal.inertias[0][0] - mass).abs() < 1e-15, "{record}");
        assert!((nodal.coefficients[1][0] - 750.0).abs() < 1e-12);
    }
    // Known values cost nothing at themselves, and one at a distance of one standard deviation.
    assert_eq!(evaluation.regularisation, 0.0);
    let mut at = theta.clone();
    *at.last_mut().unwrap() += 0.05;
    assert!((problem.regularisation(&at) - 1.0).abs() < 1e-12);
    // The shared coefficients include the known part.
    let stiffness = problem.coefficient(CoefficientKind::STIFFNESS, &theta);
    assert!((stiffness.unwrap()[7] - 750.0).abs() < 1e-12);
}

/// The gradient against central differences of J.
#[test]
fn the_gradient_is_that_of_the_cost() {
    let problem = carriage(300).build().unwrap();
    let theta = moved(&problem);
    let evaluation = problem.evaluate(&theta).unwrap();
    let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete);
    for (j, found) in gradient.euclidean.iter().enumerate() {
        let step = 1e-5 * theta[j];
        let at = |by: f64| {
            let mut moved = theta.clone();
            moved[j] += by;
            problem.evaluate(&moved).unwrap().cost
        };
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Differences of steps of 1e-5 have errors of 1e-10 and of rounding, 1e-11 of J over the step.
        let size = found.abs() + evaluation.cost / theta[j].abs();
        assert!(
            (found - difference).abs() < 1e-5 * size,
            "{j}: {found} {difference}"
        );
    }
}

/// The covariance against Cramer and Rao with derivatives by differences: known values are measurements with their standard deviation.
#[test]
fn known_values_enter_the_covariance_as_measurements() {
    // At a point of the search, with white noise.
    let problem = carriage(300).build().unwrap();
    let theta = &moved(&problem);
    let samples = jacobian(&problem, theta, SIGMA);
    let mut information = samples.tr_mul(&samples);
    let priors: Vec<(usize, f64)> = problem
        .functions
        .priors()
        .map(|(j, p)| (j, p.sigma))
        .collect();
    assert_eq!(priors, [(4, 0.2), (6, 0.05)]);
    for (j, sigma) in priors {
        information[(j, j)] += sigma.powi(-2);
    }
    let expected = information.try_inverse().expect("identified parameters");
    let evaluation = problem.evaluate(theta).unwrap();
    let found = problem.covariance_of_estimates(theta, &evaluation);
    let found = found.expect("identified parameters");
    for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
        let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
        let off = (found[(i, j)] - expected[(i, j)]).abs();
        assert!(off < 1e-4 * size, "{i} {j}: {found} {expected}");
    }
}

/// A free record of a system with a weighed mass: k = (k/m) m, so that the relative standard errors of k/m and m add in squares.
#[test]
fn the_uncertainty_of_a_weighed_mass_is_that_of_the_stiffness() {
    let times = times(500);
    let state = State::one(0.01, 0.0);
    let noise = white(1, 1, 500);
    let exact = times
        .iter()
        .map(|t| constant_coefficients((4.5, 2.0, 900.0), state.clone(), *t).0);
    let samples: Vec<f64> = exact.zip(&noise).map(|(y, e)| y + 1e-4 * e).collect();
    let error = |mass: CoefficientSpec| {
        let system = [
            mass,
            CoefficientSpec::constant(2.0),
            CoefficientSpec::constant(900.0),
        ];
        let record = Record::new("free")
            .from_state(0.01, 0.0)
            .displacement(&times, &samples)
            .sigma(1e-4);
        let (problem, fit) = fitted(&Builder::new(system).record(record).build().unwrap());
        let covariance = covariance(&problem, &fit);
        let k = problem.functions.ranges()[2].start;
        covariance[(k, k)].sqrt() / fit.best.parameters[k]
    };
    let exact = error(CoefficientSpec::fixed(4.5));
    let weighed = error(CoefficientSpec::uncertain(4.5, 0.09));
    let expected = (exact * exact + 0.02 * 0.02f64).sqrt();
    // The prior of 2 % adds terms of second order, 4e-4.
    assert!(
        (weighed / expected - 1.0).abs() < 1e-3,
        "{weighed} {expected}"
    );
    assert!(exact < 1e-3, "{exact}");
}

/// Free records of one carriage without and with weighed blocks; the blocks of a seed differ from their weighed masses by their standard
/// deviations.
fn weighed(seed: u64) -> Problem {
    const CARRIAGE: [f64; 3] = [3.2, 2.0, 800.0];
    const BLOCKS: [[f64; 2]; 2] = [[1.4665, 0.01], [2.931, 0.014]];
    let samples = 300;
    let times = times(samples);
    let state = State::one(0.01, 0.0);
    let sigma = 2e-4;
    let record = |i: usize, name: &str, added: f64| {
        let [m, c, k] = CARRIAGE;
        let exact =
            (times.iter()).map(|t| constant_coefficients((m + added, c, k), state.clone(), *t).0);
        let noise = white(seed, i as u64, samples);
        let samples: Vec<f64> = exact.zip(noise).map(|(y, e)| y + sigma * e).collect();
        Record::new(name)
            .from_state(0.01, 0.0)
            .displacement(&times, &samples)
            .sigma(sigma)
    };
    let errors = white(seed, 9, BLOCKS.len());
    let mut builder = Builder::new([
        CoefficientSpec::constant(2.0).min(0.0),
        CoefficientSpec::constant(1.0),
        CoefficientSpec::constant(1000.0),
    ])
    .record(record(0, "bare", 0.0));
    for (i, ([block, sigma], error)) in BLOCKS.into_iter().zip(errors).enumerate() {
        let part = CoefficientSpec::uncertain(block + sigma * error, sigma);
        let own = CoefficientSpec::default().known_part(part);
        let record = record(i + 1, &format!("block {}", i + 1), block);
        builder = builder.record(record.coefficient(CoefficientKind::MASS, own));
    }
    builder.build().unwrap()
}

/// Number of seeds whose 95 % interval holds the mass of the carriage, 3.2 kg.
fn held(seeds: u64) -> usize {
    let is_held = |seed: &u64| {
        let (problem, fit) = fitted(&weighed(*seed));
        let covariance = covariance(&problem, &fit);
        let error = fit.best.parameters[0] - 3.2;
        error.abs() <= 1.959_964 * covariance[(0, 0)].sqrt()
    };
    (0..seeds).filter(is_held).count()
}

/// Intervals of 95 %: three standard errors of the share are 2 % for 1000.
#[test]
fn the_mass_of_a_carriage_is_within_its_interval() {
    let seeds = seeds(200, 1000);
    let share = held(seeds) as f64 / seeds as f64;
    println!("{share} of {seeds}");
    assert!(
        (share - 0.95).abs() <= widened(0.02, 1000, seeds),
        "{share}"
    );
}
