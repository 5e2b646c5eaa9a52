//! Jumps found by total variation with the rule `bic`: positions, levels and their intervals, for a stiffness with one jump, with
//! two and with none, from responses in closed form between the jumps.

use crate::common;

use crate::common::counts::{seeds, widened};
use crate::common::synthetic::with_noise;
use kmcfit_core::assessment::FitAssessment;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::functions::WeightRule;
use kmcfit_core::identifiability::{Classification, Condition};
use kmcfit_core::model::{
    BasisName, CoefficientSpec, KnotSpec, PenaltySpec, StartSpec, WeightChoice,
};
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, Status, WeightPath, choose_weight};
use std::ops::Range;

const MASS: f64 = 1.0;
const DAMPING: f64 = 0.06;
const SAMPLES: usize = 1001;
const STEP: f64 = 0.03;
/// Intervals between knots.
const CELLS: usize = 50;

/// Free response of a mass on a spring with `levels` between the `jumps` (s), from y = 1 and v = 0: decaying harmonics, joined with the
/// same displacement and velocity.
fn response(levels: &[f64], jumps: &[f64]) -> Vec<f64> {
    let decay = DAMPING / (2.0 * MASS);
    let advanced = |[y, v]: [f64; 2], k: f64, t: f64| {
        let w = (k / MASS - decay * decay).sqrt();
        let (sine, cosine) = (w * t).sin_cos();
        let b = (v + decay * y) / w;
        let size = (-decay * t).exp();
        let [u, du] = [y * cosine + b * sine, w * (b * cosine - y * sine)];
        [size * u, size * (du - decay * u)]
    };
    let mut state = [1.0, 0.0];
    let mut begin = 0.0;
    let mut level = 0;
    let mut values = Vec::with_capacity(SAMPLES);
    for i in 0..SAMPLES {
        let t = STEP * i as f64;
        while level < jumps.len() && jumps[level] <= t {
            state = advanced(state, levels[level], jumps[level] - begin);
            begin = jumps[level];
            level += 1;
        }
        values.push(advanced(state, levels[level], t - begin)[0]);
    }
    values
}

fn problem(levels: &[f64], jumps: &[f64], basis: BasisName, seed: u64) -> Problem {
    let times: Vec<f64> = (0..SAMPLES).map(|i| STEP * i as f64).collect();
    let clean = response(levels, jumps);
    let sigma = 0.025 * common::synthetic::rms(&clean);
    let samples = with_noise(&clean, sigma, seed);
    let stiffness = CoefficientSpec {
        knots: (basis == BasisName::PiecewiseConstant).then_some(KnotSpec::Count(CELLS + 1)),
        ..CoefficientSpec::estimated(basis, StartSpec::Number(5.0))
    };
    let weight = WeightChoice::Rule(WeightRule::Bic);
    let parts = [
        CoefficientSpec::fixed(MASS),
        CoefficientSpec::constant(0.1),
        stiffness.penalty(PenaltySpec::total_variation(weight)),
    ];
    let record = Record::new("decay").from_state(1.0, 0.0);
    let record = record.displacement(&times, &samples).sigma(sigma);
    Builder::new(parts)
        .record(record)
        .build()
        .expect("a problem")
}

fn found(problem: &Problem) -> (WeightPath, Problem, Fit) {
    let settings = FitSettings::default();
    let rule = WeightRule::Bic;
    choose_weight(
        problem,
        &problem.start(),
        &settings,
        rule,
        &[0],
        &mut |_| {},
    )
    .expect("a response")
}

/// Counts over seeds.
#[derive(Debug, Default)]
struct Counts {
    seeds: usize,
    /// Seeds with the true number of jumps.
    right_number: usize,
    /// Distance of each jump of these from the true one, s.
    distances: Vec<f64>,
    /// Intervals of levels, and those that hold the truth, of these.
    intervals: usize,
    held: usize,
}

