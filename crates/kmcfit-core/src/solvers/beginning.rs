//! A start from the beginning of a long record.
//!
//! Where every function is a constant, a small part of a long record tells its value nearly as well as is needed to
//! begin with: the many iterations from a rough start are then made on little, and the few that are left on
//! all of it.

use super::executor::{Prepared, search};
use super::ladder::Before;
use super::recorder::Reference;
use super::timings::timed;
use super::{FitSettings, Timings, Watch};
use crate::dynamics::{Excitation, Grid, Stepwise};
use crate::functions::{Basis, CoefficientFunction, Functions};
use crate::objective::Evaluation;
use crate::problem::{Drive, Experiment, LONG, Problem};
use crate::threads;
use std::time::{Duration, Instant};

/// Steps of the beginning, the more if there are too few readings in the fewer: powers of two, so that its grid has
/// the same step to the last bit.
const STEPS: [usize; 2] = [1 << 11, 1 << 12];
/// How many readings there must be for each parameter.
const READINGS: usize = 20;
/// Most iterations on the beginning.
const ITERATIONS: u64 = 20;
/// The tolerance there: what is left is less than the rest of the record adds.
const TOLERANCE: f64 = 1e-6;

/// What is known at the start values, and a better start.
pub(super) struct Begun {
    pub reference: Option<Reference>,
    /// With what the whole problem says of it, if it has a motion there.
    pub start: Option<Prepared>,
    /// What the fit of the beginning took, interrupts left out.
    pub elapsed: Duration,
}

/// How many steps the beginning of a problem's records has; `None` unless they are long, all functions constants, and
/// there are readings enough in it.
pub(super) fn beginning(problem: &Problem) -> Option<usize> {
    let is_constant = |f: &CoefficientFunction| {
        matches!(f.basis, Some(Basis::Constant)) || f.basis.is_none() && f.start.is_empty()
    };
    let parameters = problem.parameters();
    let suits = problem.oscillator.grid.nodes() > LONG
        && problem.penalties.is_empty()
        && problem.variations.is_empty()
        && problem.comes_in_pieces()
        && problem.functions.iter().all(is_constant)
        && parameters > 0;
    let has_readings = |steps: &usize| {
        let count: usize = problem.channels().map(|c| c.count_within(*steps)).sum();
        count >= READINGS * parameters
    };
    (STEPS.into_iter().find(has_readings)).filter(|_| suits)
}

/// The first steps of a problem's records, with the same parameters.
fn first_steps(problem: &Problem, steps: usize) -> Option<Problem> {
    let grid = problem.oscillator.grid;
    let grid = Grid::new(grid.start(), grid.step() * steps as f64, steps + 1)?;
    let functions = &problem.functions;
    let list: Option<Vec<_>> = functions.iter().map(|f| shorter(f, grid.nodes())).collect();
    let devices = functions.assemblies().to_vec();
    let mut part = Problem::new(
        problem.oscillator.clone(),
        Functions::with_devices(list?, devices, grid.nodes(), grid.step())?
            .with_scalars(functions.scalars().to_vec()),
        problem
            .experiments
            .iter()
            .map(|e| first_steps_of(e, steps))
            .collect(),
    );
    part.oscillator.grid = grid;
    part.constraints = problem.constraints.clone();
    part.soft.clone_from(&problem.soft);
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
    let short = |part: &Option<Stepwise>| {
        let first = |all: &Stepwise| all.values()[..steps.min(all.steps())].to_vec();
        part.as_ref().map(|all| Stepwise::new(first(all)))
    };
    let excitation = experiment.excitation.as_ref().map(|all| Excitation {
        force: short(&all.force),
        base: short(&all.base),
    });
    let channels = experiment.channels.iter();
    Experiment {
        name: experiment.name.clone(),
        initial: experiment.initial,
        sought: experiment.sought,
        excitation,
        drive: Drive::default(),
        nodes: experiment.nodes.min(steps + 1),
        device: experiment.device,
        channels: channels.filter_map(|c| c.within(steps)).collect(),
    }
}

/// Fits the beginning, so many `steps`, from `start` and evaluates the whole problem at what it finds; beside that, where a
/// processor is to spare, finds cost and gradient of the whole problem at `start`.
pub(super) fn begin(
    problem: &Problem,
    steps: usize,
    start: &[f64],
    settings: &FitSettings,
    before: &mut Before,
    watch: &mut Watch,
) -> Begun {
    let mut short = settings.clone();
    short.stopping.iterations = settings.stopping.iterations.min(ITERATIONS);
    short.stopping.tolerance = Some(TOLERANCE);
    (short.stopping.cost_ratio, short.stopping.gradient_ratio) = (None, None);
    let fit_part = |watch: &mut Watch| {
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
        Some((fit, better, clock.elapsed()))
    };
    let clock = Instant::now();
    let (found, (reference, mut timings, spare)) = match threads::spare() {
        true => std::thread::scope(|scope| {
            let whole = threads::spawn_scoped(scope, || reference(problem, start, settings));
            let found = threads::sharing(|| fit_part(watch));
            let whole = whole.ok().and_then(|thread| thread.join().ok());
            (
                found,
                whole.unwrap_or_else(|| reference(problem, start, settings)),
            )
        }),
        false => (fit_part(watch), reference(problem, start, settings)),
    };
    before.counts.forward += 1;
    before.counts.adjoint += u64::from(reference.is_some());
    let (mut better, mut elapsed) = (None, Duration::ZERO);
    if let Some((fit, start, evaluating)) = found {
        elapsed = fit.elapsed + evaluating;
        before.counts += fit.counts;
        before.timings += fit.timings;
        before.timings.forward += evaluating;
        // What was done at once is told once.
        let rest = clock.elapsed().saturating_sub(elapsed);
        timings.forward = timings.forward.min(rest);
        timings.adjoint = timings.adjoint.min(rest - timings.forward);
        better = start.map(|start| Prepared { spare, ..start });
    }
    before.timings += timings;
    Begun {
        reference,
        start: better,
        elapsed,
    }
}

/// Cost and gradient at the start values, and the storage that they took.
pub(super) fn reference(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
) -> (Option<Reference>, Timings, Option<Evaluation>) {
    let mut timings = Timings::default();
    let evaluation = timed(&mut timings.forward, || problem.evaluate(start)).ok();
    let reference = evaluation.as_ref().map(|evaluation| Reference {
        norm_squared: timed(&mut timings.adjoint, || {
            problem.gradient(start, evaluation, settings.gradient)
        })
        .norm_squared,
        cost: evaluation.cost,
    });
    (reference, timings, evaluation)
}
