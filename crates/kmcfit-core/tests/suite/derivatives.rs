//! Derivatives against dual numbers, dot products and Taylor remainders.

use crate::common;

use crate::common::properties::properties;
use crate::common::reference::{Inputs, response};
use kmcfit_core::objective::{Evaluation, GradientKind};
use kmcfit_core::problem::Problem;
use kmcfit_core::step::{Driven, Trajectory, continuous_adjoint};
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, Method, NodalCoefficients, State, System, SystemTangent, trapezoid_weights,
};
use num_dual::{Dual64, DualNum};
use proptest::prelude::*;

/// The discrete adjoint as fits compute it.
fn discrete_adjoint(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    response: &Trajectory,
    source: &Trajectory,
) -> SystemTangent {
    let driven = Driven {
        system,
        nodal,
        excitation,
    };
    driven.nodal_adjoint(response, source)
}

/// A random system with a random force, initial state and cost weights.
#[derive(Debug, Clone)]
struct Case {
    method: Method,
    nodal: NodalCoefficients,
    force: Vec<f64>,
    initial: State,
    /// Weight and target of displacement and velocity at each node.
    weights: Vec<[f64; 4]>,
}

impl Case {
    fn system(&self) -> System {
        let nodes = self.force.len();
        System {
            grid: Grid::new(0.0, 0.1 * (nodes - 1) as f64, nodes).unwrap(),
            method: self.method,
            structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
        }
    }

    /// `sum a (y - b)^2 + c (v - d)^2`, by the independent solve.
    fn cost<D: DualNum<Primitive = f64> + Copy>(&self, inputs: &Inputs<D>, y0: D, v0: D) -> D {
        let states = response(self.method, inputs, (y0, v0), self.system().grid.step());
        let terms = states.iter().zip(&self.weights);
        terms.fold(D::from(0.0), |sum, ((y, v), [a, b, c, d])| {
            sum + (*y - *b).powi(2) * *a + (*v - *d).powi(2) * *c
        })
    }

    fn source(&self, response: &Trajectory) -> Trajectory {
        let pair = |i: usize| {
            let [a, b, c, d] = self.weights[i];
            (
                2.0 * a * (response.displacement(0)[i] - b),
                2.0 * c * (response.velocity(0)[i] - d),
            )
        };
        let (displacement, velocity): (Vec<f64>, Vec<f64>) =
            (0..self.weights.len()).map(pair).unzip();
        Trajectory::of_columns(&[&displacement, &velocity])
    }

    fn adjoint_gradient(&self) -> SystemTangent {
        let system = self.system();
        let excitation = Excitation::force_at_nodes(&self.force);
        let force = Some(&excitation);
        let response = system.forward(&self.nodal, &self.initial, force).unwrap();
        let source = self.source(&response);
        discrete_adjoint(&system, &self.nodal, force, &response, &source)
    }

    /// The derivative with respect to input `seed`: the functions' nodes in order, then y0, v0.
    fn dual_derivative(&self, seed: usize) -> f64 {
        let mut count = 0;
        let mut dual = |x: &f64| {
            let eps = if count == seed { 1.0 } else { 0.0 };
            count += 1;
            Dual64::new(*x, eps)
        };
        let inputs = Inputs {
            mass: self.nodal.inertias[0].iter().map(&mut dual).collect(),
            damping: self.nodal.coefficients[0].iter().map(&mut dual).collect(),
            stiffness: self.nodal.coefficients[1].iter().map(&mut dual).collect(),
            force: self.force.iter().map(|f| Dual64::from(*f)).collect(),
        };
        let y0 = dual(&self.initial.displacement(0));
        let v0 = dual(&self.initial.velocity(0));
        self.cost(&inputs, y0, v0).eps
    }
}

fn flatten(gradient: &SystemTangent) -> Vec<f64> {
    let mut flat: Vec<f64> = gradient.nodal.functions().flatten().copied().collect();
    flat.extend([
        gradient.initial.displacement(0),
        gradient.initial.velocity(0),
    ]);
    flat
}

