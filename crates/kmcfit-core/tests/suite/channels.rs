//! The gradient of J with every kind of sample, term, excitation, sensor and loss, against dual
//! numbers through an independent evaluation.

use crate::common::properties::properties;
use crate::common::sensed::{Record, Response, cost};
use kmcfit_core::functions::{
    Basis, CoefficientFunction, Parameterization, Prior, ScalarParameter, ScalarValue,
};
use kmcfit_core::objective::{Evaluation, GradientKind};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Loss, Sensor, Weighting};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, InputSample, Method, StageSamples, State, System};
use num_dual::{Dual64, DualNum};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

const WIDTH: f64 = 0.3;
const TERMS: [(Response, Law, CoefficientKind); 8] = [
    (Response::Damping, Law::Damping, CoefficientKind::DAMPING),
    (
        Response::Stiffness,
        Law::Stiffness,
        CoefficientKind::STIFFNESS,
    ),
    (
        Response::QuadraticSpring,
        Law::QuadraticStiffness,
        CoefficientKind::QUADRATIC_STIFFNESS,
    ),
    (
        Response::Quintic,
        Law::QuinticStiffness,
        CoefficientKind::QUINTIC_STIFFNESS,
    ),
    (
        Response::Cubic,
        Law::CubicStiffness,
        CoefficientKind::CUBIC_STIFFNESS,
    ),
    (
        Response::Quadratic,
        Law::QuadraticDamping,
        CoefficientKind::QUADRATIC_DAMPING,
    ),
    (
        Response::Coulomb(WIDTH),
        Law::CoulombFriction { width: WIDTH },
        CoefficientKind::COULOMB_FRICTION,
    ),
    (Response::Offset, Law::Offset, CoefficientKind::STATIC_FORCE),
];
const LOSSES: [Loss; 3] = [
    Loss::Squares,
    Loss::Huber { threshold: 1.3 },
    Loss::StudentT { degrees: 4.0 },
];

/// One channel of a random record.
#[derive(Debug, Clone)]
struct ChannelSpec {
    kind: ChannelKind,
    /// Step and share of it.
    positions: Vec<(usize, f64)>,
    values: Vec<f64>,
    sigmas: Vec<f64>,
    around: Vec<(f64, f64)>,
    fixed_in_space: Vec<f64>,
    /// Gain, offset and drift, all estimated.
    sensor: [f64; 3],
    loss: Loss,
}

/// A random record with all kinds of samples, sensors and inputs.
#[derive(Debug, Clone)]
struct Case {
    method: Method,
    dt: f64,
    mass: Vec<f64>,
    coefficients: Vec<Vec<f64>>,
    force: Vec<[f64; 3]>,
    base: Vec<[f64; 3]>,
    initial: [f64; 2],
    channels: Vec<ChannelSpec>,
}

