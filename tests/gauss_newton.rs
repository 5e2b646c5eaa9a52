//! The steps of Gauss-Newton under simple bounds, against dense algebra.

mod common;

use common::synthetic::{settings, with_noise};
use kmcfit::constraints::RowGroup;
use kmcfit::dynamics::{Device, Method};
use kmcfit::functions::{CoefficientFunction, Prior, Quantity, Scalar, Value};
use kmcfit::objective::{Sensor, Weighting};
use kmcfit::problem::Problem;
use kmcfit::solvers::{Fit, FitSettings, Stopping, fit_from};
use nalgebra::{Matrix2, Vector2};

const NODES: usize = 101;
const SIZES: [f64; 2] = [0.5, 0.03];
const PRIOR: Prior = Prior {
    mean: 5.0,
    sigma: 0.5,
};

/// A known motion, read with an offset (m) and a drift (m/s) that are sought: the readings are linear in
/// both. The noise is as large, so that a step leaves half of the cost.
fn problem() -> Problem {
    let oscillator = common::oscillator(NODES, Method::Rk4);
    let device = Device {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.1; NODES], vec![1.0; NODES]],
    };
    let motion = oscillator.forward(&device, common::INITIAL, None).unwrap();
    let times = oscillator.grid.times();
    let drifted = motion.displacement.iter().zip(&times);
    let drifted: Vec<f64> = drifted.map(|(y, t)| y + 1.0 + 0.05 * t).collect();
    let observed = with_noise(&drifted, 1.0, 7);
    let list = vec![
        CoefficientFunction::fixed(Quantity::Mass, device.mass.clone()),
        CoefficientFunction::fixed(Quantity::Damping, device.coefficients[0].clone()),
        CoefficientFunction::fixed(Quantity::Stiffness, device.coefficients[1].clone()),
    ];
    let mut problem = common::problem_of(oscillator, list, observed, Some(1.0));
    let scalar = |size: f64| Scalar {
        name: "a number".into(),
        unit: String::new(),
        start: 0.0,
        size,
        prior: Some(PRIOR),
    };
    problem.functions = problem.functions.with_scalars(SIZES.map(scalar).to_vec());
    let channel = problem.experiments[0].channels.remove(0);
    assert_eq!(*channel.weighting(), Weighting::Sigma(1.0));
    let sensor = Sensor {
        offset: Value::Sought(0),
        drift: Value::Sought(1),
        ..Sensor::default()
    };
    let channel = channel.with_sensor(sensor);
    problem.experiments[0].channels.push(channel);
    problem
}

/// `J = |A theta - b|^2` with the rows `(1, t)` of A and the readings less the motion in b, and the priors.
struct Squares {
    matrix: Matrix2<f64>,
    right: Vector2<f64>,
    constant: f64,
}

impl Squares {
    fn of(problem: &Problem) -> Self {
        let silent = problem.evaluate(&[0.0, 0.0]).unwrap();
        let channel = &problem.experiments[0].channels[0];
        let mut squares = Self {
            matrix: Matrix2::zeros(),
            right: Vector2::zeros(),
            constant: 0.0,
        };
        let times = problem.oscillator.grid.times();
        for (r, t) in channel.residuals(&silent.predictions[0][0]).zip(times) {
            let row = Vector2::new(1.0, t);
            squares.matrix += row * row.transpose();
            squares.right -= row * r;
            squares.constant += r * r;
        }
        let weight = PRIOR.sigma.powi(-2);
        squares.matrix += Matrix2::identity() * weight;
        squares.right += Vector2::repeat(PRIOR.mean * weight);
        squares.constant += 2.0 * PRIOR.mean.powi(2) * weight;
        squares
    }

    fn cost(&self, theta: &Vector2<f64>) -> f64 {
        theta.dot(&(self.matrix * theta)) - 2.0 * self.right.dot(theta) + self.constant
    }

    /// A step from `theta` with `damping`, the offset at most `most`: the plain step with the offset
    /// clipped where that keeps nine tenths of the decrease, else the best step in the bound. And whether
    /// it is clipped.
    fn step(&self, theta: &Vector2<f64>, damping: f64, most: f64) -> (Vector2<f64>, bool) {
        let weight = damping * self.cost(theta);
        let near = Matrix2::from_diagonal(&Vector2::from(SIZES.map(|s| weight / (s * s))));
        let damped = self.matrix + near;
        let gradient = self.right - self.matrix * theta;
        let gain = |z: &Vector2<f64>| 2.0 * gradient.dot(z) - z.dot(&(damped * z));
        let plain = damped.try_inverse().unwrap() * gradient;
        let room = most - theta[0];
        if plain[0] <= room {
            return (theta + plain, false);
        }
        let clipped = Vector2::new(room, plain[1]);
        if gain(&clipped) >= 0.9 * gain(&plain) {
            return (theta + clipped, true);
        }
        let drift = (gradient[1] - damped[(1, 0)] * room) / damped[(1, 1)];
        (theta + Vector2::new(room, drift), false)
    }
}

fn after(problem: &Problem, iterations: u64) -> Fit {
    let settings = FitSettings {
        stopping: Stopping::exactly(iterations),
        ..settings()
    };
    fit_from(problem, &problem.start(), &settings).unwrap()
}

/// Offset and drift have a correlation of 0.87: clipping the offset costs four times as much as the bound
/// does. The model of linear readings comes true, so the damping falls to a tenth with every step.
#[test]
fn a_step_beyond_a_bound_is_clipped_or_is_the_best_in_it() {
    let free = problem();
    let squares = Squares::of(&free);
    let zero = Vector2::zeros();
    let (plain, _) = squares.step(&zero, 1e-2, f64::INFINITY);
    let decrease = squares.cost(&zero) - squares.cost(&plain);
    // What clipping costs, as a share of the decrease of the plain step.
    for (share, is_clipped, programs) in [(0.04, true, 0), (0.11, false, 0), (0.3, false, 1)] {
        let most = plain[0] - (share * decrease / squares.matrix[(0, 0)]).sqrt();
        assert!(most > 0.0);
        let mut bounded = free.clone();
        let mut group = RowGroup::new("offset");
        let first = bounded.functions.scalar_range().start;
        group.push([(first, 1.0)], [f64::NEG_INFINITY, most], [0.0, 0.0]);
        bounded.constraints.groups.push(group);
        let mut theta = zero;
        for iteration in 1..=3u64 {
            let damping = 0.1f64.powi(iteration as i32 + 1);
            let (next, clipped) = squares.step(&theta, damping, most);
            theta = next;
            let found = after(&bounded, iteration);
            if iteration == 1 {
                assert_eq!(clipped, is_clipped);
                assert_eq!(found.counts.qp, programs);
            }
            let off = (Vector2::from_row_slice(&found.best.parameters) - theta).norm();
            // Steps after the first may be solved by a quadratic program.
            let within = if found.counts.qp == 0 { 1e-12 } else { 1e-7 };
            println!("{share} {iteration} {off:.1e} {:?}", found.counts);
            assert!(off < within, "{share} {iteration}: {off}");
        }
    }
}