fn case() -> impl Strategy<Value = Case> {
    let methods = prop_oneof![Just(Method::Midpoint), Just(Method::Rk4)];
    (methods, 3usize..30).prop_flat_map(|(method, nodes)| {
        let values = |low: f64, high: f64| prop::collection::vec(low..high, nodes);
        let weights = prop::collection::vec(prop::array::uniform4(-1.0..1.0f64), nodes);
        (
            values(0.5, 3.0),
            values(-0.5, 2.0),
            values(-1.0, 5.0),
            values(-2.0, 2.0),
            (-3.0..3.0f64, -3.0..3.0f64),
            weights,
        )
            .prop_map(move |(mass, c, k, force, (y0, v0), weights)| Case {
                method,
                nodal: NodalCoefficients {
                    inertias: vec![mass],
                    coefficients: vec![c, k],
                },
                force,
                initial: State::one(y0, v0),
                weights,
            })
    })
}

proptest! {
    #![proptest_config(properties(200, 1))]

    #[test]
    fn the_discrete_gradient_is_the_derivative_by_dual_numbers(case in case()) {
        let gradient = flatten(&case.adjoint_gradient());
        let largest = gradient.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        for (seed, g) in gradient.iter().enumerate() {
            let exact = case.dual_derivative(seed);
            prop_assert!((g - exact).abs() <= 1e-12 * largest, "{seed}: {g} is not {exact}");
        }
    }

    #[test]
    fn the_adjoint_is_the_transpose_of_the_tangent(case in case(), other in case()) {
        let system = case.system();
        let excitation = Excitation::force_at_nodes(&case.force);
        let force = Some(&excitation);
        let response = system.forward(&case.nodal, &case.initial, force).unwrap();
        // A direction and weights of the right length, taken from an unrelated case.
        let cut = |f: &[f64]| -> Vec<f64> {
            f.iter().cycle().take(case.force.len()).copied().collect()
        };
        let direction = SystemTangent {
            nodal: NodalCoefficients {
                inertias: vec![cut(&other.nodal.coefficients[0])],
                coefficients: vec![cut(&other.nodal.inertias[0]), cut(&other.force)],
            },
            initial: other.initial,
        };
        let weights =
            Trajectory::of_columns(&[&cut(&other.force), &cut(&other.nodal.coefficients[1])]);
        let driven = Driven {
            system: &system,
            nodal: &case.nodal,
            excitation: force,
        };
        let forward = driven.tangent(&response, &direction);
        let backward = discrete_adjoint(&system, &case.nodal, force, &response, &weights);
        let all = |t: &Trajectory| [t.displacement(0), t.velocity(0)].concat();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (ju, w) = (all(&forward), all(&weights));
        let left = dot(&ju, &w);
        let right = dot(&flatten(&direction), &flatten(&backward));
        let scale = (dot(&ju, &ju) * dot(&w, &w)).sqrt();
        prop_assert!((left - right).abs() <= 1e-13 * scale, "{left} is not {right}, scale {scale}");
    }

    #[test]
    fn the_forward_solve_is_the_textbook_one(case in case()) {
        let system = case.system();
        let ours = system
            .forward(&case.nodal, &case.initial, Some(&Excitation::force_at_nodes(&case.force)))
            .unwrap();
        let inputs = Inputs {
            mass: case.nodal.inertias[0].clone(),
            damping: case.nodal.coefficients[0].clone(),
            stiffness: case.nodal.coefficients[1].clone(),
            force: case.force.clone(),
        };
        let start = (case.initial.displacement(0), case.initial.velocity(0));
        let other = response(case.method, &inputs, start, system.grid.step());
        let largest = other.iter().fold(0.0f64, |m, s| m.max(s.0.abs()).max(s.1.abs()));
        for (i, (y, v)) in other.iter().enumerate() {
            prop_assert!((ours.displacement(0)[i] - y).abs() <= 1e-13 * largest);
            prop_assert!((ours.velocity(0)[i] - v).abs() <= 1e-13 * largest);
        }
    }
}

