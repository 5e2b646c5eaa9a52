//! Confidence intervals of the equation error: the kernel sandwich by a dense formula, ratios where the scale is undetermined, and
//! coverage under errors of the equation that are correlated and of varying size.
//!
//! The responses are closed forms: a force `sum_j a_j sin(w_j t + p_j)` gives `sum_j a_j |H_j| sin(w_j t + p_j + arg H_j)` with
//! `H = 1/(k - m w^2 + i c w)`.

use crate::common::counts::{least_held, seeds};
use crate::common::synthetic::with_noise;
use kmcfit_core::assessment::{EquationErrorIntervals, NoIntervals};
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::functions::Ratio;
use kmcfit_core::identifiability::{Classification, Condition, CovarianceKind};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::noise::automatic_bandwidth;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, Solver, Status, equation_rows, fit};
use kmcfit_core::system::Grid;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

const TRUTH: [f64; 3] = [1.3, 0.4, 50.0];
/// 50 samples of a natural period of 1 s.
const STEP: f64 = 0.02;
const NAMES: [&str; 3] = ["mass", "damping", "stiffness"];
/// Noise of the samples, which is absent: they are not smoothed.
const NONE: f64 = 1e-9;

/// Force and displacement at the times, of eight harmonics between 0.3 and 2.5 Hz.
fn motion(times: &[f64], seed: u64) -> [Vec<f64>; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 2]> = (0..8)
        .map(|_| {
            [
                random.random_range(0.3..2.5) * TAU,
                random.random_range(0.0..TAU),
            ]
        })
        .collect();
    let [m, c, k] = TRUTH;
    let at = |t: &f64| {
        let mut sums = [0.0; 2];
        for [w, phase] in &waves {
            let (real, imaginary) = (k - m * w * w, c * w);
            let gain = 1.0 / real.hypot(imaginary);
            let lag = imaginary.atan2(real);
            sums[0] += (w * t + phase).sin();
            sums[1] += gain * (w * t + phase - lag).sin();
        }
        sums
    };
    let (force, displacement) = times.iter().map(at).map(|[f, y]| (f, y)).unzip();
    [force, displacement]
}

/// Errors of the force: an autoregression with the coefficient 0.9 and of growing size, a tenth of the force in the middle.
fn errors(count: usize, seed: u64) -> Vec<f64> {
    let shocks = with_noise(&vec![0.0; count], 0.2 * f64::sqrt(1.0 - 0.81), seed + 1000);
    let mut state = 0.0;
    let shocks = shocks.iter().enumerate();
    shocks
        .map(|(i, shock)| {
            state = 0.9 * state + shock;
            state * (0.4 + 1.2 * i as f64 / count as f64)
        })
        .collect()
}

/// Records of `counts` samples each, with constants to be found.
fn problem(counts: &[usize], seed: u64) -> Problem {
    let longest = counts.iter().max().expect("a record");
    let grid = Grid::new(0.0, STEP * (longest - 1) as f64, *longest).expect("a grid");
    let parts = TRUTH.map(|value| CoefficientSpec::constant(0.5 * value));
    let mut builder = Builder::new(parts).grid(grid);
    for (i, count) in counts.iter().enumerate() {
        let times = &grid.times()[..*count];
        let seed = 100 * seed + i as u64;
        let [force, displacement] = motion(times, seed);
        let measured: Vec<f64> = (force.iter().zip(errors(*count, seed)))
            .map(|(f, e)| f + e)
            .collect();
        let record = Record::new(format!("record {i}")).force(times, &measured);
        builder = builder.record(record.displacement(times, &displacement).sigma(NONE));
    }
    builder.build().expect("a problem")
}

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    }
}

fn fitted(problem: &Problem) -> (Fit, EquationErrorIntervals) {
    let found = fit(problem, &problem.start(), &settings(), &mut |_| {}).expect("no simulation");
    assert_eq!(found.outcome.status, Status::Converged);
    let intervals = EquationErrorIntervals::of(problem, &found).expect("intervals");
    (found, intervals)
}

