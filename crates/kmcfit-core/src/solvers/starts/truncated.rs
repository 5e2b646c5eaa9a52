//! Truncated start: constants fitted to the first steps of a long record.
//!
//! If all functions are constants, a small part of a long record determines them accurately enough for a starting point. The
//! many iterations from a rough start then use few samples, and the few remaining ones use the whole record.

use super::{Referred, reference};
use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::host::Instant;
use crate::problem::Problem;
use crate::record::{Experiment, Input, LONG_RECORD_STEPS};
use crate::solvers::executor::{Prepared, search};
use crate::solvers::fit::Fit;
use crate::solvers::observer::Observer;
use crate::solvers::settings::FitSettings;
use crate::solvers::solve_counts::SolveCounts;
use crate::solvers::timings::{Timings, timed};
use crate::system::{Grid, System};
use crate::threads;
use std::sync::Arc;
use std::time::Duration;

/// Numbers of steps: the larger one if the smaller part has too few samples. Powers of two give the truncated grid exactly the
/// same step.
const STEPS: [usize; 2] = [1 << 11, 1 << 12];
/// Smallest number of samples per parameter.
const SAMPLES: usize = 20;
/// Iteration limit on the truncated record.
const ITERATIONS: u64 = 20;
/// Tolerance on the truncated record, smaller than the change by the rest of the record.
const TOLERANCE: f64 = 1e-6;
/// Factor from one part to the next where the whole record cannot be simulated with the parameters of the first.
const LONGER: usize = 8;

/// Number of steps of a truncated start; `None` unless the records are long, all functions are constants, and the part has
/// enough samples.
pub(in crate::solvers) fn truncated_steps(problem: &Problem) -> Option<usize> {
    let is_constant = |f: &CoefficientFunction| {
        matches!(f.basis, Some(Basis::Constant)) || f.basis.is_none() && f.start.is_empty()
    };
    let parameters = problem.parameters();
    let suits = problem.system.grid.nodes() > LONG_RECORD_STEPS
        && problem.penalties.is_empty()
        && problem.variations.is_empty()
        && problem.is_computed_by_blocks()
        && problem.functions.iter().all(is_constant)
        && parameters > 0;
    let has_samples = |steps: &usize| {
        let count: usize = problem.channels().map(|c| c.count_within(*steps)).sum();
        count >= SAMPLES * parameters
    };
    (STEPS.into_iter().find(has_samples)).filter(|_| suits)
}

/// The first steps of a problem's records, with the same parameters.
fn first_steps(problem: &Problem, steps: usize) -> Option<Problem> {
    let grid = problem.system.grid;
    let grid = Grid::new(grid.start(), grid.step() * steps as f64, steps + 1)?;
    let functions = &problem.functions;
    let list: Option<Vec<_>> = functions.iter().map(|f| shorter(f, grid.nodes())).collect();
    let coefficient_sets = functions.coefficient_sets().to_vec();
    let system = System {
        grid,
        ..problem.system.clone()
    };
    let mut part = Problem::new(
        system,
        Parameterization::with_coefficient_sets(
            list?,
            coefficient_sets,
            grid.nodes(),
            grid.step(),
        )?
        .with_scalars(functions.scalars().to_vec()),
        problem
            .experiments
            .iter()
            .map(|e| first_steps_of(e, steps))
            .collect(),
    )
    .ok()?;
    part.parts_mut().constraints = problem.constraints.clone();
    part.parts_mut().soft.clone_from(&problem.soft);
    Some(part)
}

/// A constant or fixed function over the first nodes.
fn shorter(function: &CoefficientFunction, nodes: usize) -> Option<CoefficientFunction> {
    let offset = function.offset[..nodes.min(function.offset.len())].to_vec();
    let short = match (&function.basis, function.start.as_slice()) {
        (None, []) => CoefficientFunction::fixed(function.quantity, offset),
        (Some(Basis::Constant), [start]) => CoefficientFunction {
            offset: Arc::new(offset),
            ..CoefficientFunction::constant(function.quantity, *start, nodes)
        },
        _ => return None,
    };
    Some(CoefficientFunction {
        owner: function.owner.clone(),
        is_known_part: function.is_known_part,
        prior: function.prior,
        positive_parameters: function.positive_parameters,
        ..short
    })
}