fn case(method: Method, nodes: usize, seed: u64) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut list = |n: usize, low: f64, high: f64| -> Vec<f64> {
        (0..n).map(|_| random.random_range(low..high)).collect()
    };
    let three = |list: Vec<f64>| -> Vec<[f64; 3]> {
        list.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
    };
    let steps = nodes - 1;
    let mass = list(nodes, 0.5, 3.0);
    let ranges = [
        (-0.5, 2.0),
        (-1.0, 5.0),
        (-0.5, 0.5),
        (-0.02, 0.05),
        (-0.5, 1.0),
        (-0.5, 1.0),
        (-1.0, 1.0),
        (-1.0, 1.0),
    ];
    let coefficients = ranges.iter().map(|(a, b)| list(nodes, *a, *b)).collect();
    // Separate values at the left end, middle and right end of each step: a force that jumps at every node.
    let force = three(list(3 * steps, -2.0, 2.0));
    let base = three(list(3 * steps, -2.0, 2.0));
    let initial = list(2, -1.5, 1.5);
    let channels = ChannelKind::ALL.into_iter().flat_map(|kind| [kind; 2]);
    let channels: Vec<ChannelKind> = channels.collect();
    let channels = (channels.into_iter().enumerate())
        .map(|(n, kind)| {
            let count = 2 + (seed as usize + n) % 7;
            let mut times = list(count, 0.0, steps as f64);
            // Some on nodes, the ends among them.
            times.extend([0.0, 1.0, steps as f64]);
            times.sort_by(f64::total_cmp);
            times.dedup();
            if (seed as usize + n).is_multiple_of(3) {
                // Or one sample at every node.
                times = (0..nodes).map(|i| i as f64).collect();
            }
            let position = |x: &f64| {
                let step = (x.floor() as usize).min(steps - 1);
                (step, x - step as f64)
            };
            let count = times.len();
            let around = list(2 * count, -2.0, 2.0);
            let sensor = list(3, 0.5, 1.5);
            ChannelSpec {
                kind,
                positions: times.iter().map(position).collect(),
                values: list(count, -2.0, 2.0),
                sigmas: list(count, 0.3, 2.0),
                around: around.chunks_exact(2).map(|c| (c[0], c[1])).collect(),
                fixed_in_space: list(count, -1.0, 1.0),
                sensor: [sensor[0], sensor[1], sensor[2]],
                loss: LOSSES[(seed as usize + n) % LOSSES.len()],
            }
        })
        .collect();
    Case {
        method,
        dt: 0.1,
        mass,
        coefficients,
        force,
        base,
        initial: [initial[0], initial[1]],
        channels,
    }
}

const PRIOR: Prior = Prior {
    mean: 0.3,
    sigma: 0.7,
};

impl Case {
    fn nodes(&self) -> usize {
        self.mass.len()
    }

    /// All parameters: functions, initial state, sensors.
    fn theta(&self) -> Vec<f64> {
        let mut theta = self.mass.clone();
        theta.extend(self.coefficients.iter().flatten());
        theta.extend(self.initial);
        theta.extend(self.channels.iter().flat_map(|c| c.sensor));
        theta
    }

    fn problem(&self) -> Problem {
        let nodes = self.nodes();
        let grid = Grid::new(0.0, self.dt * (nodes - 1) as f64, nodes).unwrap();
        let mut list = vec![CoefficientFunction::nodal(
            CoefficientKind::MASS,
            self.mass.clone(),
        )];
        for ((_, _, quantity), values) in TERMS.iter().zip(&self.coefficients) {
            list.push(CoefficientFunction::nodal(*quantity, values.clone()));
        }
        let theta = self.theta();
        let scalars: Vec<ScalarParameter> = theta[nodes * (1 + TERMS.len())..]
            .iter()
            .enumerate()
            .map(|(i, start)| ScalarParameter {
                name: format!("scalar {i}"),
                unit: String::new(),
                start: *start,
                size: 1.0,
                prior: (i == 1).then_some(PRIOR),
            })
            .collect();
        let functions = Parameterization::new(list, nodes, grid.step())
            .unwrap()
            .with_scalars(scalars);
        let initial = State::one(self.initial[0], self.initial[1]);
        let mut experiment =
            Experiment::free("all", initial, nodes).with_excitation(Excitation::one(
                Some(StageSamples::new(self.force.clone())),
                Some(StageSamples::new(self.base.clone())),
            ));
        experiment.initial_parameters = vec![Some(0), Some(1)];
        for (n, samples) in self.channels.iter().enumerate() {
            let time = |(i, x): &(usize, f64)| (*i as f64 + x) * grid.step();
            let times = samples.positions.iter().map(time).collect();
            let weighting = Weighting::Sigmas(samples.sigmas.clone());
            let around = samples.around.iter().map(|(force, base)| InputSample {
                force: *force,
                base: *base,
            });
            let first = 2 + 3 * n;
            let channel = Channel::new(
                samples.kind,
                times,
                samples.values.clone(),
                weighting,
                &grid,
                nodes,
            );
            let channel = channel
                .unwrap()
                .with_inputs_at_samples(around.collect())
                .with_base(samples.fixed_in_space.clone())
                .with_loss(samples.loss)
                .with_sensor(Sensor {
                    gain: ScalarValue::Estimated(first),
                    offset: ScalarValue::Estimated(first + 1),
                    drift: ScalarValue::Estimated(first + 2),
                    ..Sensor::default()
                });
            experiment = experiment.with_channel(channel);
        }
        let system = System {
            grid,
            method: self.method,
            structure: Structure::one(TERMS.iter().map(|(_, term, _)| *term).collect()),
        };
        Problem::new(system, functions, vec![experiment]).unwrap()
    }