fn quadratic_spectral(x: f64) -> f64 {
    let z = 1.2 * PI * x;
    match x == 0.0 {
        true => 1.0,
        false => 3.0 / (z * z) * (z.sin() / z - z.cos()),
    }
}

/// The kernel for lags on a circle of `length` samples, from its spectral window `5 b/4 (1 - (omega/omega_b)^2)`.
fn on_circle(length: usize, bandwidth: f64) -> Vec<f64> {
    let end = 1.2 * PI / bandwidth;
    let omega = |f: usize| TAU * f as f64 / length as f64;
    let window = |f: &usize| 1.25 * bandwidth * (1.0 - (omega(*f) / end).powi(2));
    let inside: Vec<usize> = (1..length / 2).take_while(|f| omega(*f) < end).collect();
    let at = |lag: usize| {
        let both_signs = |f: &usize| 2.0 * window(f) * (omega(*f) * lag as f64).cos();
        (window(&0) + inside.iter().map(both_signs).sum::<f64>()) / length as f64
    };
    (0..length).map(at).collect()
}

/// `N/(N - q) H^-1 S H^-1` by sums over all pairs of samples of each of two records.
#[test]
fn the_covariance_is_the_dense_sandwich() {
    let problem = problem(&[301, 221], 1);
    let (found, intervals) = fitted(&problem);
    assert_eq!(intervals.bands.quantities.kind, CovarianceKind::Kernel);
    let equation = equation_rows(&problem, &found.best.parameters).expect("rows");
    let rows = equation.rows.columns(0, 3).into_owned();
    let scores = DMatrix::from_fn(rows.nrows(), 3, |i, j| rows[(i, j)] * equation.residuals[i]);
    let bandwidth = automatic_bandwidth(&scores, &equation.records);
    let mut sum = DMatrix::zeros(3, 3);
    for record in &equation.records {
        let length = (2 * record.len()).max(record.len() + (32.0 * bandwidth) as usize);
        let kernel = on_circle(length.next_power_of_two(), bandwidth);
        for i in record.clone() {
            for j in record.clone() {
                let kappa = kernel[i.abs_diff(j)];
                let on_line = quadratic_spectral(i.abs_diff(j) as f64 / bandwidth);
                assert!((kappa - on_line).abs() < 2.1e-4, "{i} {j}");
                sum += kappa * scores.row(i).transpose() * scores.row(j);
            }
        }
    }
    let samples = rows.nrows() as f64;
    let inverse = rows.tr_mul(&rows).try_inverse().expect("regular");
    let mut expected = samples / (samples - 3.0) * &inverse * sum * &inverse;
    // The coloured noise of the force makes short bump functions the efficient ones, whose change is a further root.
    let change = equation.change.expect("halved bump functions");
    let shift = &inverse * rows.tr_mul(&change);
    expected += &shift * shift.transpose();
    let covariance = intervals.bands.covariance.as_ref().expect("a covariance");
    for a in 0..3 {
        for b in 0..3 {
            let size = f64::sqrt(expected[(a, a)] * expected[(b, b)]);
            let off = (covariance[(a, b)] - expected[(a, b)]).abs();
            assert!(off <= 1e-10 * size, "{a} {b}: {off} {size}");
        }
    }
    // Initial states and sensors keep their start values.
    for j in 3..problem.parameters() {
        assert!(covariance[(j, j)] <= 1e-20 * covariance[(2, 2)], "{j}");
    }
}

#[test]
fn every_function_is_conditional_on_negligible_noise() {
    let (_, intervals) = fitted(&problem(&[1001], 2));
    assert_eq!(intervals.classifications.len(), 5);
    for each in &intervals.classifications {
        let Classification::Conditional { relative, on } = each.verdict else {
            panic!("{each:?}");
        };
        assert_eq!(on, Condition::NegligibleNoise);
        assert!(relative > 0.0 && relative < 0.25, "{each:?}");
    }
}

