//! The method `equation-error`: records under an unmeasured and under a measured excitation.

use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{
    Basis, CoefficientFunction, Parameterization, Penalty, uniform_knots,
};
use kmcfit_core::objective::{GradientKind, SimulatedRecord};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Measurements, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Solver, Status, Stopping, fit};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, Method, NodalCoefficients, StageSamples, State, System,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::EquationError,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping::default(),
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

fn run(problem: &Problem) -> Fit {
    fit(problem, &problem.start(), &settings(), &mut |_| {}).expect("it has no motion to lose")
}

const NODES: usize = 6001;
const WAVES: usize = 200;

/// A minute at 100 samples per s.
fn system() -> System {
    System {
        grid: Grid::new(0.0, 60.0, NODES).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

/// A smooth random function of time with energy from 0.3 Hz to 8 Hz, of about unit variance: at the left
/// end, middle and right end of every step.
fn random_function(grid: &Grid, seed: u64) -> StageSamples {
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
    StageSamples::new((0..grid.nodes() - 1).map(step))
}

/// Samples of a sensor of `kind` at every node, of a system initially at rest.
fn sample_table(
    system: &System,
    device: &NodalCoefficients,
    excitation: &Excitation,
    kind: ChannelKind,
) -> Channel {
    let grid = &system.grid;
    let excitation = Some(excitation);
    let motion = system
        .forward(device, &State::one(0.0, 0.0), excitation)
        .unwrap();
    let view = SimulatedRecord {
        system,
        nodal: device,
        excitation,
        response: &motion,
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
fn problem_of(system: System, list: Vec<CoefficientFunction>, experiment: Experiment) -> Problem {
    let grid = system.grid;
    let functions = Parameterization::new(list, grid.nodes(), grid.step()).unwrap();
    let mut problem = Problem::new(system, functions, vec![experiment]).unwrap();
    let measurements = Measurements::of(&problem).unwrap();
    let bases: Vec<_> = problem.functions.iter().map(|f| f.basis.clone()).collect();
    for (j, basis) in bases.iter().enumerate() {
        if let Some(basis @ (Basis::Nodal | Basis::BSpline { .. })) = basis {
            let weight = measurements.period_weight(&problem, j, 1);
            let rows = basis.roughness(&grid, 1);
            problem.penalize(Penalty::new(j, 1, weight, rows)).unwrap();
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
        CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
        CoefficientFunction::nodal(CoefficientKind::DAMPING, vec![0.0; nodes]),
        CoefficientFunction::nodal(CoefficientKind::STIFFNESS, vec![1.0; nodes]),
    ]
}

/// A system of 2 Hz whose stiffness oscillates by a quarter in four cycles, under a force that the fit does not have: its
/// acceleration and stiffness.
fn shaken(seed: u64, list: Vec<CoefficientFunction>) -> (Problem, Vec<f64>) {
    let system = system();
    let base = (TAU * 2.0_f64).powi(2);
    let k: Vec<f64> = (system.grid.times().iter())
        .map(|t| base * (1.0 + 0.25 * (TAU * t / 15.0).sin()))
        .collect();
    let device = NodalCoefficients {
        inertias: vec![vec![1.0; NODES]],
        coefficients: vec![vec![0.005 * 2.0 * base.sqrt(); NODES], k.clone()],
    };
    let excitation = Excitation::one(Some(random_function(&system.grid, seed)), None);
    let channel = sample_table(&system, &device, &excitation, ChannelKind::Acceleration);
    let experiment = Experiment::free("shaken", State::one(0.0, 0.0), NODES).with_channel(channel);
    (problem_of(system, list, experiment), k)
}

/// The unknown force is an error of the equation. With a damping ratio of 0.5 % it is about a tenth of the spring force; after
/// averaging over one dominant period the error of the frequency is a few per cent, while the frequency itself varies by 12 %
/// (8.8 % rms about its mean).
#[test]
fn slow_stiffness_under_an_unknown_force() {
    for seed in 1..=5 {
        let (problem, k) = shaken(seed, free_at_nodes(NODES));
        let found = run(&problem);
        let outcome = &found.outcome;
        assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
        let found = &found.best.evaluation.nodal.coefficients[1];
        let inner = NODES / 30..NODES - NODES / 30;
        let errors: Vec<f64> = inner
            .map(|i| (found[i] / k[i]).max(0.0).sqrt() - 1.0)
            .collect();
        let middle = median(errors.iter().map(|e| e.abs()).collect());
        assert!(middle < 0.02 && rms(&errors) < 0.05, "{seed}: {middle}");
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
            Some(mass) => CoefficientFunction::fixed(CoefficientKind::MASS, vec![mass; NODES]),
            None => constant(CoefficientKind::MASS, 1.0),
        },
        constant(CoefficientKind::DAMPING, 0.0),
        constant(CoefficientKind::STIFFNESS, 1.0),
    ]
}

fn close(found: &[f64], expected: &[f64], within: f64) {
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f / e - 1.0).abs() < within,
            "{found:?} is not {expected:?}"
        );
    }
}

/// m = 2, c = 1.5, k = 300 under a known force or base.
fn driven(kind: ChannelKind, excitation: Excitation, mass: Option<f64>) -> Problem {
    let system = system();
    let device = NodalCoefficients {
        inertias: vec![vec![2.0; NODES]],
        coefficients: vec![vec![1.5; NODES], vec![300.0; NODES]],
    };
    let channel = sample_table(&system, &device, &excitation, kind);
    let experiment = Experiment::free("driven", State::one(0.0, 0.0), NODES)
        .with_excitation(excitation)
        .with_channel(channel);
    problem_of(system, constants(mass), experiment)
}

/// The relations between the samples are of order 4: at 8 Hz and 100 samples per s they are true to
/// (w h)^4/240 = 3e-4; the ends leave 1e-4.
#[test]
fn constants_under_a_known_force() {
    for kind in [ChannelKind::Acceleration, ChannelKind::Displacement] {
        for seed in 1..=3 {
            let excitation = Excitation::one(Some(random_function(&system().grid, seed)), None);
            let found = run(&driven(kind, excitation, None));
            let within = match kind {
                // Smoothing by a noise level that a noise-free record does not have.
                ChannelKind::Displacement => 5e-3,
                _ => 1e-3,
            };
            close(&found.best.parameters, &[2.0, 1.5, 300.0], within);
            assert!(found.best.evaluation.cost < 1e-4 * found.initial_cost);
        }
    }
}

/// The force of a moving base is proportional to the mass, so only ratios to the mass are identifiable.
#[test]
fn constants_on_a_known_base() {
    for mass in [Some(2.0), None] {
        let excitation = Excitation::one(None, Some(random_function(&system().grid, 4)));
        let found = run(&driven(ChannelKind::Acceleration, excitation, mass));
        let expected: &[f64] = match mass {
            Some(_) => &[1.5, 300.0],
            // The mass keeps its start.
            None => &[1.0, 0.75, 150.0],
        };
        close(&found.best.parameters, expected, 1e-3);
    }
}

/// Active bounds need a quadratic program; soft constraints are part of the same problem.
#[test]
fn constraints_and_soft_constraints() {
    let grid = system().grid;
    let basis = Basis::PiecewiseLinear {
        knots: uniform_knots(&grid, 41),
    };
    let list = || {
        let free = |quantity, start| {
            CoefficientFunction::free(quantity, basis.clone(), &grid, vec![start; 41])
        };
        vec![
            CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; NODES]),
            free(CoefficientKind::DAMPING, 0.0),
            free(CoefficientKind::STIFFNESS, 150.0),
        ]
    };
    let (plain, _) = shaken(2, list());
    let free = run(&plain);
    assert_eq!(free.counts.qp, 0);
    let group = |soft: Option<f64>| {
        let mut group = RowGroup::new("stiffness <= 170");
        for j in 41..82 {
            group.push([(j, 1.0)], [f64::NEG_INFINITY, 170.0], [0.0, 60.0]);
        }
        group.soft = soft;
        group
    };
    let mut bounded = plain.clone();
    bounded = bounded
        .with(|parts| {
            parts.constraints.groups.push(group(None));
        })
        .unwrap();
    let bounded = run(&bounded);
    assert_eq!(bounded.outcome.status, Status::Converged);
    assert_eq!(bounded.counts.qp, 1);
    let highest = |fit: &Fit| {
        fit.best.parameters[41..]
            .iter()
            .fold(0.0f64, |m, k| m.max(*k))
    };
    assert!(highest(&free) > 180.0);
    assert!(
        highest(&bounded) <= 170.0 * (1.0 + 1e-6),
        "{}",
        highest(&bounded)
    );
    let mut before = free.best.evaluation.cost;
    for weight in [1e-4, 1e-2, 1e4] {
        let mut soft = plain.clone();
        soft = soft
            .with(|parts| {
                parts.soft.push(group(Some(weight)));
            })
            .unwrap();
        let soft = run(&soft);
        let cost = soft.best.evaluation.cost;
        assert!(
            before < cost && cost < bounded.best.evaluation.cost,
            "{before} {cost}"
        );
        before = cost;
        // The gradient of J with the penalty is zero to the accuracy of the quadratic program.
        let left = soft.best.gradient.norm_squared / soft.initial_norm_squared;
        assert!(left < 1e-6, "{weight}: {left}");
    }
    let last = before / bounded.best.evaluation.cost;
    assert!(last > 0.999, "a high price is a bound: {last}");
}