    /// J and its derivative with respect to parameter `seed`, by the independent evaluation.
    fn reference(&self, theta: &[f64], seed: usize) -> Dual64 {
        let dual = |(i, x): (usize, &f64)| Dual64::new(*x, f64::from(i == seed));
        let theta: Vec<Dual64> = theta.iter().enumerate().map(dual).collect();
        let nodes = self.nodes();
        let mut parts = theta.chunks_exact(nodes);
        let mass = parts.next().unwrap().to_vec();
        let terms = TERMS
            .iter()
            .map(|(response, ..)| (*response, parts.next().unwrap().to_vec()))
            .collect();
        let rest = &theta[nodes * (1 + TERMS.len())..];
        let record = Record {
            method: self.method,
            dt: self.dt,
            mass,
            terms,
            force: self.force.clone(),
            base: self.base.clone(),
            initial: (rest[0], rest[1]),
        };
        let states = record.response();
        let mut sum = ((rest[1] - PRIOR.mean) / PRIOR.sigma).powi(2);
        for (n, samples) in self.channels.iter().enumerate() {
            let [gain, offset, drift] = [0, 1, 2].map(|k| rest[2 + 3 * n + k]);
            let time = |(i, x): (usize, f64)| (i as f64 + x) * self.dt;
            for (i, &position) in samples.positions.iter().enumerate() {
                let seen = record.seen(samples.kind, &states, position, samples.around[i])
                    + samples.fixed_in_space[i];
                let age = time(position) - time(samples.positions[0]);
                let model = gain * seen + offset + drift * age;
                sum += cost(
                    samples.loss,
                    (model - samples.values[i]) / samples.sigmas[i],
                );
            }
        }
        sum
    }
}

/// Methods, lengths and seeds.
fn cases() -> impl Strategy<Value = Case> {
    let methods = prop_oneof![Just(Method::Midpoint), Just(Method::Rk4)];
    (methods, 4usize..14, any::<u64>()).prop_map(|(method, nodes, seed)| case(method, nodes, seed))
}

proptest! {
    #![proptest_config(properties(60, 1))]

    #[test]
    fn the_gradient_is_the_derivative_by_dual_numbers(case in cases()) {
        let (problem, theta) = (case.problem(), case.theta());
        let evaluation = problem.evaluate(&theta).unwrap();
        let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete).euclidean;
        let cost = case.reference(&theta, usize::MAX).re;
        prop_assert!((evaluation.cost - cost).abs() <= 1e-12 * cost, "{} {cost}", evaluation.cost);
        let largest = gradient.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        for (seed, g) in gradient.iter().enumerate() {
            let exact = case.reference(&theta, seed).eps;
            prop_assert!((g - exact).abs() <= 1e-11 * largest, "{seed}: {g} is not {exact}");
        }
    }

    #[test]
    fn the_tangent_of_the_predictions_is_their_derivative(case in cases(), seed in any::<u64>()) {
        let (problem, theta) = (case.problem(), case.theta());
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let along: Vec<f64> = theta.iter().map(|_| random.random_range(-1.0..1.0)).collect();
        let evaluation = problem.evaluate(&theta).unwrap();
        let change = problem.predictions_tangent(&evaluation, &along);
        // Transposed: the gradient of a weighted sum of predictions, by the adjoint.
        let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete).euclidean;
        let slope: f64 = gradient.iter().zip(&along).map(|(g, d)| g * d).sum();
        let experiment = &problem.experiments[0];
        let mut expected = 2.0 * (theta[index_of_prior(&problem)] - PRIOR.mean) / PRIOR.sigma.powi(2)
            * along[index_of_prior(&problem)];
        let mut size = expected.abs();
        let channels = experiment.channels.iter().zip(&evaluation.predictions[0]);
        for ((channel, predicted), change) in channels.zip(&change[0]) {
            for (s, d) in channel.slopes(predicted).iter().zip(change) {
                expected += s * d;
                size += (s * d).abs();
            }
        }
        prop_assert!((slope - expected).abs() <= 1e-11 * size, "{slope} is not {expected}");
    }
}

