//! Refinement of an automatic grid: fits on finer grids until the discretisation error is below a tenth of the standard errors.
//!
//! After a fit, the problem is simulated with half the step and the same parameters: on the same functions where these are linear between
//! the nodes, otherwise built anew. The changes of the predictions
//! give the shift of the estimates by the discretisation error ([`Problem::shift_by_steps`]), and by the order of the stepper the
//! number of nodes for which it is small enough. The next fit starts from the estimates, or from the start values where the
//! response changes so much that the estimates belong to another system.

use super::fit::Fit;
use super::observer::Observer;
use super::rounds::is_ended;
use super::termination::Status;
use crate::functions::Basis;
use crate::number_format::significant;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::step::SimulationError;
use serde::Serialize;
use std::fmt;

/// Largest discretisation error of an estimate, in standard errors.
pub const LARGEST_ERROR: f64 = 0.1;
/// Discretisation error at which a finer grid aims.
const AIM: f64 = 0.06;
/// Largest change of the response by halving the step, relative to the largest sample, that needs no finer grid: the resolution
/// of single precision, with which loggers store samples.
const RESOLUTION: f64 = 1e-7;
/// Misfit, relative to that of the zero response, of a fit that belongs to no system, on any grid.
const POOR: f64 = 0.25;
/// Factor by which the next grid may be better than [`RESOLUTION`].
const BEYOND: f64 = 16.0;
/// Change of the response by halving the step, relative to the largest sample, from which the estimates are no start.
const OTHER_SYSTEM: f64 = 0.01;
/// Smallest and largest factor of the number of steps from one grid to the next. The order of convergence is measured from grid to grid, and
/// at kinks of a force or contacts it is not that of the stepper: by larger factors a grid became seventeen times as fine as the
/// least that has the error. A further fit starts at the estimates and costs little.
const FACTORS: [f64; 2] = [1.1, 2.5];
/// Smallest observed order of convergence: that of a jump within a step.
const LEAST_ORDER: f64 = 1.0;
/// Largest second difference of a function at the nodes, relative to its largest value, for which it is linear between the nodes: its
/// deviation in between changes no response by a share of [`RESOLUTION`].
const LINEAR: f64 = 1e-10;
/// Largest number of finer grids: together a factor of 4000.
const ROUNDS: usize = 9;

/// Problems on other grids: the one with at least so many nodes, and a number of steps that is a multiple of the samples of a
/// force; `None` if it does not fit into memory.
pub type OnNodes<'a> = dyn FnMut(usize) -> Option<Problem> + 'a;

/// A fit of a problem from a start, with further results `T` and the problem with its noise.
pub type RunFit<'a, T> =
    dyn FnMut(&Problem, &[f64], &mut Observer) -> Result<(T, Problem, Fit), SimulationError> + 'a;

/// Notice on an automatic grid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GridNotice {
    /// The first grid was refined.
    GridRefined {
        /// Nodes of the first grid.
        from: usize,
        /// Nodes of the last one.
        nodes: usize,
        /// Its discretisation error in standard errors.
        error: f64,
    },
    /// The largest automatic grid has a larger error than required.
    GridLimited {
        /// Nodes.
        nodes: usize,
        /// Discretisation error in standard errors.
        error: f64,
    },
}

impl fmt::Display for GridNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GridRefined { from, nodes, error } => write!(
                f,
                "grid: refined from {from} to {nodes} nodes; the discretisation error is {} standard errors",
                significant(*error, 2)
            ),
            Self::GridLimited { nodes, error } => write!(
                f,
                "grid: with {nodes} nodes, the most that `auto` chooses, the discretisation error is {} standard errors; \
                 set a larger `grid.nodes`",
                significant(*error, 2)
            ),
        }
    }
}

/// Result of a fit on an automatic grid.
pub struct RefinedFit<T> {
    /// Further results of the fit.
    pub further: T,
    /// The problem on the last grid, with its noise.
    pub problem: Problem,
    /// The fit.
    pub fit: Fit,
    /// Notices.
    pub notices: Vec<GridNotice>,
}