#[test]
fn taylor_remainders_of_the_discrete_gradient_fall_with_the_square_of_the_step() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let theta = problem.functions.start();
    let direction: Vec<f64> = (0..theta.len()).map(|i| (0.01 * i as f64).sin()).collect();
    let steps: Vec<f64> = (0..8).map(|i| 1e-2 * 0.5f64.powi(i)).collect();
    let here = problem.evaluate(&theta).unwrap();
    let gradient = problem.gradient(&theta, &here, GradientKind::Discrete);
    let products = gradient
        .euclidean
        .iter()
        .zip(&direction)
        .map(|(g, d)| g * d);
    let slope: f64 = products.sum();
    let remainder = |step: &f64| {
        let moved = theta.iter().zip(&direction).map(|(p, d)| p + step * d);
        let there = problem.evaluate(&moved.collect::<Vec<f64>>()).unwrap();
        (cost_difference(&problem, &here, &there) - step * slope).abs()
    };
    let remainders: Vec<f64> = steps.iter().map(remainder).collect();
    let rates: Vec<f64> = remainders
        .windows(2)
        .map(|w| (w[0] / w[1]).log2())
        .collect();
    // The next order of the expansion shows at the longest step and halves with every step.
    for (i, rate) in rates.iter().enumerate() {
        assert!(
            (rate - 2.0).abs() < 0.1 * 0.5f64.powi(i as i32) + 0.01,
            "{rates:?}"
        );
    }
}

/// `J(to) - J(from)` from the residuals, without cancellation.
fn cost_difference(problem: &Problem, from: &Evaluation, to: &Evaluation) -> f64 {
    let channels = problem.channels().zip(from.predictions.iter().flatten());
    let misfit: f64 = channels
        .zip(to.predictions.iter().flatten())
        .map(|((channel, from), to)| channel.cost_difference(from, to))
        .sum();
    misfit + (to.regularisation - from.regularisation)
}

/// Fig. 2 of the paper along the gradient at the start (2, 1, 1).
fn figure_2(nodes: usize, kind: GradientKind, step: f64) -> f64 {
    let problem = common::paper_problem(nodes, [2.0, 1.0, 1.0]);
    let theta = problem.functions.start();
    let here = problem.evaluate(&theta).unwrap();
    let gradient = problem.gradient(&theta, &here, kind);
    let moved = theta.iter().zip(&gradient.l2).map(|(p, g)| p - step * g);
    let there = problem.evaluate(&moved.collect::<Vec<f64>>()).unwrap();
    let slope = cost_difference(&problem, &here, &there) / step;
    (slope + gradient.norm_squared).abs() / gradient.norm_squared
}

#[test]
fn the_error_of_the_discrete_gradient_falls_in_proportion_to_the_step() {
    for nodes in [1000, 2000, 4000, 8000, 16_000] {
        for exponent in -8..=-4 {
            let step = 10f64.powi(exponent);
            let error = figure_2(nodes, GradientKind::Discrete, step);
            let expected = 9.5 * step;
            assert!(
                (error / expected - 1.0).abs() < 0.2,
                "N = {nodes}, a = {step}: {error}"
            );
        }
        assert!(figure_2(nodes, GradientKind::Discrete, 1e-8) <= 1.2e-7);
    }
}

#[test]
fn the_error_of_the_continuous_gradient_has_the_floors_of_the_paper() {
    // The floors of Fig. 2 are known to one digit, read where the steps are shortest.
    let floors = [(1000, 2e-5), (2000, 4e-6), (4000, 8e-7), (8000, 2e-7)];
    for (nodes, floor) in floors {
        let error = figure_2(nodes, GradientKind::Continuous, 1e-8);
        assert!((error / floor - 1.0).abs() < 0.3, "N = {nodes}: {error}");
    }
}

/// Difference of the two gradients at (2, 1, 1): the largest and the root mean square over the
/// nodes, relative to the largest value; and the floor of Fig. 2, `|<dJ, g> - G^2| / G^2` with the
/// exact derivative dJ and the continuous gradient g.
fn difference_of_gradients(nodes: usize) -> [f64; 3] {
    let problem = common::paper_problem(nodes, [2.0, 1.0, 1.0]);
    let here = problem.evaluate(&problem.functions.start()).unwrap();
    let discrete = problem.gradient(&problem.functions.start(), &here, GradientKind::Discrete);
    let continuous = problem.gradient(&problem.functions.start(), &here, GradientKind::Continuous);
    let largest = discrete.l2.iter().fold(0.0f64, |m, g| m.max(g.abs()));
    let pairs = || discrete.l2.iter().zip(&continuous.l2);
    let most = pairs().fold(0.0f64, |m, (d, c)| m.max((d - c).abs()));
    let mean_square = pairs().map(|(d, c)| (d - c).powi(2)).sum::<f64>() / discrete.l2.len() as f64;
    let exact: f64 = (discrete.euclidean.iter().zip(&continuous.l2))
        .map(|(d, c)| d * c)
        .sum();
    [
        most / largest,
        mean_square.sqrt() / largest,
        (exact / continuous.norm_squared - 1.0).abs(),
    ]
}

