//! Physical laws and invariances, tested on random systems from a fixed seed.

use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Experiment;
use kmcfit_core::solvers::Fit;
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::common::properties;

const DURATION: f64 = 12.0;

/// A smooth system, a start and a force, on any grid.
#[derive(Debug, Clone, Copy)]
struct Case {
    /// Mean, share of change, angular frequency of the change of mass, damping, stiffness.
    functions: [[f64; 3]; 3],
    start: [f64; 2],
    /// Amplitude and angular frequency.
    force: [f64; 2],
}

fn any_case() -> impl Strategy<Value = Case> {
    let mass = (0.5..2.0, 0.0..0.4, 0.1..1.0);
    let damping = (-0.02..0.2, 0.0..0.5, 0.1..1.0);
    let stiffness = (1.0..6.0, 0.0..0.4, 0.1..1.0);
    let start = (-2.0..2.0, -2.0..2.0);
    let force = (-1.0..1.0, 0.3..3.0);
    (mass, damping, stiffness, start, force).prop_map(|(m, c, k, s, f)| Case {
        functions: [[m.0, m.1, m.2], [c.0, c.1, c.2], [k.0, k.1, k.2]],
        start: [s.0, s.1],
        force: [f.0, f.1],
    })
}

/// Runs `law` on the same 40 cases in every run.
fn for_cases(law: impl Fn(Case)) {
    let mut runner = TestRunner::new(properties::properties(40, 7));
    let result = runner.run(&any_case(), |case| {
        law(case);
        Ok(())
    });
    result.unwrap();
}

impl Case {
    fn value(&self, f: usize, t: f64) -> f64 {
        let [mean, share, omega] = self.functions[f];
        mean * (1.0 + share * (omega * t).sin())
    }

    fn slope(&self, f: usize, t: f64) -> f64 {
        let [mean, share, omega] = self.functions[f];
        mean * share * omega * (omega * t).cos()
    }

    fn nodal(&self, grid: &Grid) -> NodalCoefficients {
        let values = |f: usize| grid.times().iter().map(|t| self.value(f, *t)).collect();
        NodalCoefficients {
            inertias: vec![values(0)],
            coefficients: vec![values(1), values(2)],
        }
    }

    fn state(&self) -> State {
        State::one(self.start[0], self.start[1])
    }

    fn force(&self, t: f64) -> f64 {
        self.force[0] * (self.force[1] * t).sin()
    }

    fn excitation(&self, grid: &Grid) -> Excitation {
        let force: Vec<f64> = grid.times().iter().map(|t| self.force(*t)).collect();
        Excitation::force_at_nodes(&force)
    }
}

