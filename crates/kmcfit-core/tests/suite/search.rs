//! Searches from distant starts: forced oscillators whose mass, damping and stiffness all vary on 5 to 7 knots by up to 40 %,
//! without bounds, from constant starts of 0.5 to 3 times their level. Data by an independent integrator; seeds are 0, 1, 2, ...
//!
//! `.ci/long search` counts 200 further seeds of each kind of record.

use crate::common::counts::seeds;
use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::{BasisName, CoefficientSpec, KnotSpec, StartSpec};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::ops::Range;

const SPACING: f64 = 0.05;
const SAMPLES: usize = 1000;
/// Mean values of mass (kg), damping (N s/m) and stiffness (N/m): 1 Hz, a damping ratio of 0.03.
const LEVELS: [f64; 3] = [2.0, 0.06 * TAU * 2.0, TAU * TAU * 2.0];
/// Channel, and noise over the root mean square of its samples.
type Kind = (ChannelKind, f64);
const KINDS: [Kind; 4] = [
    (ChannelKind::Displacement, 0.02),
    (ChannelKind::Displacement, 0.1),
    (ChannelKind::Acceleration, 0.02),
    (ChannelKind::Acceleration, 0.1),
];
/// Largest cost over that of the fit started at the truth.
const SAME: f64 = 1.001;

/// A system and its record.
struct Case {
    /// Values at equally spaced knots of each function.
    knots: [Vec<f64>; 3],
    /// Start over level of each function.
    factors: [f64; 3],
    times: Vec<f64>,
    force: Vec<f64>,
    channel: ChannelKind,
    samples: Vec<f64>,
    sigma: f64,
}

fn linear(knots: &[f64], share: f64) -> f64 {
    let x = share * (knots.len() - 1) as f64;
    let cell = (x as usize).min(knots.len() - 2);
    knots[cell] + (x - cell as f64) * (knots[cell + 1] - knots[cell])
}

/// System and record of a seed: a broadband force for even seeds, a sweep from 0.4 to 2 Hz for odd ones.
fn case(seed: u64, (channel, noise): Kind) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let knots = LEVELS.map(|level| {
        let count = random.random_range(5..=7);
        let mut value = || level * random.random_range(0.8..1.2);
        (0..count).map(|_| value()).collect::<Vec<f64>>()
    });
    let factors = [(); 3].map(|()| 0.5 * 6f64.powf(random.random_range(0.0..1.0)));
    let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
    let end = SPACING * (SAMPLES - 1) as f64;
    let force = match seed % 2 {
        0 => broadband(white(seed, 1, SAMPLES)),
        _ => (times.iter())
            .map(|t| 10.0 * (TAU * (0.4 + 0.8 * t / end) * t).sin())
            .collect(),
    };
    let states = response(SPACING, [0.0, 0.0], &force, |t, y, v, f| {
        let [m, c, k] = [0, 1, 2].map(|i| linear(&knots[i], t / end));
        (f - c * v - k * y) / m
    });
    let measured = |[y, _, a]: &[f64; 3]| match channel {
        ChannelKind::Acceleration => *a,
        _ => *y,
    };
    let exact: Vec<f64> = states.iter().map(measured).collect();
    let sigma = noise * rms(&exact);
    let pairs = exact.iter().zip(white(seed, 2, SAMPLES));
    Case {
        samples: pairs.map(|(y, e)| y + sigma * e).collect(),
        knots,
        factors,
        times,
        force,
        channel,
        sigma,
    }
}

/// The problem of a case, started at `start` of each function.
fn problem(case: &Case, start: impl Fn(usize) -> StartSpec) -> Problem {
    let spec = |f: usize| {
        CoefficientSpec::estimated(BasisName::PiecewiseLinear, start(f))
            .knots(KnotSpec::Count(case.knots[f].len()))
    };
    let mut channel = ChannelSpec::new(case.channel, &case.times, &case.samples);
    channel.weighting = Some(Weighting::Sigma(case.sigma));
    let record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&case.times, &case.force)
        .channel(channel);
    let system = [spec(0), spec(1), spec(2)];
    Builder::new(system).record(record).build().unwrap()
}

fn fitted(problem: &Problem) -> Fit {
    let start = problem.start();
    let settings = FitSettings::default();
    fit_with_noise(problem, &start, &settings, &mut |_| {})
        .unwrap()
        .1
}

/// Cost of the fit from the distant start over that of the fit from the truth.
fn ratio(seed: u64, kind: Kind) -> f64 {
    let case = case(seed, kind);
    let near = problem(&case, |f| StartSpec::List(case.knots[f].clone()));
    let far = problem(&case, |f| StartSpec::Number(LEVELS[f] * case.factors[f]));
    let [near, far] = [near, far].map(|problem| fitted(&problem).best.evaluation.cost);
    far / near
}

/// Seeds whose search ends higher than [`SAME`] times the fit from the truth, with the ratio.
fn missed(seeds: Range<u64>, kind: Kind) -> Vec<(u64, f64)> {
    let ratios = seeds.map(|seed| (seed, ratio(seed, kind)));
    ratios.filter(|(_, ratio)| *ratio > SAME).collect()
}

#[test]
fn distant_starts_end_where_the_truth_ends() {
    for kind in KINDS {
        let missed = missed(0..seeds(12, 40), kind);
        assert!(missed.is_empty(), "{kind:?}: {missed:?}");
    }
}

#[test]
#[ignore = "long: 1600 fits"]
fn counts_of_200_further_seeds() {
    println!("| channel | noise | searches | missed | largest ratio of the costs |");
    println!("|---|---|---|---|---|");
    for (channel, noise) in KINDS {
        let missed = missed(40..240, (channel, noise));
        let largest = missed.iter().map(|(_, ratio)| *ratio).fold(SAME, f64::max);
        let count = missed.len();
        println!(
            "| {channel:?} | {:.0} % | 200 | {count} | {largest:.3} |",
            100.0 * noise
        );
        // 10 of 800 in the last long run.
        assert!(count <= 10, "{channel:?}, {noise}: {missed:?}");
    }
}
