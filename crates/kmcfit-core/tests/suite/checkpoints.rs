//! Checkpoints of a search, kept in memory: an interrupted search continues, a finished one is read.

use crate::common;

use kmcfit_core::internals::functions::{CoefficientFunction, CoefficientKind};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{
    CheckpointStore, CheckpointUnit, Fit, FitSettings, IterationRecord, Observer, Solver,
    SolverState, Status, Stopping, fit_with_noise_watched,
};
use kmcfit_core::internals::system::{Method, NodalCoefficients};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const NODES: usize = 251;

/// Free response of m = 1, c = 0.1, k = 1.5, with damping and stiffness to be found.
fn problem() -> Problem {
    let system = common::system(NODES, Method::Rk4);
    let truth = NodalCoefficients {
        mass: vec![1.0; NODES],
        coefficients: vec![vec![0.1; NODES], vec![1.5; NODES]],
    };
    let response = system.forward(&truth, common::INITIAL, None).unwrap();
    let list = vec![
        CoefficientFunction::fixed(CoefficientKind::Mass, vec![1.0; NODES]),
        CoefficientFunction::constant(CoefficientKind::Damping, 0.3, NODES),
        CoefficientFunction::constant(CoefficientKind::Stiffness, 1.45, NODES),
    ];
    common::problem_of(system, list, response.displacement, None)
}

/// Saved part of a unit.
#[derive(Default)]
struct Unit {
    rows: Vec<IterationRecord>,
    state: Option<SolverState>,
    /// Numbers of a computation between searches; empty for a unit without a result.
    end: Option<Vec<f64>>,
}

/// Checkpoints in memory, of every iteration.
#[derive(Default)]
struct Memory {
    units: Vec<Unit>,
    begun: usize,
}

impl Memory {
    fn unit(&mut self) -> &mut Unit {
        &mut self.units[self.begun - 1]
    }
}

impl CheckpointStore for Memory {
    fn begin(&mut self) -> Option<CheckpointUnit> {
        self.begun += 1;
        if self.begun > self.units.len() {
            self.units.push(Unit::default());
            return None;
        }
        let unit = self.unit();
        if let Some(numbers) = &unit.end {
            return Some(match numbers.is_empty() {
                true => CheckpointUnit::Nothing,
                false => CheckpointUnit::Numbers(numbers.clone()),
            });
        }
        // Iterations after the last state are computed again.
        let done = unit.state.as_ref().map_or(0, |state| state.iterations);
        unit.rows.truncate(done as usize);
        let state = unit.state.clone()?;
        Some(CheckpointUnit::Search(unit.rows.clone(), Box::new(state)))
    }

    fn discard(&mut self) {
        self.units.truncate(self.begun - 1);
        self.units.push(Unit::default());
    }

    fn save_iteration(&mut self, row: &IterationRecord) {
        self.unit().rows.push(row.clone());
    }

    fn is_due(&self, _parameters: usize) -> bool {
        true
    }

    fn save_state(&mut self, state: SolverState) {
        self.unit().state = Some(state);
    }

    fn end(&mut self, numbers: Option<&[f64]>) {
        self.unit().end = Some(numbers.unwrap_or_default().to_vec());
    }
}

/// Fits until iteration `last`; returns the fit and the number of iterations made.
fn run(solver: Solver, store: Option<&mut Memory>, last: u64) -> (Fit, u64) {
    let problem = problem();
    let flag = Arc::new(AtomicBool::new(false));
    let settings = FitSettings {
        solver,
        stopping: Stopping {
            iterations: 12,
            ..Stopping::default()
        },
        interrupt: Some(Arc::clone(&flag)),
        ..FitSettings::default()
    };
    let mut made = 0;
    let mut observe = |_: &IterationRecord| {
        made += 1;
        flag.fetch_or(made >= last, Ordering::Relaxed);
    };
    let mut watch = Observer::new(&mut observe);
    if let Some(store) = store {
        store.begun = 0;
        watch = watch.with_checkpoints(store);
    }
    let found = fit_with_noise_watched(&problem, &problem.start(), &settings, &mut watch);
    (found.expect("a motion").1, made)
}

/// The result of a fit without times; numbers are printed with all digits.
fn printed(fit: &Fit) -> String {
    format!(
        "{:?} {:?} {:?} {:?} {:?} {:?}",
        fit.best, fit.history, fit.snapshots, fit.outcome, fit.counts, fit.attempts
    )
}

const SOLVERS: [Solver; 4] = [
    Solver::SteepestDescent,
    Solver::Lbfgs { memory: 3 },
    Solver::ProjectedGradient,
    Solver::GaussNewton,
];

#[test]
fn a_search_interrupted_after_every_iteration_has_the_bits_of_an_uninterrupted_one() {
    for solver in SOLVERS {
        let (whole, iterations) = run(solver, None, u64::MAX);
        assert!(iterations > 3, "{solver:?}: {iterations}");
        let mut store = Memory::default();
        let mut made = 0;
        let found = loop {
            let (fit, more) = run(solver, Some(&mut store), 1);
            made += more;
            assert!(made <= iterations, "{solver:?} does not continue");
            if fit.outcome.status != Status::Interrupted {
                break fit;
            }
        };
        assert_eq!(made, iterations, "{solver:?}");
        assert!(printed(&found) == printed(&whole), "{solver:?}: other bits");
    }
}

#[test]
fn a_finished_search_is_saved_with_its_result_and_not_repeated() {
    for solver in SOLVERS {
        let mut store = Memory::default();
        let (whole, iterations) = run(solver, Some(&mut store), u64::MAX);
        let [unit] = store.units.as_slice() else {
            panic!("{solver:?}: {} searches", store.units.len());
        };
        let state = unit.state.as_ref().expect("a state");
        assert_eq!(state.iterations, iterations);
        assert_eq!(state.parameters.0, whole.best.parameters);
        assert_eq!(state.counts, whole.counts);
        assert!(state.outcome.is_some());
        assert_eq!(unit.rows, whole.history);
        let (found, made) = run(solver, Some(&mut store), u64::MAX);
        assert_eq!(made, 0, "{solver:?}");
        assert!(printed(&found) == printed(&whole), "{solver:?}: other bits");
    }
}
