//! Identification of nonlinear systems from input and response with one per cent of noise.

use crate::common::forced::{broadband, response, white};
use crate::common::synthetic::{Truth, cramer_rao, rms, run, with_noise};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::functions::{CoefficientFunction, Parameterization};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Weighting};
use kmcfit_core::step::Trajectory;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};

const NOISE: f64 = 0.01;
fn rest() -> State {
    State::one(0.0, 0.0)
}

/// A constant: its kind, true value and start value.
type Constant = (CoefficientKind, f64, f64);

struct Case {
    system: System,
    excitation: Excitation,
    constants: Vec<Constant>,
}

impl Case {
    fn nodal(&self) -> NodalCoefficients {
        let nodes = self.system.grid.nodes();
        let values = |c: &Constant| vec![c.1; nodes];
        NodalCoefficients {
            inertias: vec![values(&self.constants[0])],
            coefficients: self.constants[1..].iter().map(values).collect(),
        }
    }

    fn response(&self) -> Trajectory {
        let (nodal, excitation) = (self.nodal(), Some(&self.excitation));
        self.system.forward(&nodal, &rest(), excitation).unwrap()
    }

    fn problem(&self, seed: u64) -> Problem {
        let grid = self.system.grid;
        let nodal = self.nodal();
        let truth = Truth {
            system: &self.system,
            nodal: &nodal,
            excitation: Some(&self.excitation),
            initial: rest(),
        };
        let kind = ChannelKind::Displacement;
        let clean = truth.seen(kind, &grid.times(), &[]);
        let sigma = NOISE * rms(&clean);
        let values = with_noise(&clean, sigma, seed);
        let (nodes, weighting) = (grid.nodes(), Weighting::Sigma(sigma));
        let channel = Channel::new(kind, grid.times(), values, weighting, &grid, nodes).unwrap();
        let list = self.constants.iter();
        let list = list.map(|(q, _, start)| CoefficientFunction::constant(*q, *start, nodes));
        let functions = Parameterization::new(list.collect(), nodes, grid.step()).unwrap();
        let experiment = Experiment::free("driven", rest(), nodes)
            .with_excitation(self.excitation.clone())
            .with_channel(channel);
        Problem::new(self.system.clone(), functions, vec![experiment]).unwrap()
    }

    /// All constants to one per cent, and as near as the noise allows.
    fn check(&self) {
        for seed in 1..=5 {
            let problem = self.problem(seed);
            let found = run(&problem);
            let covariance = cramer_rao(&problem, &found.best.parameters);
            for (j, (quantity, truth, _)) in self.constants.iter().enumerate() {
                let error = found.best.parameters[j] / truth - 1.0;
                let spread = covariance[(j, j)].sqrt() / truth;
                println!("{} {error:+.1e}, spread {spread:.1e}", quantity.name());
                // The limit is one per cent; an error beyond four standard deviations has a probability of 1e-3 for all 40 together.
                assert!(
                    error.abs() < 0.01,
                    "{quantity:?} {error} {:#?}",
                    found.attempts
                );
                assert!(error.abs() < 4.0 * spread, "{quantity:?} {error} {spread}");
            }
            println!(
                "  {:?}",
                found
                    .attempts
                    .iter()
                    .map(|r| (r.start, r.history.len()))
                    .collect::<Vec<_>>()
            );
        }
    }
}

fn system(nodes: usize, duration: f64, terms: &[Law]) -> System {
    System {
        grid: Grid::new(0.0, duration, nodes).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(terms.to_vec()),
    }
}

fn push(grid: &Grid, force: impl Fn(f64) -> f64) -> Excitation {
    let force: Vec<f64> = grid.times().into_iter().map(force).collect();
    Excitation::force_at_nodes(&force)
}

fn duffing(factors: [f64; 4]) -> Case {
    let terms = [Law::Damping, Law::Stiffness, Law::CubicStiffness];
    // 30 to 60 steps in a period of the system, which is 2 to 4 s.
    let system = system(1501, 100.0, &terms);
    let truth = [
        (CoefficientKind::MASS, 1.0),
        (CoefficientKind::DAMPING, 0.2),
        (CoefficientKind::STIFFNESS, 2.5),
        (CoefficientKind::CUBIC_STIFFNESS, 1.2),
    ];
    let constants = truth.into_iter().zip(factors);
    Case {
        excitation: push(&system.grid, |t| {
            2.0 * (1.2 * t).cos() + 1.5 * (2.3 * t).sin()
        }),
        constants: constants.map(|((q, p), f)| (q, p, f * p)).collect(),
        system,
    }
}