fn system(nodes: usize, method: Method) -> System {
    System {
        grid: Grid::new(0.0, DURATION, nodes).unwrap(),
        method,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

fn size(response: &[f64]) -> f64 {
    response.iter().fold(0.0, |most, y| most.max(y.abs()))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    size(&differences)
}

/// Rounding of a response of some hundred steps, relative to its size.
const ROUNDING: f64 = 1e-12;

#[test]
fn responses_of_a_linear_system_superpose() {
    for_cases(|case| {
        let system = system(501, Method::Rk4);
        let nodal = case.nodal(&system.grid);
        let excitation = case.excitation(&system.grid);
        let rest = State::rest(1);
        let both = system.forward(&nodal, &case.state(), Some(&excitation));
        let free = system.forward(&nodal, &case.state(), None).unwrap();
        let forced = system.forward(&nodal, &rest, Some(&excitation)).unwrap();
        let sum: Vec<f64> = (free.displacement(0).iter().zip(forced.displacement(0)))
            .map(|(a, b)| a + b)
            .collect();
        let scale = size(free.displacement(0)) + size(forced.displacement(0));
        assert!(
            distance(both.unwrap().displacement(0), &sum) <= ROUNDING * scale,
            "{case:?}"
        );
    });
}

/// `E' = -(c - m'/2) v^2 + k' y^2/2 + f v`, to the second order of functions sampled at nodes.
#[test]
fn energy_is_balanced_to_the_order_of_the_stepper() {
    for_cases(|case| {
        let imbalance = |nodes: usize| -> [f64; 2] {
            let system = system(nodes, Method::Rk4);
            let grid = system.grid;
            let excitation = case.excitation(&grid);
            let response = system.forward(&case.nodal(&grid), &case.state(), Some(&excitation));
            let response = response.unwrap();
            let (y, v) = (response.displacement(0), response.velocity(0));
            let energy = |i: usize| {
                let t = grid.time(i);
                0.5 * (case.value(0, t) * v[i] * v[i] + case.value(2, t) * y[i] * y[i])
            };
            let power = |i: usize| {
                let t = grid.time(i);
                let lost = case.value(1, t) - 0.5 * case.slope(0, t);
                -lost * v[i] * v[i] + 0.5 * case.slope(2, t) * y[i] * y[i] + case.force(t) * v[i]
            };
            let last = nodes - 1;
            let ends = 0.5 * (power(0) + power(last));
            let work = grid.step() * (ends + (1..last).map(power).sum::<f64>());
            let most = (0..nodes).map(energy).fold(0.0, f64::max);
            [
                energy(last) - energy(0) - work,
                grid.step() * grid.step() * most,
            ]
        };
        let ([coarse, scale], [fine, _]) = (imbalance(401), imbalance(801));
        // If the leading error nearly cancels, the next order remains, as a fraction of its scale.
        let bound = coarse.abs() / 4.0 * 1.15 + 1e-3 * scale;
        assert!(fine.abs() <= bound, "{case:?}: {coarse:e} -> {fine:e}");
        assert!(coarse.abs() <= 10.0 * scale, "{case:?}: {coarse:e}");
    });
}

/// Samples of a case in a unit that is `per_metre` to the metre, `later` seconds later.
fn record(case: Case, per_metre: f64, later: f64) -> Record {
    let system = system(121, Method::Rk4);
    let grid = system.grid;
    let response = system
        .forward(&case.nodal(&grid), &case.state(), None)
        .unwrap();
    // A deterministic error makes every fit inexact.
    let read = |(i, y): (usize, &f64)| per_metre * (y + 0.01 * (1.3 * i as f64).sin());
    let samples: Vec<f64> = response
        .displacement(0)
        .iter()
        .enumerate()
        .map(read)
        .collect();
    let times: Vec<f64> = grid.times().iter().map(|t| t + later).collect();
    Record::new(format!("from {:?}", case.start))
        .from_state(per_metre * case.start[0], per_metre * case.start[1])
        .displacement(&times, &samples)
        .sigma(0.02 * per_metre)
}

/// A fit of stiffness and damping on knots beside a known mass.
fn builder(case: Case, knots: usize) -> Builder {
    let [m, c, k] = [0, 1, 2].map(|f| case.functions[f][0]);
    Builder::new([
        CoefficientSpec::fixed(m),
        CoefficientSpec::piecewise_linear(knots, 1.1 * c.abs() + 0.02),
        CoefficientSpec::piecewise_linear(knots, 1.02 * k).min(0.1 * k),
    ])
}

fn fitted(problem: &Problem) -> Fit {
    problem.fit().unwrap()
}

/// Largest difference of two fits of the same minimum: the tolerance of J is 1e-10, that of the parameters its
/// square root.
const SAME_MINIMUM: f64 = 1e-4;

fn same(a: &Fit, b: &Fit, case: Case) {
    let (ja, jb) = (a.best.evaluation.cost, b.best.evaluation.cost);
    assert!((ja - jb).abs() <= 1e-7 * ja, "{case:?}: {ja} {jb}");
    let functions = a.best.evaluation.nodal.functions();
    for (p, q) in functions.zip(b.best.evaluation.nodal.functions()) {
        let scale = size(p).max(0.1);
        assert!(distance(p, q) <= SAME_MINIMUM * scale, "{case:?}");
    }
}

/// Eight of the cases, for laws that need fits.
fn for_some_cases(law: impl Fn(Case)) {
    let count = std::cell::Cell::new(0);
    for_cases(|case| {
        count.set(count.get() + 1);
        if count.get() % 5 == 0 {
            law(case);
        }
    });
}

#[test]
fn other_units_of_length_and_time_find_the_same_system() {
    for_some_cases(|case| {
        let fit = |per_metre: f64, later: f64| {
            let problem = builder(case, 4).record(record(case, per_metre, later));
            fitted(&problem.build().unwrap())
        };
        let metres = fit(1.0, 0.0);
        same(&metres, &fit(1000.0, 0.0), case);
        same(&metres, &fit(1.0, 250.0), case);
    });
}

#[test]
fn the_order_of_records_and_records_without_samples_do_not_matter() {
    for_some_cases(|case| {
        let other = Case {
            start: [case.start[1] + 0.5, -case.start[0]],
            ..case
        };
        let problem = |records: [Case; 2]| {
            let [first, second] = records.map(|case| record(case, 1.0, 0.0));
            builder(case, 4)
                .record(first)
                .record(second)
                .build()
                .unwrap()
        };
        let both = problem([case, other]);
        let fit = fitted(&both);
        same(&fit, &fitted(&problem([other, case])), case);
        let mut more = both.clone();
        let state = State::one(0.3, 0.0);
        let unused = Experiment::free("unused", state, both.system.grid.nodes());
        more = more
            .with(|parts| {
                parts.experiments.push(unused);
            })
            .unwrap();
        let with_unused = fitted(&more);
        assert_eq!(fit.best.parameters, with_unused.best.parameters, "{case:?}");
        assert_eq!(fit.best.evaluation.cost, with_unused.best.evaluation.cost);
    });
}

/// Knots that contain the coarser ones, started from the coarse optimum, never end higher.
#[test]
fn finer_knots_never_raise_the_optimum() {
    for_some_cases(|case| {
        let mut start: Option<Fit> = None;
        for knots in [3, 5, 9] {
            let problem = builder(case, knots)
                .record(record(case, 1.0, 0.0))
                .build()
                .unwrap();
            let fit = match &start {
                None => fitted(&problem),
                Some(coarse) => {
                    let nodal = &coarse.best.evaluation.nodal;
                    let theta: Vec<f64> = (problem.functions.iter().zip(nodal.functions()))
                        .filter_map(|(f, values)| f.basis.as_ref().map(|basis| (basis, values)))
                        .flat_map(|(basis, values)| {
                            basis.project(&problem.system.grid, values).unwrap()
                        })
                        .collect();
                    let settings = kmcfit_core::solvers::FitSettings::default();
                    kmcfit_core::solvers::fit(&problem, &theta, &settings, &mut |_| {}).unwrap()
                }
            };
            if let Some(coarse) = &start {
                let (before, after) = (coarse.best.evaluation.cost, fit.best.evaluation.cost);
                assert!(
                    after <= before * (1.0 + 1e-9),
                    "{case:?}: {before} -> {after}"
                );
            }
            start = Some(fit);
        }
    });
}