fn first_steps_of(experiment: &Experiment, steps: usize) -> Experiment {
    let channels = experiment.channels.iter();
    Experiment {
        name: experiment.name.clone(),
        initial: experiment.initial.clone(),
        initial_parameters: experiment.initial_parameters.clone(),
        excitation: (experiment.excitation.as_ref()).map(|all| all.first(steps)),
        input: Input::default(),
        input_error: None,
        nodes: experiment.nodes.min(steps + 1),
        coefficient_set: experiment.coefficient_set,
        channels: channels.filter_map(|c| c.within(steps)).collect(),
    }
}

/// A starting point from the first steps of a long record, evaluated on the whole problem if the simulation succeeds; and cost
/// and gradient of the whole problem at the start values.
pub(in crate::solvers) struct TruncatedStart {
    /// Starting point.
    pub start: Option<Prepared>,
    /// Cost and gradient at the start values.
    pub referred: Referred,
    /// Solves of the fit of the first steps.
    pub counts: SolveCounts,
    /// Time by kind of work.
    pub timings: Timings,
    /// Wall-clock time, including that before an interrupt.
    pub elapsed: Duration,
}

/// Fit of the first steps, and the evaluation of the whole problem at its end.
struct PartialFit {
    fit: Fit,
    better: Option<Prepared>,
    evaluating: Duration,
}

/// Fits the first `steps` from `start`; computes cost and gradient of the whole problem at `start` concurrently where a
/// processor is free.
pub(in crate::solvers) fn truncated_start(
    problem: &Problem,
    steps: usize,
    start: &[f64],
    settings: &FitSettings,
    observer: &mut Observer,
) -> TruncatedStart {
    let clock = Instant::now();
    let (part, mut referred) = threads::both(
        || fit_part(problem, steps, start, settings, observer),
        || reference(problem, start, settings),
    );
    let Some(part) = part else {
        return TruncatedStart {
            start: None,
            referred,
            counts: SolveCounts::default(),
            timings: Timings::default(),
            elapsed: Duration::ZERO,
        };
    };
    let elapsed = part.fit.elapsed + part.evaluating;
    // Concurrent work is counted once.
    let rest = clock.elapsed().saturating_sub(elapsed);
    let at_start = &mut referred.timings;
    at_start.forward = at_start.forward.min(rest);
    at_start.adjoint = at_start.adjoint.min(rest - at_start.forward);
    let mut timings = part.fit.timings;
    timings.forward += part.evaluating;
    let workspace = referred.workspace.take();
    TruncatedStart {
        start: part.better.map(|better| Prepared {
            workspace,
            ..better
        }),
        referred,
        counts: part.fit.counts,
        timings,
        elapsed,
    }
}