/// Order 1 at the worst node, an end, where the paper's differences are one-sided; so order 3/2 in
/// the mean square, as a few nodes carry it; and order 2 in the directional derivative.
#[test]
fn the_continuous_gradient_converges_to_the_discrete_one() {
    let errors = [1000, 2000, 4000, 8000].map(difference_of_gradients);
    for pair in errors.windows(2) {
        for (i, expected) in [1.0, 1.5, 2.0].into_iter().enumerate() {
            let order = (pair[0][i] / pair[1][i]).log2();
            assert!((order - expected).abs() < 0.1, "{errors:?}");
        }
    }
}

/// Gradients with respect to the initial state, continuous and discrete, of a system with initial mass other than 1, nonzero
/// damping, and not at rest; with cubic stiffness and quadratic damping if asked for.
fn initial_gradients(nodes: usize, is_nonlinear: bool) -> [State; 2] {
    let mut system = common::system(nodes, Method::Midpoint);
    let times = system.grid.times();
    let of = |f: fn(f64) -> f64| -> Vec<f64> { times.iter().map(|t| f(*t)).collect() };
    let mut nodal = NodalCoefficients {
        inertias: vec![of(|t| 2.5 + 0.4 * (0.5 * t).sin())],
        coefficients: vec![of(|t| 0.3 + 0.01 * t), of(|t| 1.5 - 0.2 * (0.3 * t).cos())],
    };
    if is_nonlinear {
        let laws = [system.laws(), &[Law::CubicStiffness, Law::QuadraticDamping]].concat();
        system.structure = Structure::one(laws);
        nodal
            .coefficients
            .push(of(|t| 0.2 + 0.05 * (0.4 * t).sin()));
        nodal.coefficients.push(of(|t| 0.02 + 0.001 * t));
    }
    let response = system.forward(&nodal, &common::initial(), None).unwrap();
    let observed = of(|t| (0.7 * t).cos());
    let weights = trapezoid_weights(nodes, system.grid.step());
    let pairs = response.displacement(0).iter().zip(&observed);
    let slopes = (pairs.zip(weights)).map(|((y, o), w)| 2.0 * w * (y - o));
    let source = Trajectory::of_columns(&[&slopes.collect::<Vec<f64>>(), &vec![0.0; nodes]]);
    [
        continuous_adjoint(&system, &nodal, None, &response, &observed).initial,
        discrete_adjoint(&system, &nodal, None, &response, &source).initial,
    ]
}

/// Of order 2, as the stepper.
fn assert_initial_gradients_converge(is_nonlinear: bool, limit: f64) {
    let errors = [2000, 4000, 8000].map(|nodes| {
        let [found, exact] = initial_gradients(nodes, is_nonlinear);
        [
            (found.displacement(0) / exact.displacement(0) - 1.0).abs(),
            (found.velocity(0) / exact.velocity(0) - 1.0).abs(),
        ]
    });
    for which in [0, 1] {
        for pair in errors.windows(2) {
            assert!(pair[1][which] < 0.3 * pair[0][which], "{errors:?}");
        }
        assert!(errors[2][which] < limit, "{errors:?}");
    }
}

#[test]
fn the_continuous_gradient_of_the_initial_state_converges_to_the_discrete_one() {
    assert_initial_gradients_converge(false, 1e-5);
}

#[test]
fn the_continuous_gradient_of_a_nonlinear_system_converges_to_the_discrete_one() {
    // The cubic stiffness raises the frequency at the start by half, so the steps are longer by comparison.
    assert_initial_gradients_converge(true, 3e-5);
}
