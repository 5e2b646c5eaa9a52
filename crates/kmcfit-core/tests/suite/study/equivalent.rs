use kmcfit_core::qp::ConicStatus;
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::study::{EquivalentOptions, TargetResponse, equivalent_coefficients};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn initial() -> State {
    State::one(3.3, 1.0)
}

fn system(nodes: usize, method: Method) -> System {
    System {
        grid: Grid::new(0.0, 12.0, nodes).unwrap(),
        method,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

fn truth(grid: &Grid) -> NodalCoefficients {
    let each = |f: &dyn Fn(f64) -> f64| grid.times().iter().map(|t| f(*t)).collect();
    NodalCoefficients {
        inertias: vec![each(&|t| 1.0 - 0.03 * t)],
        coefficients: vec![each(&|_| 0.1), each(&|t| 1.0 + 0.1 * (0.5 * t).sin())],
    }
}

fn force(grid: &Grid) -> Excitation {
    let values: Vec<f64> = grid.times().iter().map(|t| 0.5 * (0.7 * t).cos()).collect();
    Excitation::force_at_nodes(&values)
}

/// The true response at `nodes` nodes, by the fourth-order rule on a grid 32 times as fine.
fn response(nodes: usize) -> TargetResponse {
    response_from(initial(), nodes)
}

fn response_from(initial: State, nodes: usize) -> TargetResponse {
    let fine = system(32 * (nodes - 1) + 1, Method::Rk4);
    let nodal = truth(&fine.grid);
    let excitation = force(&fine.grid);
    let forces = excitation.force(0).unwrap().at_nodes();
    let moved = fine.forward(&nodal, &initial, Some(&excitation)).unwrap();
    let pick = |f: &[f64]| -> Vec<f64> { f.iter().step_by(32).copied().collect() };
    let (y, v) = (moved.displacement(0), moved.velocity(0));
    let acceleration: Vec<f64> = (0..y.len())
        .map(|i| {
            let [c, k] = [0, 1].map(|j| nodal.coefficients[j][i]);
            (forces[i] - c * v[i] - k * y[i]) / nodal.inertias[0][i]
        })
        .collect();
    TargetResponse {
        grid: system(nodes, Method::Rk4).grid,
        displacement: pick(y),
        velocity: pick(v),
        acceleration: pick(&acceleration),
        force: pick(&forces),
    }
}

/// `1 + sum of four random harmonics`, between 0.6 and 1.4.
fn random_mass(seed: u64, grid: &Grid) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 2]> = (0..4)
        .map(|_| {
            [
                random.random_range(-0.1..0.1),
                random.random_range(0.0..std::f64::consts::TAU),
            ]
        })
        .collect();
    let at = |t: f64| -> f64 {
        let each = waves.iter().enumerate();
        1.0 + each
            .map(|(n, [a, p])| a * (0.3 * (n + 1) as f64 * t + p).sin())
            .sum::<f64>()
    };
    grid.times().iter().map(|t| at(*t)).collect()
}

/// Largest error of the equivalent system's response by the midpoint rule.
fn error(nodes: usize, seed: u64) -> (f64, NodalCoefficients, TargetResponse) {
    let response = response(nodes);
    let mass = random_mass(seed, &response.grid);
    let options = EquivalentOptions::near(vec![0.1; nodes], 0.05);
    let nodal = equivalent_coefficients(&mass, &response, &options).unwrap();
    (
        response_error(&nodal, &response, initial()),
        nodal,
        response,
    )
}

/// Largest difference of the response of `nodal` from `initial` by the midpoint rule.
fn response_error(nodal: &NodalCoefficients, response: &TargetResponse, initial: State) -> f64 {
    let excitation = Excitation::force_at_nodes(&response.force);
    let system = system(response.grid.nodes(), Method::Midpoint);
    let moved = system.forward(nodal, &initial, Some(&excitation)).unwrap();
    let pairs = moved.displacement(0).iter().zip(&response.displacement);
    pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
}

