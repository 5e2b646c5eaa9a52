use super::*;
use crate::builder::{Builder, Record};
use crate::model::CoefficientSpec;
use crate::solvers::{Stopping, fit_from};
use crate::system::Grid;

/// Iterations, work and time of both parts, with consecutive iteration numbers.
#[test]
fn a_continued_fit_has_the_work_of_both() {
    crate::host::provide_clock();
    let times = Grid::new(0.0, 10.0, 101).unwrap().times();
    let samples: Vec<f64> = times.iter().map(|t| t.cos()).collect();
    let record = Record::new("free decay")
        .from_state(1.0, 0.0)
        .displacement(&times, &samples);
    let parts = [
        CoefficientSpec::fixed(1.0),
        CoefficientSpec::constant(0.5),
        CoefficientSpec::constant(2.0),
    ];
    let problem = Builder::new(parts).record(record).build().unwrap();
    let settings = |iterations| FitSettings {
        solver: Solver::SteepestDescent,
        stopping: Stopping::exactly(iterations),
        ..FitSettings::default()
    };
    let mut first = fit_from(&problem, &problem.start(), &settings(2)).unwrap();
    let hours = Duration::from_secs(36_000);
    first.timings.start = hours;
    first.elapsed = hours;
    let (before, cost) = (first.counts, first.best.evaluation.cost);
    let snapshots = first.snapshots.clone();
    assert!(!snapshots.is_empty());
    let mut attempts = Vec::new();
    let mut observe = |_: &IterationRecord| {};
    let mut observer = Observer::new(&mut observe);
    let whole = continued(
        &problem,
        first,
        &settings(5),
        None,
        &mut attempts,
        &mut observer,
    )
    .unwrap();
    let numbers: Vec<u64> = whole.history.iter().map(|row| row.iteration).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5]);
    assert!(whole.best.evaluation.cost < cost);
    assert_eq!(whole.snapshots, snapshots);
    let [attempt] = attempts.as_slice() else {
        panic!("{attempts:?}");
    };
    assert_eq!((attempt.history.len(), attempt.initial_cost), (3, cost));
    // Every iteration of steepest descent has at least one gradient.
    assert!(whole.counts.adjoint >= before.adjoint + 3);
    assert!(whole.timings.start >= hours && whole.timings.adjoint > Duration::ZERO);
    assert!(whole.elapsed > hours);
}

/// `c >= 0` and `k <= 3`: the nearest feasible point has the value of a violated bound in place of the parameter.
#[test]
fn a_start_from_the_data_is_moved_to_the_nearest_feasible_point() {
    let times = Grid::new(0.0, 10.0, 101).unwrap().times();
    let samples: Vec<f64> = times.iter().map(|t| t.cos()).collect();
    let record = Record::new("free decay")
        .from_state(1.0, 0.0)
        .displacement(&times, &samples);
    let parts = [
        CoefficientSpec::fixed(1.0),
        CoefficientSpec::constant(0.5).min(0.0),
        CoefficientSpec::constant(2.0).max(3.0),
    ];
    let problem = Builder::new(parts).record(record).build().unwrap();
    let start = problem.start();
    let cases = [
        ([0.2, 2.5], [0.2, 2.5]),
        ([-0.4, 2.5], [0.0, 2.5]),
        ([0.2, 7.0], [0.2, 3.0]),
        ([-0.4, 7.0], [0.0, 3.0]),
    ];
    for (found, nearest) in cases {
        assert_eq!(problem.feasible_or(found.to_vec(), &start), nearest);
    }
}