/// Fits `problem` from `start` by `run`, and on finer grids of at most `most` nodes while the discretisation error exceeds a tenth
/// of a standard error. Fits that converged to no minimum, explain less than three quarters of the
/// misfit of the zero response, or have too many parameters for standard errors keep their grid.
///
/// # Errors
/// A [`SimulationError`] if the first fit fails.
pub fn fit_on_refined_grids<T>(
    problem: &Problem,
    start: &[f64],
    most: usize,
    on_nodes: &mut OnNodes,
    run: &mut RunFit<T>,
    observer: &mut Observer,
) -> Result<RefinedFit<T>, SimulationError> {
    let (further, fitted, fit) = run(problem, start, observer)?;
    let from = nodes(problem);
    let mut found = RefinedFit {
        further,
        problem: fitted,
        fit,
        notices: Vec::new(),
    };
    let mut before: Option<(usize, GridError)> = None;
    let mut error = None;
    for round in 0..=ROUNDS {
        let here = nodes(&found.problem);
        error = GridError::of(&found, on_nodes);
        let Some(wanted) = error.and_then(|error| error.wanted(&found, before)) else {
            break;
        };
        let next = (round < ROUNDS && here < most).then(|| on_nodes(wanted.min(most)));
        let Some(next) = next.flatten().filter(|next| nodes(next) > here) else {
            found.notices.extend(error.and_then(|e| e.limited(here)));
            break;
        };
        let is_other = error.is_none_or(|error| error.change > OTHER_SYSTEM);
        let start = match is_other {
            true => None,
            false => carried(&found, &next),
        };
        let start = start.unwrap_or_else(|| next.start());
        let Ok((further, fitted, fit)) = run(&next, &start, observer) else {
            found.notices.extend(error.and_then(|e| e.limited(here)));
            break;
        };
        before = error.map(|error| (here, error));
        found = found.followed_by(further, fitted, fit);
    }
    let nodes = nodes(&found.problem);
    if nodes > from && !is_ended(&found.fit) {
        if let Ok(evaluation) = found.problem.evaluate(&found.problem.start()) {
            found.fit.initial_cost = evaluation.cost;
        }
        let error = error.and_then(|error| error.shift);
        let refined = error.map(|error| GridNotice::GridRefined { from, nodes, error });
        found.notices.splice(0..0, refined);
    }
    Ok(found)
}

impl<T> RefinedFit<T> {
    /// True for a minimum that explains three quarters of the misfit of the zero response.
    fn is_explained(&self) -> bool {
        let is_minimum = match self.fit.outcome.status {
            // A limit on the ratios of J or of its gradient is no minimum and is not measured.
            Status::Converged => self.fit.optimality.is_some(),
            Status::Stalled => true,
            _ => false,
        };
        let misfit = self.fit.best.evaluation.misfit;
        is_minimum && misfit <= POOR * self.problem.zero_response_misfit()
    }

    /// The fit on the next grid, with the work of this one.
    fn followed_by(self, further: T, problem: Problem, fit: Fit) -> Self {
        let before = self.fit;
        Self {
            further,
            problem,
            fit: Fit {
                initial_norm_squared: before.initial_norm_squared,
                ..fit.with_work_of(before.counts, before.timings, before.elapsed)
            },
            notices: self.notices,
        }
    }
}

fn nodes(problem: &Problem) -> usize {
    problem.system.grid.nodes()
}

/// Discretisation error of a fit.
#[derive(Clone, Copy)]
struct GridError {
    /// Largest shift of an estimate in standard errors; `None` where half the step cannot be simulated.
    shift: Option<f64>,
    /// Largest change of a prediction by halving the step, relative to the largest sample of its channel.
    change: f64,
}

impl GridError {
    /// The error of a fit; `None` where it is not defined, or cannot be computed.
    fn of<T>(found: &RefinedFit<T>, on_nodes: &mut OnNodes) -> Option<Self> {
        let (problem, fit) = (&found.problem, &found.fit);
        if !found.is_explained() {
            return None;
        }
        let evaluation = &fit.best.evaluation;
        let changes = match are_linear_between_nodes(evaluation) {
            true => problem.on_half_step(evaluation).map(|halved| {
                let changes = halved?.changes.into_iter().flatten();
                Some(changes.collect())
            }),
            false => Ok(None),
        };
        let changes = match changes {
            Ok(None) => changes_on_finer_grid(found, on_nodes),
            changes => changes,
        };
        let Ok(changes) = changes else {
            return Some(Self {
                shift: None,
                change: f64::INFINITY,
            });
        };
        let changes: Vec<Vec<f64>> = changes?;
        let mut change = 0.0f64;
        for (channel, of_channel) in problem.channels().zip(&changes) {
            let largest = |list: &[f64]| list.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let most = largest(of_channel);
            if most > 0.0 {
                change = change.max(most / largest(channel.observed()));
            }
        }
        let theta = &fit.best.parameters;
        let shift = problem.shift_by_steps(theta, evaluation, changes)?;
        Some(Self {
            shift: Some(shift),
            change,
        })
    }

