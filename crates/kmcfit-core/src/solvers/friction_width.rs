//! Reduction of an automatic width of Coulomb friction: fits with smaller widths until the estimates do not depend on it.
//!
//! After a fit, one Gauss-Newton step gives the shift of the estimates where the width is halved ([`Problem::shifts_by_width`]). The
//! shift is proportional to the width where the mass sticks, and smaller otherwise, which gives the next width. Its grid has stable
//! steps for friction at rest and is refined as any automatic grid.

use super::grid_refinement::{OnNodes, RefinedFit, RunFit, carried, fit_on_refined_grids, nodes};
use super::observer::Observer;
use super::rounds::is_ended;
use crate::number_format::significant;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use serde::Serialize;
use std::fmt;

/// Largest shift of an estimate by half the width, in standard errors.
const LARGEST_SHIFT: f64 = 0.1;
/// Shift at which a smaller width aims.
const AIM: f64 = 0.06;
/// Smallest and largest factor from one width to the next.
const FACTORS: [f64; 2] = [2.0, 16.0];
/// Largest number of smaller widths.
const ROUNDS: usize = 10;

/// Notice on an automatic width of Coulomb friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WidthNotice {
    /// The first width was reduced.
    WidthReduced {
        /// First width, m/s.
        from: f64,
        /// Last width, m/s.
        width: f64,
        /// Nodes of its grid.
        nodes: usize,
        /// Largest shift of an estimate by half of it, in standard errors.
        shift: f64,
    },
    /// The estimates depend on the smallest width that the grid permits.
    WidthLimited {
        /// Width, m/s.
        width: f64,
        /// Nodes.
        nodes: usize,
        /// Largest shift of an estimate by half the width, in standard errors.
        shift: f64,
    },
}

impl fmt::Display for WidthNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WidthReduced {
                from,
                width,
                nodes,
                shift,
            } => write!(
                f,
                "friction: width reduced from {} to {} m/s on {nodes} nodes; half of it shifts the estimates by {} standard errors",
                significant(*from, 2),
                significant(*width, 2),
                significant(*shift, 2)
            ),
            Self::WidthLimited {
                width,
                nodes,
                shift,
            } => write!(
                f,
                "friction: with {nodes} nodes the smallest width is {} m/s, half of which shifts the estimates by {} standard \
                 errors; set a larger `grid.nodes`",
                significant(*width, 2),
                significant(*shift, 2)
            ),
        }
    }
}

/// [`fit_on_refined_grids`] with smaller widths of Coulomb friction while half the width shifts an estimate by more than a tenth of a
/// standard error. Fits that keep their grid keep their width as well.
///
/// # Errors
/// A [`SimulationError`] if the first fit fails.
pub fn fit_on_reduced_widths<T>(
    problem: &Problem,
    start: &[f64],
    most: usize,
    on_nodes: &mut OnNodes,
    run: &mut RunFit<T>,
    watch: &mut Observer,
) -> Result<(RefinedFit<T>, Vec<WidthNotice>), SimulationError> {
    let mut found = fit_on_refined_grids(problem, start, most, on_nodes, run, watch)?;
    let mut notices = Vec::new();
    let Some(from) = problem.system.friction_width() else {
        return Ok((found, notices));
    };
    let mut width = from;
    let mut shift = largest_shift(&found);
    for _ in 0..ROUNDS {
        let Some(here) = shift.filter(|shift| *shift > LARGEST_SHIFT) else {
            break;
        };
        let narrower = |narrow| next(&found, narrow, most, on_nodes);
        let Some(next) = narrow_width(&found, width, here, most).and_then(narrower) else {
            break;
        };
        let narrow = next.system.friction_width().unwrap_or(width);
        let mut on_these = |least| with_width(on_nodes(least)?, narrow);
        let start = carried(&found, &next).unwrap_or_else(|| next.start());
        let Ok(fit) = fit_on_refined_grids(&next, &start, most, &mut on_these, run, watch) else {
            break;
        };
        found = RefinedFit {
            notices: fit.notices,
            ..found.followed_by(fit.further, fit.problem, fit.fit)
        };
        width = narrow;
        shift = largest_shift(&found);
    }
    let nodes = nodes(&found.problem);
    if width < from && !is_ended(&found.fit) {
        if let Ok(evaluation) = found.problem.evaluate(&found.problem.start()) {
            found.fit.initial_cost = evaluation.cost;
        }
        notices.extend(shift.map(|shift| WidthNotice::WidthReduced {
            from,
            width,
            nodes,
            shift,
        }));
    }
    if let Some(shift) = shift.filter(|shift| *shift > LARGEST_SHIFT) {
        notices.push(WidthNotice::WidthLimited {
            width,
            nodes,
            shift,
        });
    }
    Ok((found, notices))
}

/// The problem with another width, m/s.
fn with_width(problem: Problem, width: f64) -> Option<Problem> {
    let change = |parts: &mut crate::problem::ProblemParts| parts.system.set_friction_width(width);
    problem.with(change).ok()
}

/// Largest shift of an estimate by half the width, in standard errors; `None` where it is not defined.
fn largest_shift<T>(found: &RefinedFit<T>) -> Option<f64> {
    if !found.is_explained() {
        return None;
    }
    let best = &found.fit.best;
    let shifts = found
        .problem
        .shifts_by_width(&best.parameters, &best.evaluation)?;
    let in_errors = shifts.iter().map(|[shift, error]| shift.abs() / error);
    Some(in_errors.filter(|x| !x.is_nan()).fold(0.0, f64::max))
}

/// The next width for a `shift` by half the present one: at least that of stable steps on the most nodes; `None` where that is not
/// smaller.
fn narrow_width<T>(found: &RefinedFit<T>, width: f64, shift: f64, most: usize) -> Option<f64> {
    let [least, largest] = FACTORS;
    let wanted = width / (shift / AIM).clamp(least, largest);
    let system = &found.problem.system;
    let evaluation = &found.fit.best.evaluation;
    let all = std::iter::once(&evaluation.nodal).chain(&evaluation.own_nodal);
    let widths = all.map(|nodal| system.least_friction_width(nodal, most));
    let limit = widths.fold(0.0, f64::max);
    let next = wanted.max(limit);
    (next < 0.9 * width).then_some(next)
}

/// The problem with this width, on a grid with stable steps.
fn next<T>(
    found: &RefinedFit<T>,
    width: f64,
    most: usize,
    on_nodes: &mut OnNodes,
) -> Option<Problem> {
    let system = &found.problem.system;
    let evaluation = &found.fit.best.evaluation;
    let all = std::iter::once(&evaluation.nodal).chain(&evaluation.own_nodal);
    let stable = all.map(|nodal| system.nodes_for_friction(nodal, width));
    let least = stable.fold(nodes(&found.problem), usize::max);
    with_width(on_nodes(least.min(most))?, width)
}