/// From start values that are all too large and all too small, without a cubic term.
#[test]
fn a_forced_duffing_oscillator_to_one_per_cent() {
    for factors in [[2.5, 5.0, 2.0, 3.0], [0.4, 0.2, 0.5, 0.0]] {
        let case = duffing(factors);
        // Strongly nonlinear: at the largest displacement the cubic force exceeds the linear one.
        let most = (case.response().displacement(0).iter()).fold(0.0f64, |m, y| m.max(y.abs()));
        assert!(1.2 * most * most > 2.5, "{most}");
        case.check();
    }
}

const WIDTH: f64 = 0.01;
const FRICTION: f64 = 0.6;
/// Period of the force, s.
const PERIOD: f64 = 12.0;
const PERIODS: usize = 6;
const STEPS: usize = 600;

fn stick_slip() -> Case {
    let terms = [Law::Stiffness, Law::CoulombFriction { width: WIDTH }];
    // A step of 0.02 s: friction alone slows the mass within width m / F = 0.017 s while it sticks,
    // and the stepper is stable up to 2.8 of these.
    let system = system(PERIODS * STEPS + 1, PERIODS as f64 * PERIOD, &terms);
    let w = std::f64::consts::TAU / PERIOD;
    Case {
        excitation: push(&system.grid, |t| 1.5 * (w * t).cos()),
        constants: vec![
            (CoefficientKind::MASS, 1.0, 2.0),
            (CoefficientKind::STIFFNESS, 2.0, 1.0),
            (CoefficientKind::COULOMB_FRICTION, FRICTION, 0.25),
        ],
        system,
    }
}

#[test]
fn a_mass_that_sticks_in_every_cycle_to_one_per_cent() {
    let case = stick_slip();
    let response = case.response();
    let force = case.excitation.force(0).unwrap().at_nodes();
    for cycle in 0..PERIODS {
        let nodes = cycle * STEPS..(cycle + 1) * STEPS;
        // At rest except for the creep of the smoothed friction, which alone balances the force.
        let sticks = |i: &usize| {
            let pull = force[*i] - 2.0 * response.displacement(0)[*i];
            response.velocity(0)[*i].abs() < 2.0 * WIDTH && pull.abs() < FRICTION
        };
        let share = nodes.clone().filter(sticks).count() as f64 / STEPS as f64;
        let fastest = nodes
            .map(|i| response.velocity(0)[i].abs())
            .fold(0.0, f64::max);
        println!("cycle {cycle}: sticks for {share:.2} of it, up to {fastest:.2} m/s");
        assert!((0.1..0.7).contains(&share), "{share}");
        assert!(fastest > 20.0 * WIDTH, "{fastest}");
    }
    case.check();
}

/// Two records of one oscillator whose guides have another friction in each: both frictions within four standard errors, 1 % of
/// 0.4 N at most by the noise of 1 %.
#[test]
fn each_record_has_its_own_friction() {
    const WIDTH: f64 = 0.01;
    const SPACING: f64 = 0.02;
    let frictions = [0.4, 0.8];
    let [m, c, k] = [2.0, 0.5, 80.0];
    let mut builder = {
        let parts = [m, c, k].map(|value| CoefficientSpec::constant(1.1 * value));
        Builder::new(parts).coulomb_friction(CoefficientSpec::constant(0.5), WIDTH)
    };
    for (i, friction) in frictions.into_iter().enumerate() {
        let seed = i as u64;
        let force = broadband(white(seed, 1, 1500));
        let states = response(SPACING, [0.0, 0.0], &force, |_, y, v, f| {
            (f - c * v - k * y - friction * v / v.hypot(WIDTH)) / m
        });
        let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
        let sigma = NOISE * rms(&exact);
        let noise = white(seed, 2, exact.len());
        let samples: Vec<f64> = exact
            .iter()
            .zip(noise)
            .map(|(y, e)| y + sigma * e)
            .collect();
        let times: Vec<f64> = (0..exact.len()).map(|i| SPACING * i as f64).collect();
        let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
        channel.weighting = Some(Weighting::Sigma(sigma));
        let mut record = Record::new(format!("record {i}"))
            .from_state(0.0, 0.0)
            .force(&times, &force)
            .channel(channel);
        if i == 1 {
            let own = CoefficientSpec::constant(0.5);
            record = record.coefficient(CoefficientKind::COULOMB_FRICTION, own);
        }
        builder = builder.record(record);
    }
    // Ten steps per sample resolve the change of the sign.
    let problem = builder.nodes(14_991).build().unwrap();
    let fit = run(&problem);
    let covariance = cramer_rao(&problem, &fit.best.parameters);
    for (position, friction) in [(3, 0.4), (4, 0.8)] {
        let error = covariance[(position, position)].sqrt();
        let found = fit.best.parameters[position];
        assert!(
            (found - friction).abs() < 4.0 * error,
            "{found} {friction} +- {error}"
        );
        assert!(error < 0.004, "{error}");
    }
}

