//! The equation error as a method: records whose excitation nobody knows, and records with one.

mod common;

use insta::assert_snapshot;
use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::constraints::RowGroup;
use kmcfit::dynamics::{ChannelKind, Device, Excitation, Grid, Method, Oscillator, State, Term};
use kmcfit::functions::{Basis, CoefficientFunction, Functions, Penalty, Quantity};
use kmcfit::objective::{Channel, GradientKind, View, Weighting};
use kmcfit::problem::{Experiment, Problem};
use kmcfit::report::{CostKind, cost_definition};
use kmcfit::solvers::{Fit, FitSettings, Initial, Measurements, Solver, Status, Stopping, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const REST: State = State {
    displacement: 0.0,
    velocity: 0.0,
};

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::EquationError,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping::default(),
        interrupt: None,
    }
}

fn run(problem: &Problem) -> Fit {
    fit(problem, &problem.start(), &settings(), &mut |_| {}).expect("it has no motion to lose")
}

fn oscillator(duration: f64, nodes: usize) -> Oscillator {
    Oscillator {
        grid: Grid::new(0.0, duration, nodes).unwrap(),
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    }
}

/// A force that is linear between independent normal values every `hold` nodes.
fn random_force(nodes: usize, hold: usize, seed: u64) -> Vec<f64> {
    use rand_distr::{Distribution, StandardNormal};
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let corners: Vec<f64> = (0..nodes / hold + 2)
        .map(|_| StandardNormal.sample(&mut random))
        .collect();
    let at = |i: usize| {
        let x = (i % hold) as f64 / hold as f64;
        corners[i / hold] * (1.0 - x) + corners[i / hold + 1] * x
    };
    (0..nodes).map(at).collect()
}

/// The readings of a channel that a device under a force gives at every node.
fn readings(
    oscillator: &Oscillator,
    device: &Device,
    force: &[f64],
    kind: ChannelKind,
    initial: State,
) -> Channel {
    let grid = &oscillator.grid;
    let excitation = Excitation::force_at_nodes(force);
    let motion = oscillator
        .forward(device, initial, Some(&excitation))
        .unwrap();
    let view = View {
        oscillator,
        device,
        excitation: Some(&excitation),
        motion: &motion,
        scalars: &[],
    };
    let of = |values: Vec<f64>| {
        let weighting = Weighting::Integral {
            spacing: grid.step(),
        };
        Channel::new(kind, grid.times(), values, weighting, grid, grid.nodes()).unwrap()
    };
    of(of(vec![0.0; grid.nodes()]).predict(view))
}

