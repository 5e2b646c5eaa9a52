//! The forward solve against responses known in closed form.

use crate::common;

use crate::common::closed_form::{Bessel, constant_coefficients};
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{Grid, Method, NodalCoefficients, State, System};

fn system(nodes: usize, duration: f64, method: Method) -> System {
    System {
        grid: Grid::new(0.0, duration, nodes).unwrap(),
        method,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

/// Largest error of the displacement for m = 1 - a t, c = 0, k = 1.
fn bessel_error(nodes: usize, method: Method) -> f64 {
    let system = system(nodes, common::DURATION, method);
    let exact = Bessel::PAPER;
    let times = system.grid.times();
    let nodal = NodalCoefficients {
        inertias: vec![times.iter().map(|t| exact.mass(*t)).collect()],
        coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
    };
    let response = system.forward(&nodal, &common::initial(), None).unwrap();
    let errors = times.iter().zip(response.displacement(0));
    errors.fold(0.0f64, |most, (t, y)| {
        most.max((y - exact.displacement(*t)).abs())
    })
}

#[test]
fn the_closed_form_satisfies_its_initial_state_and_the_published_value() {
    let exact = Bessel::PAPER;
    assert!((exact.displacement(0.0) - 3.3).abs() < 1e-10);
    let h = 1e-5;
    let velocity = (exact.displacement(h) - exact.displacement(-h)) / (2.0 * h);
    assert!((velocity - 1.0).abs() < 1e-8);
    assert!((exact.displacement(25.0) + 2.19328282922).abs() < 1e-10);
}

#[test]
fn midpoint_converges_to_the_bessel_solution_with_its_known_constant() {
    for nodes in [1000, 2000, 4000, 8000] {
        let constant = bessel_error(nodes, Method::Midpoint) * ((nodes - 1) as f64).powi(2);
        assert!(
            (constant / 11393.0 - 1.0).abs() < 0.01,
            "N = {nodes}: {constant}"
        );
    }
}

#[test]
fn rk4_converges_to_the_bessel_solution_with_order_4() {
    let errors: Vec<f64> = [251, 501, 1001]
        .map(|n| bessel_error(n, Method::Rk4))
        .to_vec();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 4.0).abs() < 0.05, "{errors:?}");
    }
}

#[test]
fn constant_coefficients_converge_with_the_order_of_the_stepper() {
    // Under-, over- and critically damped, undamped, and negative damping.
    let nodal_sets = [
        (2.0, 0.4, 3.0),
        (1.0, 5.0, 2.0),
        (1.0, 4.0, 4.0),
        (0.5, 0.0, 7.0),
        (1.0, -0.2, 2.0),
    ];
    let initial = State::one(-0.7, 1.3);
    for (m, c, k) in nodal_sets {
        for method in [Method::Midpoint, Method::Rk4] {
            let error = |nodes: usize| {
                let system = system(nodes, 10.0, method);
                let nodal = NodalCoefficients {
                    inertias: vec![vec![m; nodes]],
                    coefficients: vec![vec![c; nodes], vec![k; nodes]],
                };
                let response = system.forward(&nodal, &initial, None).unwrap();
                let times = system.grid.times();
                let exact = times
                    .iter()
                    .map(|t| constant_coefficients((m, c, k), initial.clone(), *t));
                let errors = exact.zip(response.displacement(0).iter().zip(response.velocity(0)));
                errors.fold(0.0f64, |most, ((ye, ve), (y, v))| {
                    most.max((y - ye).abs()).max((v - ve).abs())
                })
            };
            let order = (error(801) / error(1601)).log2();
            let expected = f64::from(method.order());
            assert!(
                (order - expected).abs() < 0.1,
                "{m} {c} {k} {method:?}: order {order}"
            );
        }
    }
}