proptest! {
    #![proptest_config(properties(60, 2))]

    /// Several directions at once against one at a time; records longer than a tile among them.
    #[test]
    fn the_jacobian_of_the_predictions_is_that_of_single_tangents(
        methods in prop_oneof![Just(Method::Midpoint), Just(Method::Rk4)],
        nodes in prop_oneof![4usize..14, 60..70usize],
        seed in any::<u64>(),
    ) {
        let case = case(methods, nodes, seed);
        let (problem, theta) = (case.problem(), case.theta());
        let evaluation = problem.evaluate(&theta).unwrap();
        jacobian_is_that_of_single_tangents(&problem, &evaluation)?;
    }
}

fn jacobian_is_that_of_single_tangents(
    problem: &Problem,
    evaluation: &Evaluation,
) -> Result<(), TestCaseError> {
    let jacobian = problem.predictions_jacobian(evaluation);
    let mut unit = vec![0.0; problem.parameters()];
    for (j, found) in jacobian.column_iter().enumerate() {
        unit[j] = 1.0;
        let change = problem.predictions_tangent(evaluation, &unit);
        unit[j] = 0.0;
        let column: Vec<f64> = change.into_iter().flatten().flatten().collect();
        let size = column.iter().fold(0.0f64, |m, c| m.max(c.abs()));
        prop_assert_eq!(found.len(), column.len());
        for (a, b) in found.iter().zip(&column) {
            prop_assert!((a - b).abs() <= 1e-12 * size, "{j}: {a} is not {b}");
        }
    }
    // Transposed, by one adjoint solve.
    let slopes: Vec<f64> = (0..jacobian.nrows())
        .map(|i| (1.7 * i as f64).sin())
        .collect();
    let transposed = problem.predictions_transpose(evaluation, &slopes);
    prop_assert_eq!(transposed.len(), jacobian.ncols());
    for (j, (found, column)) in transposed.iter().zip(jacobian.column_iter()).enumerate() {
        let terms = || column.iter().zip(&slopes).map(|(d, s)| d * s);
        let (expected, size) = (terms().sum::<f64>(), terms().map(f64::abs).sum::<f64>());
        prop_assert!(
            (found - expected).abs() <= 1e-11 * size,
            "{j}: {found} is not {expected}"
        );
    }
    Ok(())
}

/// The same with constants and, if `with_knots`, knots in place of one value a node.
fn on_few_parameters(problem: &Problem, with_knots: bool) -> Problem {
    let grid = problem.system.grid;
    let knots = Basis::PiecewiseLinear {
        knots: (0..3)
            .map(|i| 0.5 * f64::from(i) * grid.duration())
            .collect(),
    };
    let list = problem.functions.iter().enumerate().map(|(i, nodal)| {
        // No term that makes the response unbounded.
        let start = nodal.start[0].abs();
        match i % 3 {
            1 if with_knots => {
                CoefficientFunction::free(nodal.quantity, knots.clone(), &grid, vec![start; 3])
            }
            2 => CoefficientFunction {
                offset: Arc::new(nodal.start.iter().map(|x| x.abs()).collect()),
                ..CoefficientFunction::constant(nodal.quantity, start, grid.nodes())
            },
            _ => CoefficientFunction::constant(nodal.quantity, start, grid.nodes()),
        }
    });
    let functions = Parameterization::new(list.collect(), grid.nodes(), grid.step()).unwrap();
    let functions = functions.with_scalars(problem.functions.scalars().to_vec());
    problem
        .clone()
        .with(|parts| parts.functions = functions)
        .unwrap()
}

