//! A start from the beginning of a long record.
//!
//! Where every function is a constant, a small part of a long record tells its value nearly as well as is needed to
//! begin with: the many iterations from a rough start are then made on little, and the few that are left on
//! all of it.

use super::{Referred, reference};
use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::host::Instant;
use crate::problem::Problem;
use crate::record::{Experiment, Input, LONG_RECORD_STEPS};
use crate::solvers::checkpoint::Observer;
use crate::solvers::executor::{Prepared, search};
use crate::solvers::fit::Fit;
use crate::solvers::settings::FitSettings;
use crate::solvers::solve_counts::SolveCounts;
use crate::solvers::timings::Timings;
use crate::system::{Excitation, Grid, StageSamples, System};
use crate::threads;
use std::time::Duration;

/// Steps of the beginning, the more if there are too few samples in the fewer: powers of two, so that its grid has
/// the same step to the last bit.
const STEPS: [usize; 2] = [1 << 11, 1 << 12];
/// How many samples there must be for each parameter.
const READINGS: usize = 20;
/// Most iterations on the beginning.
const ITERATIONS: u64 = 20;
/// The tolerance there: what is left is less than the rest of the record adds.
const TOLERANCE: f64 = 1e-6;

/// The number of steps of a truncated start; `None` unless they are long, all functions constants, and
/// there are samples enough in it.
pub(in crate::solvers) fn truncated_steps(problem: &Problem) -> Option<usize> {
    let is_constant = |f: &CoefficientFunction| {
        matches!(f.basis, Some(Basis::Constant)) || f.basis.is_none() && f.start.is_empty()
    };
    let parameters = problem.parameters();
    let suits = problem.system.grid.nodes() > LONG_RECORD_STEPS
        && problem.penalties.is_empty()
        && problem.variations.is_empty()
        && problem.comes_in_pieces()
        && problem.functions.iter().all(is_constant)
        && parameters > 0;
    let has_samples = |steps: &usize| {
        let count: usize = problem.channels().map(|c| c.count_within(*steps)).sum();
        count >= READINGS * parameters
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

/// A constant or known function over the first nodes.
fn shorter(function: &CoefficientFunction, nodes: usize) -> Option<CoefficientFunction> {
    let offset = function.offset[..nodes].to_vec();
    let short = match (&function.basis, function.start.as_slice()) {
        (None, []) => CoefficientFunction::fixed(function.quantity, offset),
        (Some(Basis::Constant), [start]) => CoefficientFunction {
            offset,
            ..CoefficientFunction::constant(function.quantity, *start, nodes)
        },
        _ => return None,
    };
    Some(CoefficientFunction {
        owner: function.owner.clone(),
        positive_parameters: function.positive_parameters,
        ..short
    })
}

fn first_steps_of(experiment: &Experiment, steps: usize) -> Experiment {
    let short = |part: &Option<StageSamples>| {
        let first = |all: &StageSamples| all.values()[..steps.min(all.steps())].to_vec();
        part.as_ref().map(|all| StageSamples::new(first(all)))
    };
    let excitation = experiment.excitation.as_ref().map(|all| Excitation {
        force: short(&all.force),
        base: short(&all.base),
    });
    let channels = experiment.channels.iter();
    Experiment {
        name: experiment.name.clone(),
        initial: experiment.initial,
        initial_parameters: experiment.initial_parameters,
        excitation,
        drive: Input::default(),
        nodes: experiment.nodes.min(steps + 1),
        coefficient_set: experiment.coefficient_set,
        channels: channels.filter_map(|c| c.within(steps)).collect(),
    }
}

/// A start from the first steps of a long record, with the whole problem evaluated there, if it has a response; and cost
/// and gradient of the whole problem at the start values.
pub(in crate::solvers) struct TruncatedStart {
    /// The start.
    pub start: Option<Prepared>,
    /// Cost and gradient at the start values.
    pub referred: Referred,
    /// Work of the fit of the first steps.
    pub counts: SolveCounts,
    /// What that work took.
    pub timings: Timings,
    /// Wall-clock time, also of what was done before an interrupt.
    pub elapsed: Duration,
}

/// A fit of the first steps and the evaluation of the whole problem where it ended.
struct PartialFit {
    fit: Fit,
    better: Option<Prepared>,
    evaluating: Duration,
}

/// Fits the first `steps` from `start`; at the same time, where a processor is to spare, finds cost and gradient of the
/// whole problem at `start`.
pub(in crate::solvers) fn truncated_start(
    problem: &Problem,
    steps: usize,
    start: &[f64],
    settings: &FitSettings,
    watch: &mut Observer,
) -> TruncatedStart {
    let clock = Instant::now();
    let (part, mut referred) = threads::both(
        || fit_part(problem, steps, start, settings, watch),
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
    // What was done at once is counted once.
    let rest = clock.elapsed().saturating_sub(elapsed);
    let at_start = &mut referred.timings;
    at_start.forward = at_start.forward.min(rest);
    at_start.adjoint = at_start.adjoint.min(rest - at_start.forward);
    let mut timings = part.fit.timings;
    timings.forward += part.evaluating;
    let spare = referred.spare.take();
    TruncatedStart {
        start: part.better.map(|better| Prepared { spare, ..better }),
        referred,
        counts: part.fit.counts,
        timings,
        elapsed,
    }
}

fn fit_part(
    problem: &Problem,
    steps: usize,
    start: &[f64],
    settings: &FitSettings,
    watch: &mut Observer,
) -> Option<PartialFit> {
    let mut short = settings.clone();
    short.stopping.iterations = settings.stopping.iterations.min(ITERATIONS);
    short.stopping.tolerance = Some(TOLERANCE);
    (short.stopping.cost_ratio, short.stopping.gradient_ratio) = (None, None);
    let part = first_steps(problem, steps)?;
    let found = watch.unseen(|watch| search(&part, start, &short, None, watch));
    let fit = found.ok()?;
    let clock = Instant::now();
    let parameters = fit.best.parameters.clone();
    let better = (parameters != start).then(|| Prepared {
        evaluation: problem.evaluate(&parameters).ok(),
        parameters,
        spare: None,
    });
    Some(PartialFit {
        fit,
        better,
        evaluating: clock.elapsed(),
    })
}