/// Without a force the mass keeps its start value, and only the ratios have intervals: those of a fit with the mass fixed.
#[test]
fn ratios_have_intervals_where_the_scale_is_undetermined() {
    let times: Vec<f64> = (0..1001).map(|i| STEP * f64::from(i)).collect();
    let decay = |t: &f64| (-0.2 * t).exp() * (6.0 * t).cos();
    let samples = with_noise(&times.iter().map(decay).collect::<Vec<_>>(), 0.01, 3);
    let record = Record::new("decay")
        .displacement(&times, &samples)
        .sigma(0.01);
    let [mass, damping, stiffness] = [2.0, 1.0, 60.0].map(CoefficientSpec::constant);
    let free = Builder::new([mass, damping.clone(), stiffness.clone()]).record(record.clone());
    let held = Builder::new([CoefficientSpec::fixed(2.0), damping, stiffness.clone()])
        .record(record.clone());
    let [free, held] = [free, held].map(|b| b.build().expect("a problem"));
    let [(_, free), (_, held)] = [&free, &held].map(fitted);
    for (function, name) in NAMES.iter().enumerate() {
        assert!(
            free.bands.functions[function].points[0]
                .standard_error
                .is_infinite()
        );
        let verdict = &free.classifications[function].verdict;
        assert!(
            matches!(verdict, Classification::OnlyRatio(_)),
            "{name}: {verdict:?}"
        );
    }
    assert_eq!(free.bands.covariance, None);
    for ratio in [Ratio::StiffnessOverMass, Ratio::DampingOverMass] {
        let [a, b] =
            [&free, &held].map(|i| i.bands.ratio(ratio).expect("a ratio").points[0].standard_error);
        // The proximal term of 1e-9 of the cost.
        assert!(b > 0.0 && (a / b - 1.0).abs() < 1e-6, "{ratio:?}: {a} {b}");
    }
    let varying = CoefficientSpec::piecewise_linear(3, 2.0);
    let varying = Builder::new([varying, CoefficientSpec::constant(1.0), stiffness]).record(record);
    let varying = varying.build().expect("a problem");
    let found = fit(&varying, &varying.start(), &settings(), &mut |_| {}).expect("no simulation");
    let reason = EquationErrorIntervals::of(&varying, &found).err();
    assert_eq!(reason, Some(NoIntervals::ScaleOverTime));
}

/// Number of seeds of which the 95 % intervals of m, c and k hold the truth, and of which those of ordinary least squares do.
fn coverage(seeds: std::ops::Range<u64>) -> [[usize; 3]; 2] {
    let mut held = [[0; 3]; 2];
    for seed in seeds {
        let problem = problem(&[1501], seed);
        let (found, intervals) = fitted(&problem);
        let theta = &found.best.parameters;
        let equation = equation_rows(&problem, theta).expect("rows");
        let rows = equation.rows.columns(0, 3).into_owned();
        let squares: f64 = equation.residuals.iter().map(|e| e * e).sum();
        let variance = squares / (rows.nrows() - 3) as f64;
        let plain = rows.tr_mul(&rows).try_inverse().expect("regular") * variance;
        for j in 0..3 {
            let off = (theta[j] - TRUTH[j]).abs();
            let estimate = &intervals.bands.functions[j].points[0];
            let [low, high] = estimate.ends(estimate.half_width());
            held[0][j] += usize::from(low <= TRUTH[j] && TRUTH[j] <= high);
            held[1][j] += usize::from(off <= 1.96 * plain[(j, j)].sqrt());
        }
    }
    held
}

#[test]
fn intervals_hold_under_coloured_errors_of_varying_size() {
    let count = seeds(40, 200);
    let [kernel, plain] = coverage(0..count);
    println!("kernel {kernel:?}, ordinary least squares {plain:?}");
    assert!(
        kernel.iter().all(|held| *held >= least_held(count)),
        "{kernel:?}"
    );
}