/// Fits the first `steps`, and longer parts where the whole record cannot be simulated with the result.
fn fit_part(
    problem: &Problem,
    steps: usize,
    start: &[f64],
    settings: &FitSettings,
    observer: &mut Observer,
) -> Option<PartialFit> {
    let mut short = settings.clone();
    short.stopping.iterations = settings.stopping.iterations.min(ITERATIONS);
    short.stopping.tolerance = Some(TOLERANCE);
    (short.stopping.cost_ratio, short.stopping.gradient_ratio) = (None, None);
    let mut search_part = |steps| {
        let part = first_steps(problem, steps)?;
        let found = observer.unreported(|observer| search(&part, start, &short, None, observer));
        found.ok()
    };
    let mut fit = search_part(steps)?;
    let mut evaluating = Duration::ZERO;
    let mut length = steps;
    loop {
        let parameters = fit.best.parameters.clone();
        let is_moved = parameters != start;
        let evaluate = || timed(&mut evaluating, || problem.evaluate(&parameters).ok());
        let evaluation = is_moved.then(evaluate).flatten();
        length *= LONGER;
        let is_last = !is_moved || evaluation.is_some() || length >= problem.system.grid.nodes();
        match (!is_last).then(|| search_part(length)).flatten() {
            Some(longer) => fit = longer.with_work_of(fit.counts, fit.timings, fit.elapsed),
            None => {
                let better = is_moved.then_some(Prepared {
                    evaluation,
                    parameters,
                    workspace: None,
                });
                return Some(PartialFit {
                    fit,
                    better,
                    evaluating,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::functions::CoefficientKind;
    use crate::record::{Channel, Weighting};
    use crate::structure::{Law, Structure};
    use crate::system::Method;
    use crate::system::State;

    /// A free decay with two constants, and a sample at every node `0, stride, 2 stride, ...`.
    fn free_decay(nodes: usize, stride: usize) -> Problem {
        let grid = Grid::new(0.0, 40.0, nodes).expect("a grid");
        let list = vec![
            CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; nodes]),
            CoefficientFunction::constant(CoefficientKind::DAMPING, 0.1, nodes),
            CoefficientFunction::constant(CoefficientKind::STIFFNESS, 20.0, nodes),
        ];
        let functions = Parameterization::new(list, nodes, grid.step()).expect("functions");
        let samples = vec![0.0; nodes.div_ceil(stride)];
        let weighting = Weighting::Sigma(1.0);
        let channel = Channel::displacement_at_nodes(samples, stride, weighting, &grid);
        let start = State::one(1.0, 0.0);
        let record = Experiment::free("decay", start, nodes).with_channel(channel);
        let system = System {
            grid,
            method: Method::Rk4,
            structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
        };
        Problem::new(system, functions, vec![record]).expect("a problem")
    }

    /// Samples that grow by e^10 within the first 2048 of 100,000 steps, and then decay: with the constants of the first steps the response of
    /// the whole record overflows, and with those of a longer part it does not.
    #[test]
    fn a_part_without_a_response_of_the_whole_record_is_extended() {
        let nodes = 100_001;
        let mut problem = free_decay(nodes, 4);
        let grid = problem.system.grid;
        let (growth, turn) = (10.0 / grid.time(2048), grid.time(2048));
        let sample = |t: f64| {
            let size = (growth * t.min(turn) - 0.05 * (t - turn).max(0.0)).exp();
            size * (20f64.sqrt() * t).cos()
        };
        let samples = (0..nodes).step_by(4).map(|i| sample(grid.time(i)));
        let channel = &mut problem.parts_mut().experiments[0].channels[0];
        *channel = channel.clone().with_samples(samples.collect());
        let start = problem.start();
        let mut ignore = |_: &_| {};
        let mut observer = Observer::new(&mut ignore);
        let settings = FitSettings::default();
        let first = first_steps(&problem, 2048).expect("a part");
        let of_first = search(&first, &start, &settings, None, &mut observer).expect("a response");
        assert!(problem.evaluate(&of_first.best.parameters).is_err());
        let found = truncated_start(&problem, 2048, &start, &settings, &mut observer);
        let prepared = found.start.expect("a start");
        assert!(prepared.evaluation.is_some(), "{:?}", prepared.parameters);
    }

    /// Two parameters need 40 samples. The first sample is at node 0, so `n` steps have `ceil(n / stride)` of them.
    #[test]
    fn the_truncated_record_has_2048_steps_or_4096_if_samples_are_few() {
        let long = LONG_RECORD_STEPS + 1;
        let cases = [
            (4, Some(2048)),
            (52, Some(2048)),
            (53, Some(4096)),
            (105, Some(4096)),
            (106, None),
        ];
        for (stride, steps) in cases {
            assert_eq!(
                truncated_steps(&free_decay(long, stride)),
                steps,
                "{stride}"
            );
        }
        assert_eq!(truncated_steps(&free_decay(LONG_RECORD_STEPS, 4)), None);
    }
}