/// Constants of a forced system, from samples of a displacement `exact` every `spacing` seconds with one per cent of noise: each within four
/// standard errors of the `truth`.
fn constants_are_found(
    builder: Builder,
    spacing: f64,
    force: &[f64],
    exact: &[f64],
    truth: &[f64],
    seed: u64,
) -> Vec<f64> {
    let sigma = NOISE * rms(exact);
    let samples = with_noise(exact, sigma, seed);
    let times: Vec<f64> = (0..exact.len()).map(|i| spacing * i as f64).collect();
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
    channel.weighting = Some(Weighting::Sigma(sigma));
    let record = Record::new("forced")
        .from_state(0.0, 0.0)
        .force(&times, force)
        .channel(channel);
    let problem = builder.record(record).build().unwrap();
    let found = run(&problem).best.parameters;
    let covariance = cramer_rao(&problem, &found);
    for (j, truth) in truth.iter().enumerate() {
        let (found, error) = (found[j], covariance[(j, j)].sqrt());
        println!("{seed} {j}: {found:.5} of {truth}, +- {error:.1e}");
        assert!(
            (found - truth).abs() < 4.0 * error,
            "{seed} {j}: {found} {truth} +- {error}"
        );
    }
    found
}

/// An asymmetric spring that hardens with the fifth power, from data of the independent integrator: all five constants of five
/// records within four standard errors (a probability of 2e-3 for all 25 together), and within 5 %.
#[test]
fn an_asymmetric_quintic_spring() {
    const SPACING: f64 = 0.02;
    let truth = [1.0, 0.3, 20.0, 8.0, 30.0];
    let [m, c, k, k2, k5] = truth;
    for seed in 0..5 {
        let force: Vec<f64> = broadband(white(seed, 1, 3000))
            .into_iter()
            .map(|f| 0.5 * f)
            .collect();
        let states = response(SPACING, [0.0, 0.0], &force, |_, y, v, f| {
            (f - c * v - k * y - k2 * y.powi(2) - k5 * y.powi(5)) / m
        });
        let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
        let parts = [1.5 * m, 2.0 * c, 1.4 * k].map(CoefficientSpec::constant);
        // Five steps per sample: the spring is up to ten times as stiff at the largest displacements.
        let builder = Builder::new(parts)
            .quadratic_stiffness(CoefficientSpec::constant(0.0))
            .quintic_stiffness(CoefficientSpec::constant(0.0))
            .nodes(14_996);
        let found = constants_are_found(builder, SPACING, &force, &exact, &truth, seed);
        for (found, truth) in found.iter().zip(truth) {
            assert!(
                (found / truth - 1.0).abs() < 0.05,
                "{seed}: {found} {truth}"
            );
        }
    }
}

/// A stop with play, from data of the independent integrator, whose corners are sharp: mass, damping, spring and stop within four standard
/// errors in five records (a probability of 1e-3 for all 20 together), and the stop within 1 %.
#[test]
fn a_stop_beyond_a_gap() {
    const SPACING: f64 = 0.02;
    const GAP: f64 = 0.3;
    let truth = [1.0, 0.4, 20.0, 60.0];
    let [m, c, k, stop] = truth;
    let gap_stiffness = CoefficientKind::named("gap_stiffness").unwrap();
    for seed in 0..5 {
        let force = broadband(white(seed, 1, 3000));
        let states = response(SPACING, [0.0, 0.0], &force, |_, y, v, f| {
            (f - c * v - k * y - stop * (y - y.clamp(-GAP, GAP))) / m
        });
        let exact: Vec<f64> = states.iter().map(|[y, ..]| *y).collect();
        let beyond = exact.iter().filter(|y| y.abs() > GAP).count();
        assert!(
            (300..2700).contains(&beyond),
            "in contact at {beyond} of 3000 samples"
        );
        let parts = [1.2 * m, 1.5 * c, 1.5 * k].map(CoefficientSpec::constant);
        let gap = CoefficientSpec::constant(30.0).width(GAP);
        // Ten steps per sample: the corners lie between nodes.
        let builder = Builder::new(parts)
            .coefficient(gap_stiffness, gap)
            .nodes(29_991);
        let found = constants_are_found(builder, SPACING, &force, &exact, &truth, seed);
        assert!((found[3] / stop - 1.0).abs() < 0.01);
    }
}