/// y = cos t solves y'' + y = 0, so with k = 1.5 the error is 0.5 cos t: in the pointwise form, which a value per node needs, the cost
/// at the start is the integral of its square over all samples but the two at each end, where no differences are known.
#[test]
fn the_cost_is_the_integral_of_the_squared_error() {
    let duration = 20.0;
    for stride in [1, 4] {
        let nodes = 100 * stride + 1;
        let system = System {
            grid: Grid::new(0.0, duration, nodes).unwrap(),
            ..system()
        };
        let grid = system.grid;
        let spacing = duration / 100.0;
        let observed: Vec<f64> = (0..=100).map(|i| (spacing * f64::from(i)).cos()).collect();
        let weighting = Weighting::Integral { spacing };
        let channel = Channel::displacement_at_nodes(observed, stride, weighting, &grid);
        let initial = State::one(1.0, 0.0);
        let list = vec![
            CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
            CoefficientFunction::fixed(CoefficientKind::DAMPING, vec![0.0; nodes]),
            CoefficientFunction::nodal(CoefficientKind::STIFFNESS, vec![1.5; nodes]),
        ];
        let experiment = Experiment::free("harmonic", initial, nodes).with_channel(channel);
        let found = run(&problem_of(system, list, experiment));
        // Each time represents one sampling interval about it.
        let (from, to) = (1.5 * spacing, duration - 1.5 * spacing);
        let integral = |t: f64| 0.25 * (0.5 * t + 0.25 * (2.0 * t).sin());
        let expected = integral(to) - integral(from);
        assert!(
            (found.initial_cost / expected - 1.0).abs() < 0.01,
            "{stride}: {} {expected}",
            found.initial_cost
        );
        // Near the ends the penalty follows errors of the smoothed samples.
        let mean = found.best.parameters.iter().sum::<f64>() / nodes as f64;
        close(&[mean], &[1.0], 5e-3);
    }
}

