//! Several records of one system determine coefficients that one record does not.

use crate::common;

use crate::common::synthetic::{Truth, run, settings};
use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{Basis, CoefficientFunction, Parameterization, Penalty, Ratio};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Weighting};
use kmcfit_core::solvers::{Fit, fit};
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};

const NODES: usize = 401;
const DURATION: f64 = 25.0;
const QUANTITIES: [CoefficientKind; 3] = [
    CoefficientKind::MASS,
    CoefficientKind::DAMPING,
    CoefficientKind::STIFFNESS,
];
fn states() -> [State; 3] {
    [
        State::one(3.3, 1.0),
        State::one(-0.5, 3.0),
        State::one(2.0, -2.5),
    ]
}

fn system(nodes: usize) -> System {
    System {
        grid: Grid::new(0.0, DURATION, nodes).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

/// Neither linear nor constant, so that the penalty is not zero at the truth; k(0) = 1.
fn truth(grid: &Grid) -> NodalCoefficients {
    let times = grid.times();
    let each = |f: &dyn Fn(f64) -> f64| times.iter().map(|t| f(*t)).collect();
    NodalCoefficients {
        inertias: vec![each(&|t| 1.0 - 0.2 * (0.25 * t).sin())],
        coefficients: vec![
            each(&|t| 0.08 + 0.03 * (0.3 * t).cos()),
            each(&|t| 1.0 + 0.25 * (0.2 * t).sin()),
        ],
    }
}

/// Non-zero at all times.
fn force(grid: &Grid) -> Excitation {
    let force: Vec<f64> = (grid.times().iter())
        .map(|t| 1.5 + (0.9 * t).sin())
        .collect();
    Excitation::force_at_nodes(&force)
}

/// Initial state of each record, and true if it is forced.
type Records<'a> = &'a [(State, bool)];

/// One value per step for each function, from (2, 1, 1), with samples at all nodes.
fn problem(nodes: usize, nodal: &NodalCoefficients, records: Records) -> Problem {
    let system = system(nodes);
    let grid = system.grid;
    let list = QUANTITIES.into_iter().zip([2.0, 1.0, 1.0]);
    let list = list.map(|(q, start)| CoefficientFunction::nodal(q, vec![start; nodes]));
    let functions = Parameterization::new(list.collect(), nodes, grid.step()).unwrap();
    let records = records.iter().map(|(initial, forced)| {
        let excitation = forced.then(|| force(&grid));
        let truth = Truth {
            system: &system,
            nodal,
            excitation: excitation.as_ref(),
            initial: initial.clone(),
        };
        let kind = ChannelKind::Displacement;
        let values = truth.seen(kind, &grid.times(), &[]);
        let weighting = Weighting::Sigma(1e-3);
        let channel = Channel::new(kind, grid.times(), values, weighting, &grid, nodes).unwrap();
        let mut experiment =
            Experiment::free("record", initial.clone(), nodes).with_channel(channel);
        experiment.excitation = excitation;
        experiment
    });
    let records = records.collect();
    Problem::new(system, functions, records).unwrap()
}

/// Light smoothness: the truth pays `weight` times some 1e-3 for its curvature, beside samples whose
/// misfit is counted in thousandths of a metre.
const SMOOTHNESS: f64 = 1e-2;

fn smooth(mut problem: Problem, scale_fixed: bool) -> Problem {
    let grid = problem.system.grid;
    for function in 0..3 {
        let rows = Basis::Nodal.roughness(&grid, 2);
        problem
            .penalize(Penalty::new(function, 2, SMOOTHNESS, rows))
            .unwrap();
    }
    if scale_fixed {
        let first = problem.functions.ranges()[2].start;
        let mut group = RowGroup::new("k(0) = 1");
        group.push([(first, 1.0)], [1.0, 1.0], [0.0, 0.0]);
        problem = problem
            .with(|parts| {
                parts.constraints.groups.push(group);
            })
            .unwrap();
    }
    problem
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
}

/// Largest errors of k/m and c/m.
fn ratio_errors(found: &Fit, truth: &NodalCoefficients) -> [f64; 2] {
    let laws = [Law::Damping, Law::Stiffness];
    [Ratio::StiffnessOverMass, Ratio::DampingOverMass].map(|ratio| {
        let [found, exact] =
            [&found.best.evaluation.nodal, truth].map(|of| ratio.at_nodes(&laws, of));
        largest(&found, &exact)
    })
}

/// A fit that explains one record with a different parameter set.
fn another_system(records: Records, scale_fixed: bool, truth: &NodalCoefficients) -> Fit {
    let problem = smooth(problem(NODES, truth, records), scale_fixed);
    let found = fit(&problem, &problem.start(), &settings(), &mut |_| {}).unwrap();
    let misfit = found.best.evaluation.misfit / problem.zero_response_misfit();
    println!("one record: misfit {misfit:.1e} of silence");
    assert!(misfit < 1e-5, "{misfit} {:#?}", found.attempts);
    found
}

#[test]
fn two_free_records_determine_the_ratios() {
    let truth = truth(&system(NODES).grid);
    let [one, other, _] = states();
    let two = [(one, false), (other, false)];
    let found = run(&smooth(problem(NODES, &truth, &two), true));
    let errors = ratio_errors(&found, &truth);
    println!(
        "two free records: k/m {:.1e}, c/m {:.1e}",
        errors[0], errors[1]
    );
    assert!(
        errors.iter().all(|e| *e < 2e-3),
        "{errors:?} {:#?}",
        found.attempts
    );
    // The functions themselves are not identifiable: the penalty selects the smoothest common factor s(t).
    let off = common::errors(&found.best.evaluation.nodal, &truth);
    assert!(off[0] > 0.05, "{off:?}");
    let one = ratio_errors(&another_system(&two[..1], true, &truth), &truth);
    println!("one free record: k/m {:.1e}, c/m {:.1e}", one[0], one[1]);
    assert!(one[0] > 0.02 && one[1] > 0.02, "{one:?}");
}

#[test]
fn two_free_records_and_a_forced_one_determine_the_system() {
    let truth = truth(&system(NODES).grid);
    let [one, other, forced] = states();
    let three = [(one, false), (other, false), (forced, true)];
    let found = run(&smooth(problem(NODES, &truth, &three), false));
    let errors = common::errors(&found.best.evaluation.nodal, &truth);
    println!("two free, one forced: {errors:?}");
    assert!(
        errors.iter().all(|e| *e < 5e-3),
        "{errors:?} {:#?}",
        found.attempts
    );
    let one = another_system(&three[2..], false, &truth);
    let off = common::errors(&one.best.evaluation.nodal, &truth);
    println!("one forced: {off:?}");
    assert!(off[0] > 0.05, "{off:?}");
}