/// The midpoint rule is of order two: half the step, a quarter of the error, from 3 to 5.5 for the
/// higher orders that are left at these steps.
#[test]
fn random_masses_have_the_response_to_the_order_of_the_stepper() {
    for seed in 0..4 {
        let (coarse, ..) = error(401, seed);
        let (fine, nodal, response) = error(801, seed);
        let rate = coarse / fine;
        let k = &nodal.coefficients[1];
        let least = k.iter().copied().fold(f64::INFINITY, f64::min);
        let most = k.iter().copied().fold(0.0, f64::max);
        println!(
            "mass {seed}: {coarse:.2e} {fine:.2e}, rate {rate:.2}, k from {least:.3} to {most:.3}"
        );
        assert!((3.0..5.5).contains(&rate), "{rate}");
        assert!(fine < 1e-2, "{fine}");
        assert!(least >= 0.05 - 1e-7 && most < 50.0, "{least} {most}");
        // It is a different parameter set.
        let truth = truth(&response.grid);
        assert!(crate::common::errors(&nodal, &truth)[0] > 0.1);
    }
}

/// With the true mass and the true damping as the target, the true stiffness is recovered.
#[test]
fn the_true_mass_and_damping_bring_the_true_stiffness() {
    let response = response(401);
    let truth = truth(&response.grid);
    let mut options = EquivalentOptions::near(truth.coefficients[0].clone(), 0.05);
    options.least_damping = Some(0.0);
    let nodal = equivalent_coefficients(&truth.inertias[0], &response, &options).unwrap();
    let errors = crate::common::errors(&nodal, &truth);
    println!("{errors:?}");
    // The penalty on k, 1e-9 of T^4 k''^2, changes it by some 1e-3.
    assert!(errors[1] < 5e-3 && errors[2] < 2e-2, "{errors:?}");
}

/// A fast growing mass requires negative damping at the zero crossings: with c >= 0 there is no equivalent system.
#[test]
fn impossible_responses_are_infeasible() {
    let response = response(401);
    let mass: Vec<f64> = response
        .grid
        .times()
        .iter()
        .map(|t| 0.5 + 0.5 * t)
        .collect();
    let mut options = EquivalentOptions::near(vec![0.1; 401], 0.05);
    options.least_damping = Some(0.0);
    let found = equivalent_coefficients(&mass, &response, &options);
    assert_eq!(found, Err(ConicStatus::Infeasible));
}

/// At a turning point the equation of motion is free of the damping, at a zero crossing of the stiffness.
#[test]
fn responses_from_turning_points_and_zero_crossings_have_equivalent_systems() {
    for [displacement, velocity] in [[3.3, 0.0], [0.0, 1.0]] {
        let initial = State::one(displacement, velocity);
        let response = response_from(initial.clone(), 801);
        let mass: Vec<f64> = response
            .grid
            .times()
            .iter()
            .map(|t| 1.0 + 0.02 * t)
            .collect();
        let options = EquivalentOptions::near(vec![0.1; 801], 0.05);
        let nodal = equivalent_coefficients(&mass, &response, &options).unwrap();
        let error = response_error(&nodal, &response, initial.clone());
        // The error of the midpoint rule, as with random masses.
        assert!(error < 1e-2, "{initial:?}: {error}");
    }
}

/// At rest, a force that the mass alone balances determines neither damping nor stiffness; another force has no equivalent system.
#[test]
fn at_rest_the_damping_is_the_target() {
    let mut response = response(401);
    response.displacement[0] = 0.0;
    response.velocity[0] = 0.0;
    let options = EquivalentOptions::near(vec![0.1; 401], 0.05);
    let mass = vec![1.5; 401];
    assert_eq!(
        equivalent_coefficients(&mass, &response, &options),
        Err(ConicStatus::Infeasible)
    );
    response.acceleration[0] = response.force[0] / mass[0];
    let nodal = equivalent_coefficients(&mass, &response, &options).unwrap();
    assert!((nodal.coefficients[0][0] - 0.1).abs() < 1e-15);
    assert!(
        nodal.coefficients[1]
            .iter()
            .all(|k| *k >= 0.05 * (1.0 - 1e-9))
    );
}