/// Number of samples at either end that are not smoothed.
fn left_out(problem: &Problem) -> [usize; 2] {
    let found = run(problem);
    let predicted = &found.best.evaluation.predictions[0][0];
    let residuals: Vec<f64> = problem.experiments[0].channels[0]
        .residuals(predicted)
        .collect();
    // Omitted samples keep their values.
    let zeros = |r: &mut dyn Iterator<Item = &f64>| r.take_while(|r| **r == 0.0).count();
    [
        zeros(&mut residuals.iter()),
        zeros(&mut residuals.iter().rev()),
    ]
}

/// The natural frequency is sqrt(k/m) = 12.2 rad/s. With a measured force, two periods are omitted at either end; without one,
/// one sample.
#[test]
fn two_periods_are_left_out_beside_a_known_force() {
    let excitation = Excitation::one(Some(random_function(&system().grid, 1)), None);
    let mut problem = driven(ChannelKind::Acceleration, excitation, None);
    let period = TAU / (300.0_f64 / 2.0).sqrt();
    let expected = 2.0 * period / problem.system.grid.step();
    for count in left_out(&problem) {
        // The largest line of the spectrum is within the width of the resonance, 6 %.
        let share = count as f64 / expected;
        assert!((0.9..1.1).contains(&share), "{count} {expected}");
    }
    problem = problem
        .with(|parts| {
            parts.experiments[0].excitation = None;
        })
        .unwrap();
    assert_eq!(left_out(&problem), [1, 1]);
}
