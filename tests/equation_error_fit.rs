//! The equation error as a method: records whose excitation nobody knows, and records with one.

mod common;

use insta::assert_snapshot;
use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::constraints::RowGroup;
use kmcfit::dynamics::{
    ChannelKind, Device, Excitation, Grid, Method, Oscillator, State, Stepwise, Term,
};
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

const NODES: usize = 6001;
const WAVES: usize = 200;

/// A minute at 100 readings per s.
fn oscillator() -> Oscillator {
    Oscillator {
        grid: Grid::new(0.0, 60.0, NODES).unwrap(),
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    }
}

/// A smooth random function of time with energy from 0.3 Hz to 8 Hz, of about unit variance: at the left
/// end, middle and right end of every step.
fn random_function(grid: &Grid, seed: u64) -> Stepwise {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 2]> = (0..WAVES)
        .map(|_| [random.random_range(0.3..8.0), random.random_range(0.0..TAU)])
        .collect();
    let at = |t: f64| -> f64 {
        let sum: f64 = waves
            .iter()
            .map(|[f, phase]| (TAU * f * t + phase).sin())
            .sum();
        sum * (2.0 / WAVES as f64).sqrt()
    };
    let half = 0.5 * grid.step();
    let step = |i: usize| [0.0, half, 2.0 * half].map(|d| at(grid.time(i) + d));
    Stepwise::new((0..grid.nodes() - 1).map(step).collect())
}

/// What a sensor of `kind` reads at every node of a device at rest in the beginning.
fn readings(
    oscillator: &Oscillator,
    device: &Device,
    excitation: &Excitation,
    kind: ChannelKind,
) -> Channel {
    let grid = &oscillator.grid;
    let excitation = Some(excitation);
    let motion = oscillator.forward(device, REST, excitation).unwrap();
    let view = View {
        oscillator,
        device,
        excitation,
        motion: &motion,
        scalars: &[],
    };
    let silent = channel(kind, grid, vec![0.0; grid.nodes()]);
    channel(kind, grid, silent.predict(view))
}

fn channel(kind: ChannelKind, grid: &Grid, values: Vec<f64>) -> Channel {
    let weighting = Weighting::Integral {
        spacing: grid.step(),
    };
    Channel::new(kind, grid.times(), values, weighting, grid, grid.nodes()).unwrap()
}

/// One experiment, mass first among the functions, with the rule `period` of order 1 for those that
/// are nodal.
fn problem_of(
    oscillator: Oscillator,
    list: Vec<CoefficientFunction>,
    experiment: Experiment,
) -> Problem {
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

/// Mass known, damping and stiffness free at every node.
fn free_at_nodes(nodes: usize) -> Vec<CoefficientFunction> {
    vec![
        CoefficientFunction::fixed(Quantity::Mass, vec![1.0; nodes]),
        CoefficientFunction::nodal(Quantity::Damping, vec![0.0; nodes]),
        CoefficientFunction::nodal(Quantity::Stiffness, vec![1.0; nodes]),
    ]
}

/// A device of 2 Hz whose stiffness goes up and down by a quarter four times, shaken by a force that
/// nobody tells the fit, its acceleration, and its stiffness.
fn shaken(seed: u64, list: Vec<CoefficientFunction>) -> (Problem, Vec<f64>) {
    let oscillator = oscillator();
    let base = (TAU * 2.0_f64).powi(2);
    let k: Vec<f64> = (oscillator.grid.times().iter())
        .map(|t| base * (1.0 + 0.25 * (TAU * t / 15.0).sin()))
        .collect();
    let device = Device {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.005 * 2.0 * base.sqrt(); NODES], k.clone()],
    };
    let excitation = Excitation {
        force: Some(random_function(&oscillator.grid, seed)),
        base: None,
    };
    let channel = readings(&oscillator, &device, &excitation, ChannelKind::Acceleration);
    let experiment = Experiment::free("shaken", REST, NODES).with_channel(channel);
    (problem_of(oscillator, list, experiment), k)
}

