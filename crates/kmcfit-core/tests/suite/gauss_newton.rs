//! The steps of Gauss-Newton under simple bounds, against dense algebra.

use crate::common;

use crate::common::synthetic::{settings, with_noise};
use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{CoefficientFunction, Prior, ScalarParameter, ScalarValue};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Sensor, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, Stopping, fit_from};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};
use nalgebra::{Matrix2, Vector2};

const NODES: usize = 101;
const SIZES: [f64; 2] = [0.5, 0.03];
const PRIOR: Prior = Prior {
    mean: 5.0,
    sigma: 0.5,
};

/// Units of a problem.
#[derive(Debug, Clone, Copy)]
struct Units {
    /// One metre.
    length: f64,
    /// Factor of the sigmas of samples and priors; J is divided by its square.
    sigma: f64,
}

const PLAIN: Units = Units {
    length: 1.0,
    sigma: 1.0,
};

/// A known response, measured with an offset (m) and a drift (m/s) that are estimated: the samples are linear in
/// both. The noise is as large, so that a step leaves half of the cost.
fn problem(units: Units) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let nodal = NodalCoefficients {
        inertias: vec![vec![1.0; NODES]],
        coefficients: vec![vec![0.1; NODES], vec![1.0; NODES]],
    };
    let response = system.forward(&nodal, &common::initial(), None).unwrap();
    let times = system.grid.times();
    let drifted = response.displacement(0).iter().zip(&times);
    let drifted: Vec<f64> = drifted.map(|(y, t)| y + 1.0 + 0.05 * t).collect();
    let observed = with_noise(&drifted, 1.0, 7)
        .iter()
        .map(|y| units.length * y)
        .collect();
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::MASS, nodal.inertias[0].clone()),
        CoefficientFunction::fixed(CoefficientKind::DAMPING, nodal.coefficients[0].clone()),
        CoefficientFunction::fixed(CoefficientKind::STIFFNESS, nodal.coefficients[1].clone()),
    ];
    let sigma = units.length * units.sigma;
    let mut problem = common::problem_of(system, list, observed, Some(sigma));
    let scalar = |size: f64| ScalarParameter {
        name: "a number".into(),
        unit: String::new(),
        start: 0.0,
        size: units.length * size,
        prior: Some(Prior {
            mean: units.length * PRIOR.mean,
            sigma: sigma * PRIOR.sigma,
        }),
    };
    problem = problem
        .with(|parts| {
            parts.functions = parts
                .functions
                .clone()
                .with_scalars(SIZES.map(scalar).to_vec());
        })
        .unwrap();
    let channel = problem.experiments[0].channels[0].clone();
    assert_eq!(*channel.weighting(), Weighting::Sigma(sigma));
    let sensor = Sensor {
        gain: ScalarValue::Known(units.length),
        offset: ScalarValue::Estimated(0),
        drift: ScalarValue::Estimated(1),
        ..Sensor::default()
    };
    let channel = channel.with_sensor(sensor);
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels[0] = channel;
        })
        .unwrap();
    problem
}

/// `J = |A theta - b|^2` with the rows `(1, t)` of A and the samples less the response in b, and the priors.
struct Squares {
    matrix: Matrix2<f64>,
    right: Vector2<f64>,
    constant: f64,
    sizes: [f64; 2],
}

impl Squares {
    fn of(problem: &Problem) -> Self {
        let silent = problem.evaluate(&[0.0, 0.0]).unwrap();
        let channel = &problem.experiments[0].channels[0];
        let mut squares = Self {
            matrix: Matrix2::zeros(),
            right: Vector2::zeros(),
            constant: 0.0,
            sizes: SIZES,
        };
        let times = problem.system.grid.times();
        let sigma = channel.weighting().sigma(0).unwrap();
        for (r, t) in channel.residuals(&silent.predictions[0][0]).zip(times) {
            let (row, r) = (Vector2::new(1.0, t) / sigma, r / sigma);
            squares.matrix += row * row.transpose();
            squares.right -= row * r;
            squares.constant += r * r;
        }
        for (j, scalar) in problem.functions.scalars().iter().enumerate() {
            let prior = scalar.prior.unwrap();
            let weight = prior.sigma.powi(-2);
            squares.matrix[(j, j)] += weight;
            squares.right[j] += prior.mean * weight;
            squares.constant += prior.mean.powi(2) * weight;
            squares.sizes[j] = scalar.size;
        }
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
        let near = Matrix2::from_diagonal(&Vector2::from(self.sizes.map(|s| weight / (s * s))));
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

/// Three steps of the free problem with the offset held below a bound: clipping it costs `share` of the
/// decrease of the first plain step. The linear model is exact, so the damping falls to a
/// tenth with every step.
fn check(units: Units, share: f64, is_clipped: bool, programs: u64) {
    let mut bounded = problem(units);
    let squares = Squares::of(&bounded);
    let mut theta = Vector2::zeros();
    let (plain, _) = squares.step(&theta, 1e-2, f64::INFINITY);
    let decrease = squares.cost(&theta) - squares.cost(&plain);
    let most = plain[0] - (share * decrease / squares.matrix[(0, 0)]).sqrt();
    assert!(most > 0.0);
    let mut group = RowGroup::new("offset");
    let first = bounded.functions.scalar_range().start;
    group.push([(first, 1.0)], [f64::NEG_INFINITY, most], [0.0, 0.0]);
    bounded = bounded
        .with(|parts| {
            parts.constraints.groups.push(group);
        })
        .unwrap();
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
        let off = off / units.length;
        // Steps after the first may be solved by a quadratic program.
        let within = if found.counts.qp == 0 { 1e-12 } else { 1e-7 };
        println!("{units:?} {share} {iteration} {off:.1e} {:?}", found.counts);
        assert!(off < within, "{units:?} {share} {iteration}: {off}");
    }
}

/// Offset and drift have a correlation of 0.87: clipping the offset costs four times as much as the bound
/// does.
#[test]
fn a_step_beyond_a_bound_is_clipped_or_is_the_best_in_it() {
    check(PLAIN, 0.04, true, 0);
    check(PLAIN, 0.11, false, 0);
    check(PLAIN, 0.3, false, 1);
}

/// With a length in kilometres a step far beyond a bound is a small number; with large sigmas the whole
/// cost is.
#[test]
fn a_step_beyond_a_bound_does_not_depend_on_units() {
    let kilometres = Units {
        length: 1e-3,
        ..PLAIN
    };
    let small_costs = Units {
        sigma: 1e3,
        ..PLAIN
    };
    for units in [kilometres, small_costs] {
        check(units, 0.04, true, 0);
        check(units, 0.11, false, 0);
    }
}