proptest! {
    #![proptest_config(properties(60, 3))]

    /// Constant functions have a specialised algorithm: compared with values at the nodes and a design matrix, and with one direction
    /// at a time.
    #[test]
    fn few_parameters_have_the_tangents_of_nodal_values(
        methods in prop_oneof![Just(Method::Midpoint), Just(Method::Rk4)],
        nodes in prop_oneof![4usize..14, 60..70usize],
        seed in any::<u64>(),
        with_knots in any::<bool>(),
    ) {
        let nodal = case(methods, nodes, seed).problem();
        let problem = on_few_parameters(&nodal, with_knots);
        let theta = problem.start();
        let evaluation = problem.evaluate(&theta).unwrap();
        jacobian_is_that_of_single_tangents(&problem, &evaluation)?;
        let mut unit = vec![0.0; theta.len()];
        let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete).euclidean;
        let mut values = problem.functions.values(&theta).concat();
        values.extend(problem.scalars(&theta));
        let at_nodes = nodal.evaluate(&values).unwrap();
        prop_assert!((evaluation.cost - at_nodes.cost).abs() <= 1e-13 * at_nodes.cost);
        let by_values = nodal.gradient(&values, &at_nodes, GradientKind::Discrete).euclidean;
        let largest = by_values.iter().fold(0.0f64, |m, g| m.max(g.abs())) * nodes as f64;
        for j in 0..theta.len() {
            unit[j] = 1.0;
            let mut along = problem.functions.direction(&unit, 0).functions().map(<[f64]>::to_vec).collect::<Vec<_>>().concat();
            along.extend(problem.scalars(&unit));
            unit[j] = 0.0;
            let expected: f64 = by_values.iter().zip(&along).map(|(g, d)| g * d).sum();
            prop_assert!((gradient[j] - expected).abs() <= 1e-13 * largest, "{j}: {} is not {expected}", gradient[j]);
        }
    }
}

fn index_of_prior(problem: &Problem) -> usize {
    problem.functions.scalar_range().start + 1
}

/// The responses are far apart, so that the difference of two rounded costs is exact enough.
#[test]
fn the_difference_of_costs_is_that_of_both_costs() {
    let grid = Grid::new(0.0, 1.0, 9).unwrap();
    let observed: Vec<f64> = (0..9).map(|i| (1.3 * f64::from(i)).sin()).collect();
    let [from, to] = [0.7, 2.9].map(|w| -> Vec<f64> {
        let off = |(i, y): (usize, &f64)| y + (w * i as f64).cos();
        observed.iter().enumerate().map(off).collect()
    });
    let sigmas: Vec<f64> = (0..9).map(|i| 0.2 + 0.05 * f64::from(i)).collect();
    for weighting in [Weighting::Sigma(0.3), Weighting::Sigmas(sigmas)] {
        for loss in LOSSES {
            let kind = ChannelKind::Displacement;
            let samples = observed.clone();
            let channel = Channel::new(kind, grid.times(), samples, weighting.clone(), &grid, 9);
            let channel = channel.unwrap().with_loss(loss);
            let expected = channel.cost(&to) - channel.cost(&from);
            let found = channel.cost_difference(&from, &to);
            let size = channel.cost(&to) + channel.cost(&from);
            assert!(expected.abs() > 1e-3 * size);
            assert!((found - expected).abs() < 1e-13 * size, "{loss:?}: {found}");
        }
    }
}
