//! The line search of the projected gradient, on a cost that is a parabola.

use crate::common;

use crate::common::synthetic::{settings, with_noise};
use kmcfit_core::functions::{CoefficientFunction, ScalarParameter, ScalarValue};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Sensor;
use kmcfit_core::solvers::{FitSettings, Solver, Stopping, fit_from};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Method, NodalCoefficients};

const NODES: usize = 101;
/// Fraction of the slope by which a step must lower J (Armijo).
const DECREASE: f64 = 1e-4;

/// A known response and noise, measured with an estimated offset, with sigma.
fn problem(sigma: f64) -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let values = [1.0, 0.1, 1.0].map(|value| vec![value; NODES]);
    let nodal = NodalCoefficients {
        inertias: vec![values[0].clone()],
        coefficients: values[1..].to_vec(),
    };
    let response = system.forward(&nodal, &common::initial(), None).unwrap();
    let observed = with_noise(response.displacement(0), 1.0, 7);
    let quantities = [
        CoefficientKind::MASS,
        CoefficientKind::DAMPING,
        CoefficientKind::STIFFNESS,
    ];
    let list = quantities.into_iter().zip(values);
    let list = list.map(|(q, values)| CoefficientFunction::fixed(q, values));
    let mut problem = common::problem_of(system, list.collect(), observed, Some(sigma));
    let offset = ScalarParameter {
        name: "offset".into(),
        unit: "m".into(),
        start: 0.0,
        size: 0.7,
        prior: None,
    };
    problem = problem
        .with(|parts| {
            parts.functions = parts.functions.clone().with_scalars(vec![offset]);
        })
        .unwrap();
    let channel = problem.experiments[0].channels[0].clone();
    let sensor = Sensor {
        offset: ScalarValue::Estimated(0),
        ..Sensor::default()
    };
    problem
        .with(|parts| parts.experiments[0].channels[0] = channel.with_sensor(sensor))
        .unwrap()
}

/// `J(x) = q x^2 + r` at the distance x from the mean. The first step goes where the linear model is zero, by
/// `-J/(2 q x)`, with the slope -J; a share s of it gives `J (1 - s + s^2 k)` with
/// `k = 1/4 + r/(4 q x^2)`. So a start is chosen by the decrease that a share brings.
#[test]
fn a_step_is_halved_until_it_lowers_the_cost_by_its_share_of_the_slope() {
    // In any unit of J.
    for sigma in [1e-3, 1.0, 1e6] {
        let problem = problem(sigma);
        let silent = problem.evaluate(&[0.0]).unwrap();
        let channel = &problem.experiments[0].channels[0];
        let residuals: Vec<f64> = channel.residuals(&silent.predictions[0][0]).collect();
        let n = residuals.len() as f64;
        // Model less sample falls to zero at minus its mean.
        let mean = -residuals.iter().sum::<f64>() / n;
        let q = n / (sigma * sigma);
        let r = residuals.iter().map(|r| (r + mean).powi(2)).sum::<f64>() / (sigma * sigma);
        for share in [1.0, 0.5, 0.25] {
            for (times, taken) in [(2.0, share), (0.5, 0.5 * share)] {
                let k = (1.0 - times * DECREASE) / share;
                let x = (r / (4.0 * k - 1.0) / q).sqrt();
                let settings = FitSettings {
                    solver: Solver::ProjectedGradient,
                    stopping: Stopping::exactly(1),
                    ..settings()
                };
                let found = fit_from(&problem, &[mean + x], &settings).unwrap();
                assert_eq!(found.history.len(), 1, "{sigma} {:?}", found.outcome);
                assert_eq!(found.history[0].step, taken, "{sigma} {share} {times}");
                let cost = q * x * x + r;
                let expected = mean + x - taken * cost / (2.0 * q * x);
                let off = (found.best.parameters[0] - expected).abs();
                assert!(off < 1e-9 * x, "{sigma} {share} {times}: {off}");
            }
        }
    }
}