fn count(levels: &[f64], jumps: &[f64], basis: BasisName, seeds: Range<u64>) -> Counts {
    let mut counts = Counts::default();
    for seed in seeds {
        counts.seeds += 1;
        let truth: Vec<f64> = jumps.iter().map(|t| t - 0.5 * STEP).collect();
        let whole = problem(levels, &truth, basis, seed);
        let (_, reduced, fit) = found(&whole);
        assert_eq!(fit.outcome.status, Status::Converged, "{seed}");
        let times = &reduced.jumps[0].times;
        println!("{seed}: {times:?}");
        if times.len() != jumps.len() {
            continue;
        }
        counts.right_number += 1;
        counts
            .distances
            .extend(times.iter().zip(jumps).map(|(a, b)| (a - b).abs()));
        let covariance = reduced
            .covariance(&fit.best.evaluation)
            .expect("a covariance");
        for (j, level) in reduced.functions.ranges()[2].clone().zip(levels) {
            counts.intervals += 1;
            let off = (fit.best.parameters[j] - level).abs();
            counts.held += usize::from(off <= 1.96 * covariance[(j, j)].sqrt());
        }
    }
    counts
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0f64, |m, x| m.max(*x))
}

/// Jumps at knots, 0.6 s apart. Coefficients are linear between nodes, so that a jump at the time of a node is a change over the step
/// before it, whose middle is that of the true jump.
const CASES: [(&[f64], &[f64]); 3] = [
    (&[4.0, 3.2], &[12.0]),
    (&[4.0, 3.2, 3.6], &[9.0, 19.2]),
    (&[4.0], &[]),
];

/// The right number of jumps in nine of ten records, at most a cell from the true ones, and the share of the intervals of the levels that
/// hold the truth.
#[test]
fn jumps_at_knots_are_found_and_their_levels_hold() {
    let seeds = seeds(6, 100);
    let (mut intervals, mut held) = (0, 0);
    for (case, (levels, jumps)) in (0..).zip(CASES) {
        // Other noise in each case: with the same noise the intervals of all cases hold together.
        let first = 1000 * case;
        let counts = count(
            levels,
            jumps,
            BasisName::PiecewiseConstant,
            first..first + seeds,
        );
        println!("{jumps:?}: {counts:?}");
        intervals += counts.intervals;
        held += counts.held;
        assert!(10 * counts.right_number >= 9 * counts.seeds, "{counts:?}");
        assert!(largest(&counts.distances) <= 0.61, "{counts:?}");
    }
    println!("{held} of {intervals}");
    let share = held as f64 / intervals as f64;
    let apart = widened(0.02, 100, seeds);
    assert!((share - 0.95).abs() <= apart, "{share}");
}

/// One value for each node: the time of a jump near the largest displacement is found to three samples. At zero displacement a change of
/// the stiffness changes no force, and its time is not determined.
#[test]
fn jumps_between_nodes_are_found() {
    let (levels, jumps) = (&[4.0, 3.2], &[12.57]);
    let counts = count(levels, jumps, BasisName::Nodal, 0..5);
    println!("{counts:?}");
    assert_eq!(counts.right_number, counts.seeds);
    assert!(largest(&counts.distances) <= 3.0 * STEP, "{counts:?}");
}

#[test]
fn functions_are_conditional_on_the_jumps() {
    for (levels, jumps) in CASES {
        let whole = problem(levels, jumps, BasisName::PiecewiseConstant, 3);
        let (path, reduced, fit) = found(&whole);
        let least = path
            .points
            .iter()
            .filter_map(|p| p.bic)
            .fold(f64::INFINITY, f64::min);
        assert_eq!(path.points[path.chosen].bic, Some(least));
        assert!(path.points.is_sorted_by(|a, b| a.weight > b.weight));
        let assessment = FitAssessment::of(&reduced, &fit, true);
        for each in assessment.classifications.iter().skip(1) {
            let is_conditional = matches!(
                each.verdict,
                Classification::Conditional {
                    on: Condition::Jumps,
                    ..
                }
            );
            assert!(is_conditional, "{each:?}");
        }
    }
}