/// One experiment, mass first among the functions, with the rule `period` of order 1 for those that
/// are nodal.
fn problem_of(oscillator: Oscillator, list: Vec<CoefficientFunction>, experiment: Experiment) -> Problem {
    let grid = oscillator.grid;
    let functions = Functions::new(list, grid.nodes(), grid.step()).unwrap();
    let mut problem = Problem::new(oscillator, functions, vec![experiment]);
    let measurements = Measurements::of(&problem).unwrap();
    let bases: Vec<_> = problem.functions.iter().map(|f| f.basis.clone()).collect();
    for (j, basis) in bases.iter().enumerate() {
        if let Some(basis @ (Basis::Nodal | Basis::BSpline { .. })) = basis {
            let weight = measurements.period_weight(&problem, j, 1);
            let rows = basis.roughness(&grid, 1);
            problem.penalties.push(Penalty::new(j, 1, weight, rows));
        }
    }
    problem
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn slow_stiffness_under_an_unknown_force() {
    // 2 Hz on the average, up and down by a quarter in k four times.
    let (duration, nodes) = (60.0, 6001);
    let oscillator = oscillator(duration, nodes);
    let base = (TAU * 2.0_f64).powi(2);
    let k: Vec<f64> = (oscillator.grid.times().iter())
        .map(|t| base * (1.0 + 0.25 * (TAU * t / 15.0).sin()))
        .collect();
    let device = Device {
        mass: vec![1.0; nodes],
        coefficients: vec![vec![0.02 * 2.0 * base.sqrt(); nodes], k.clone()],
    };
    for seed in 1..=5 {
        let force = random_force(nodes, 5, seed);
        let channel = readings(&oscillator, &device, &force, ChannelKind::Acceleration, REST);
        let list = vec![
            CoefficientFunction::fixed(Quantity::Mass, vec![1.0; nodes]),
            CoefficientFunction::nodal(Quantity::Damping, vec![0.0; nodes]),
            CoefficientFunction::nodal(Quantity::Stiffness, vec![1.0; nodes]),
        ];
        let experiment = Experiment::free("shaken", REST, nodes).with_channel(channel);
        let problem = problem_of(oscillator.clone(), list, experiment);
        let found = run(&problem);
        assert_eq!(found.outcome.status, Status::Converged, "{:?}", found.outcome);
        let found = &found.best.evaluation.device.coefficients[1];
        let inner = nodes / 30..nodes - nodes / 30;
        let errors: Vec<f64> = inner.map(|i| (found[i] / k[i]).max(0.0).sqrt() - 1.0).collect();
        let sizes = errors.iter().map(|e| e.abs()).collect();
        println!("seed {seed}: median {:.4} rms {:.4}", median(sizes), rms(&errors));
    }
}

#[test]
fn constants_under_a_known_force() {
    let (duration, nodes) = (60.0, 6001);
    let oscillator = oscillator(duration, nodes);
    let device = Device {
        mass: vec![2.0; nodes],
        coefficients: vec![vec![1.5; nodes], vec![300.0; nodes]],
    };
    for kind in ChannelKind::ALL {
        for seed in 1..=3 {
            let force = random_force(nodes, 5, seed);
            let channel = readings(&oscillator, &device, &force, kind, REST);
            let list = vec![
                CoefficientFunction::constant(Quantity::Mass, 1.0, nodes),
                CoefficientFunction::constant(Quantity::Damping, 0.0, nodes),
                CoefficientFunction::constant(Quantity::Stiffness, 1.0, nodes),
            ];
            let experiment = Experiment::free("driven", REST, nodes)
                .with_excitation(Excitation::force_at_nodes(&force))
                .with_channel(channel);
            let problem = problem_of(oscillator.clone(), list, experiment);
            let found = run(&problem);
            println!("{} {:?} {}", kind.name(), found.best.parameters, found.outcome.reason);
        }
    }
}

/// Tip acceleration of a cantilever whose support moves at random (Vereen, Downey, Dodson and Moura
/// 2023, Dataset-8 DROPBEAR, CC BY-SA 4.0).
#[test]
fn dropbear() {
    let Some(folder) = common::shared("data") else {
        return;
    };
    let rows = common::csv(&folder.join("dropbear8_random_0_mode1_500Hz.csv"));
    let column = |j: usize| rows.iter().map(|row| row[j]).collect::<Vec<f64>>();
    let (times, acceleration, reference) = (column(0), column(1), column(3));
    let nodes = times.len();
    let clock = std::time::Instant::now();
    let duration = times[nodes - 1] - times[0];
    let mut oscillator = oscillator(duration, nodes);
    oscillator.grid = Grid::new(times[0], duration, nodes).unwrap();
    let grid = oscillator.grid;
    let weighting = Weighting::Integral {
        spacing: grid.step(),
    };
    let channel = Channel::new(
        ChannelKind::Acceleration,
        grid.times(),
        acceleration.clone(),
        weighting,
        &grid,
        nodes,
    );
    let list = vec![
        CoefficientFunction::fixed(Quantity::Mass, vec![1.0; nodes]),
        CoefficientFunction::nodal(Quantity::Damping, vec![0.0; nodes]),
        CoefficientFunction::nodal(Quantity::Stiffness, vec![1.0; nodes]),
    ];
    let experiment = Experiment::free("tip", REST, nodes).with_channel(channel.unwrap());
    let problem = problem_of(oscillator, list, experiment);
    let found = run(&problem);
    let seconds = clock.elapsed().as_secs_f64();
    assert_eq!(found.outcome.status, Status::Converged, "{:?}", found.outcome);
    let evaluation = &found.best.evaluation;
    let motion = &evaluation.trajectories[0];
    let w = rms(&motion.velocity) / rms(&motion.displacement);
    let mean = acceleration.iter().sum::<f64>() / nodes as f64;
    let mut errors = Vec::new();
    for i in 0..nodes {
        let envelope = (acceleration[i] - mean).hypot(w * motion.velocity[i]);
        if times[i] > 0.8 && times[i] < 11.5 && envelope > 0.02 {
            let k = evaluation.device.coefficients[1][i];
            errors.push(k.max(0.0).sqrt() / TAU - reference[i]);
        }
    }
    let middle = median(errors.iter().map(|e| e.abs()).collect());
    println!(
        "DROPBEAR: median {middle:.4} Hz, rms {:.4} Hz over {} readings, {seconds:.3} s, J {:?}",
        rms(&errors), errors.len(), (found.initial_cost, evaluation.cost, evaluation.misfit)
    );
    assert!(middle <= 0.25, "{middle}");
    assert!(rms(&errors) <= 0.70, "{}", rms(&errors));
}