    /// Number of nodes for the required error, if it is not reached; `before` are the nodes and the error of the grid before.
    fn wanted<T>(&self, found: &RefinedFit<T>, before: Option<(usize, Self)>) -> Option<usize> {
        let system = &found.problem.system;
        let here = nodes(&found.problem);
        let evaluation = &found.fit.best.evaluation;
        let all = std::iter::once(&evaluation.nodal).chain(&evaluation.own_nodal);
        let stable = all.map(|nodal| system.stable_nodes(nodal)).max();
        let stable = stable.filter(|stable| *stable > here);
        let finer = |factor: f64| {
            let [least, most] = FACTORS;
            1 + ((here - 1) as f64 * factor.clamp(least, most)).ceil() as usize
        };
        let accurate = match self.shift {
            None => Some(finer(2.0)),
            Some(shift) if shift <= LARGEST_ERROR || self.change <= RESOLUTION => None,
            Some(shift) => {
                let order = self.order(shift, here, before, f64::from(system.method.order()));
                let ratio = (shift / AIM).min(BEYOND * self.change / RESOLUTION);
                Some(finer(ratio.powf(1.0 / order)))
            }
        };
        stable.max(accurate)
    }

    /// Order of convergence: that of the stepper, or the observed one where it is smaller.
    fn order(
        &self,
        shift: f64,
        here: usize,
        before: Option<(usize, Self)>,
        of_stepper: f64,
    ) -> f64 {
        let observed = before.and_then(|(coarse, error)| {
            let is_small = error.change <= OTHER_SYSTEM;
            let ratio = error.shift.filter(|_| is_small)? / shift;
            Some(ratio.ln() / ((here - 1) as f64 / (coarse - 1) as f64).ln())
        });
        observed.map_or(of_stepper, |order| order.clamp(LEAST_ORDER, of_stepper))
    }

    fn limited(&self, nodes: usize) -> Option<GridNotice> {
        let error = self.shift.unwrap_or(f64::INFINITY);
        (error > LARGEST_ERROR).then_some(GridNotice::GridLimited { nodes, error })
    }
}

/// True for functions that a grid of half the step has at the same values as linear interpolation.
fn are_linear_between_nodes(evaluation: &Evaluation) -> bool {
    let sets = std::iter::once(&evaluation.nodal).chain(&evaluation.own_nodal);
    sets.flat_map(|nodal| nodal.functions()).all(|values| {
        let largest = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let bends = values.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
        bends.fold(0.0f64, |most, x| most.max(x.abs())) <= LINEAR * largest
    })
}

/// Changes of the predictions of each channel on a grid of half the step, built anew; `None` where it cannot be.
fn changes_on_finer_grid<T>(
    found: &RefinedFit<T>,
    on_nodes: &mut OnNodes,
) -> Result<Option<Vec<Vec<f64>>>, SimulationError> {
    let problem = &found.problem;
    let finer = on_nodes(2 * nodes(problem) - 1);
    let finer = finer.and_then(|finer| Some((carried(found, &finer)?, finer)));
    let Some((theta, finer)) = finer else {
        return Ok(None);
    };
    let halved = finer.evaluate(&theta)?;
    let pairs = problem.predicted(&found.fit.best.evaluation);
    let pairs = pairs.zip(halved.predictions.iter().flatten());
    let each = pairs.map(|((_, here), there)| {
        let change = || there.iter().zip(here).map(|(a, b)| a - b).collect();
        (here.len() == there.len()).then(change)
    });
    Ok(each.collect())
}

/// Parameters of a fit for the same problem on another grid; `None` for functions with one value per node.
fn carried<T>(found: &RefinedFit<T>, next: &Problem) -> Option<Vec<f64>> {
    let theta = &found.fit.best.parameters;
    let nodal = |f: &crate::functions::CoefficientFunction| f.basis == Some(Basis::Nodal);
    let is_same = theta.len() == next.parameters() && !next.functions.iter().any(nodal);
    is_same.then(|| theta.clone())
}
