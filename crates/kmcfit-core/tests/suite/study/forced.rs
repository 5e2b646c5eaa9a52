//! Predictions under a new force: coverage of their bands.

use crate::common::forced::{broadband, response, white};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::functions::{CoefficientFunction, CoefficientSet};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Input, Waveform, Weighting};
use kmcfit_core::signal::{Interpolation, Signal};
use kmcfit_core::solvers::{FitSettings, Initial, fit_with_noise};
use kmcfit_core::study::IdentifiedSystem;
use kmcfit_core::system::{Grid, State};
use std::f64::consts::TAU;

const MASS: f64 = 2.0;
const STIFFNESS: f64 = TAU * TAU * MASS;
const DAMPING: f64 = 2.0 * 0.03 * TAU * MASS;
const SPACING: f64 = 0.025;
/// About 2 % of the response.
const SIGMA: f64 = 0.01;

/// Force and noisy displacement of an oscillator of 1 Hz; stiffness falls by 10 % over the record with `varies`.
fn record(seed: u64, stream: u64, samples: usize, varies: bool) -> [Vec<f64>; 3] {
    let force = broadband(white(seed, stream, samples));
    let duration = SPACING * samples as f64;
    let states = response(SPACING, [0.0; 2], &force, |t, y, v, f| {
        let k = STIFFNESS * (1.0 - if varies { 0.1 * t / duration } else { 0.0 });
        (f - DAMPING * v - k * y) / MASS
    });
    let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
    let noise = white(seed, stream + 1, samples);
    let noisy = exact
        .iter()
        .zip(noise)
        .map(|(y, e)| y + SIGMA * e)
        .collect();
    let times = (0..samples).map(|i| SPACING * i as f64).collect();
    [times, force, noisy]
}

fn identified(problem: &Problem, theta: &[f64]) -> IdentifiedSystem {
    let evaluation = problem.evaluate(theta).unwrap();
    let functions: Vec<CoefficientFunction> = problem.functions.iter().cloned().collect();
    let n = functions.len();
    let count = problem.functions.parameters();
    let first = problem.functions.scalar_range().start;
    let covariance = problem.covariance(&evaluation).unwrap();
    assert_eq!(first + problem.functions.scalar_range().len(), count);
    IdentifiedSystem {
        system: problem.system.clone(),
        functions,
        set: CoefficientSet::from((0..n).collect::<Vec<usize>>()),
        theta: theta[..first].to_vec(),
        covariance: Some(covariance.view((0, 0), (first, first)).into_owned()),
    }
}

/// Samples within their band, and all samples, of a prediction of the seed.
fn within(seed: u64, varies: bool) -> [usize; 2] {
    let samples = 1000;
    let [times, force, noisy] = record(seed, 1, samples, varies);
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &noisy);
    channel.weighting = Some(Weighting::Estimated { sigma: 2.0 * SIGMA });
    let record_one = Record::new("fitted")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .channel(channel);
    let stiffness = match varies {
        true => CoefficientSpec::piecewise_linear(3, STIFFNESS),
        false => CoefficientSpec::constant(STIFFNESS),
    };
    let parts = [
        CoefficientSpec::constant(MASS),
        CoefficientSpec::constant(DAMPING),
        stiffness,
    ];
    let problem = Builder::new(parts).record(record_one).build().unwrap();
    let settings = FitSettings {
        initial: Initial::Data,
        ..FitSettings::default()
    };
    let (problem, fit) =
        fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let system = identified(&problem, &fit.best.parameters);
    assert_eq!(system.is_constant(), !varies);
    // A new force on another grid.
    let [times, force, noisy] = record(seed, 11, samples, varies);
    let end = times[times.len() - 1];
    let grid = Grid::new(0.0, end, 4 * (samples - 1) + 1).unwrap();
    let mut experiment = Experiment::free("new", State::one(0.0, 0.0), grid.nodes());
    let signal = Signal::new(times.clone(), force, Interpolation::Linear).unwrap();
    experiment.input = Input {
        force: Some(Waveform::Samples(signal)),
        ..Input::default()
    };
    experiment.excitation = Some(experiment.input.on(&grid, grid.nodes()));
    let channel = Channel::new(
        ChannelKind::Displacement,
        times,
        noisy,
        Weighting::Sigma(1.0),
        &grid,
        grid.nodes(),
    );
    let experiment = experiment.with_channel(channel.unwrap());
    let problem_new = system.problem(grid, experiment).unwrap();
    let sigma = problem.channels().next().unwrap().weighting().sigma(0);
    let found = system.predict(&problem_new, &[sigma]).unwrap();
    let share = found[0].share_within().unwrap();
    [(share * samples as f64).round() as usize, samples]
}

/// Pooled share of the samples of all seeds, for constants and for a stiffness that varies.
fn coverage(seeds: u64) -> f64 {
    let mut sums = [0; 2];
    for seed in 0..seeds {
        let found = within(seed, seed % 2 == 1);
        sums = [sums[0] + found[0], sums[1] + found[1]];
    }
    let share = sums[0] as f64 / sums[1] as f64;
    println!("| {seeds} | {} | {:.2} % |", sums[1], 100.0 * share);
    share
}

/// 93 to 97 % of all samples pooled over the seeds: of 12,000 independent samples at 95 % one standard deviation is 0.2 %, but the errors of the
/// parameters are common to a record.
#[test]
fn samples_under_a_new_force_are_within_their_band() {
    let share = coverage(12);
    assert!((0.93..=0.97).contains(&share), "{share}");
}

#[test]
#[ignore = "a minute; .ci/long predictions"]
fn samples_of_many_records_are_within_their_band() {
    println!("| records | samples | within their 95 % band |\n|---|---|---|");
    let share = coverage(100);
    assert!((0.93..=0.97).contains(&share), "{share}");
}