/// The unknown force stands in the equation as an error of its own: with a damping ratio of 0.5 % it
/// is about a tenth of the stiffness' force, and one dominant period of averaging leaves per cents of
/// the frequency, which itself swings by 12 % (8.8 % rms about its mean).
#[test]
fn slow_stiffness_under_an_unknown_force() {
    for seed in 1..=5 {
        let (problem, k) = shaken(seed, free_at_nodes(NODES));
        let found = run(&problem);
        let outcome = &found.outcome;
        assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
        let found = &found.best.evaluation.device.coefficients[1];
        let inner = NODES / 30..NODES - NODES / 30;
        let errors: Vec<f64> = inner
            .map(|i| (found[i] / k[i]).max(0.0).sqrt() - 1.0)
            .collect();
        let middle = median(errors.iter().map(|e| e.abs()).collect());
        println!(
            "seed {seed}: frequency to {middle:.4} (median), {:.4} (rms)",
            rms(&errors)
        );
    }
}

fn constants(mass: Option<f64>) -> Vec<CoefficientFunction> {
    let constant = |quantity, start| CoefficientFunction::constant(quantity, start, NODES);
    vec![
        match mass {
            Some(mass) => CoefficientFunction::fixed(Quantity::Mass, vec![mass; NODES]),
            None => constant(Quantity::Mass, 1.0),
        },
        constant(Quantity::Damping, 0.0),
        constant(Quantity::Stiffness, 1.0),
    ]
}

/// m = 2, c = 1.5, k = 300 under a known force or base.
fn driven(kind: ChannelKind, excitation: Excitation, mass: Option<f64>) -> Problem {
    let oscillator = oscillator();
    let device = Device {
        mass: vec![2.0; NODES],
        coefficients: vec![vec![1.5; NODES], vec![300.0; NODES]],
    };
    let channel = readings(&oscillator, &device, &excitation, kind);
    let experiment = Experiment::free("driven", REST, NODES)
        .with_excitation(excitation)
        .with_channel(channel);
    problem_of(oscillator, constants(mass), experiment)
}

/// The relations between the readings are of order 4: at 8 Hz and 100 readings per s they are true to
/// (w h)^4/240 = 3e-4; the ends leave 1e-4.
#[test]
fn constants_under_a_known_force() {
    for kind in [ChannelKind::Acceleration, ChannelKind::Displacement] {
        for seed in 1..=3 {
            let excitation = Excitation {
                force: Some(random_function(&oscillator().grid, seed)),
                base: None,
            };
            let found = run(&driven(kind, excitation, None));
            println!("{} {seed}: {:?}", kind.name(), found.best.parameters);
        }
    }
}

/// The base pushes in proportion to the mass, so only the ratios to it are found.
#[test]
fn constants_on_a_known_base() {
    for mass in [Some(2.0), None] {
        let excitation = Excitation {
            force: None,
            base: Some(random_function(&oscillator().grid, 4)),
        };
        let found = run(&driven(ChannelKind::Acceleration, excitation, mass));
        println!("base {mass:?}: {:?}", found.best.parameters);
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
    let grid = Grid::new(times[0], times[nodes - 1] - times[0], nodes).unwrap();
    let oscillator = Oscillator {
        grid,
        ..oscillator()
    };
    let readings = channel(ChannelKind::Acceleration, &grid, acceleration.clone());
    let list = free_at_nodes(nodes);
    let experiment = Experiment::free("tip", REST, nodes).with_channel(readings);
    let problem = problem_of(oscillator, list, experiment);
    let found = run(&problem);
    let seconds = clock.elapsed().as_secs_f64();
    assert_eq!(
        found.outcome.status,
        Status::Converged,
        "{:?}",
        found.outcome
    );
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
        rms(&errors),
        errors.len(),
        (found.initial_cost, evaluation.cost, evaluation.misfit)
    );
    assert!(middle <= 0.25, "{middle}");
    assert!(rms(&errors) <= 0.70, "{}", rms(&errors));
}
