//! Refits of a constant that jumps: between two of them the time moves to where a linearisation has the least squares.

use super::COLOURED;
use super::addition::Addition;
use super::early;
use super::found::{Found, plain};
use super::jump_basis::node_time;
use super::penalised_misfit::Linearised;
use crate::alternatives::{Minimum, with_functions};
use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::problem::Problem;
use crate::simd::sum::rms;
use crate::solvers::weighted_jacobian;
use nalgebra::{DMatrix, DVector};

/// Most refits.
const ROUNDS: usize = 6;
/// Number of times to which a jump may move in one round, and cells on either side of it in the next.
const TIMES: usize = 24;
const BESIDE: f64 = 2.0;
/// Decrease of the penalised misfit by a refit from which another follows: a sixth of what decides.
const SETTLED: f64 = 1.0;

/// Changes of a level, as shares of it, from which a jump is refitted where the response leaves that of the beginning.
const CHANGES: [f64; 8] = [-0.4, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.4];
/// Parts of a record, and ratio of mean squares, for that place.
const WINDOWS: usize = 100;
const DEPARTED: f64 = 4.0;

/// Refit with a jump that begins at `time`, with this change; where it leaves residuals far from white also from where the response leaves that
/// of the beginning.
pub(super) fn refit(
    problem: &Problem,
    theta: &[f64],
    function: usize,
    time: f64,
    change: f64,
) -> Option<Found> {
    let best = from(problem, theta, function, time, change);
    if best
        .as_ref()
        .is_some_and(|best| best.judged.order < COLOURED)
    {
        return best;
    }
    let from_beginning = || {
        let quarter = early::of_first_quarter(problem, theta)?;
        let time = departure(problem, &quarter)?;
        let level = quarter[problem.functions.ranges()[function].start];
        let addition = Addition::Jump { function, time };
        let each = CHANGES.into_iter().filter_map(|share| {
            let change = share * level;
            let (changed, start) = addition.added(problem, &quarter, &[change])?;
            Some((changed.evaluate(&start).ok()?.cost, change))
        });
        let (_, change) = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
        from(problem, &quarter, function, time, change)
    };
    let both = best.into_iter().chain(from_beginning());
    both.min_by(|a, b| a.judged.misfit.total_cmp(&b.judged.misfit))
}

/// Time at which the samples leave the response of a fit of the first quarter: the mean square of the residuals over a hundredth of a record
/// exceeds a multiple of that of the quarter.
fn departure(problem: &Problem, theta: &[f64]) -> Option<f64> {
    let evaluation = problem.evaluate(theta).ok()?;
    let times = problem
        .experiments
        .iter()
        .zip(&evaluation.predictions)
        .filter_map(|(experiment, predictions)| {
            let channel = experiment.channels.first()?;
            let residuals: Vec<f64> = channel.residuals(predictions.first()?).collect();
            let window = (residuals.len() / WINDOWS).max(1);
            let squares: Vec<f64> = residuals.chunks(window).map(|r| rms(r).powi(2)).collect();
            let quarter = squares[..squares.len().div_ceil(4)]
                .iter()
                .fold(0.0f64, |a, b| a.max(*b));
            let first = squares
                .iter()
                .position(|square| *square > DEPARTED * quarter)?;
            channel.times().get(first * window).copied()
        });
    times.reduce(f64::min)
}

/// Refits with a jump that begins at `time`, with this change, and moves.
fn from(
    problem: &Problem,
    theta: &[f64],
    function: usize,
    time: f64,
    change: f64,
) -> Option<Found> {
    let grid = &problem.system.grid;
    let first = problem.functions.ranges()[function].start;
    let mut range = [grid.start(), grid.start() + grid.duration()];
    let (mut time, mut change, mut start) = (time, change, theta.to_vec());
    let mut best: Option<Found> = None;
    for _ in 0..ROUNDS {
        let Some(found) = at(problem, &start, function, time, change) else {
            break;
        };
        if best
            .as_ref()
            .is_some_and(|best| found.judged.misfit >= best.judged.misfit)
        {
            break;
        }
        (start, change) = constants(&found, first);
        let moved = moved(problem, &found.theta, function, time, range);
        best = Some(found);
        let Some(moved) = moved else {
            break;
        };
        let cell = (range[1] - range[0]) / (TIMES + 1) as f64;
        let is_local = (moved - time).abs() < BESIDE * cell;
        // Within a step the value at the node moves it.
        if is_local && cell < grid.step() {
            break;
        }
        if is_local {
            let (start, end) = (grid.start(), grid.start() + grid.duration());
            range = [
                (moved - BESIDE * cell).max(start),
                (moved + BESIDE * cell).min(end),
            ];
        }
        time = moved;
    }
    settled(problem, best?, function)
}

/// Refits from where a refit with a jump ended, with the node nearest to its time, as long as they are better: one that comes from afar ends in
/// small steps before its minimum.
fn settled(problem: &Problem, found: Found, function: usize) -> Option<Found> {
    let first = problem.functions.ranges()[function].start;
    let mut best = found;
    for _ in 0..ROUNDS {
        let (start, change) = constants(&best, first);
        let [Addition::Jump { time, .. }] = best.additions[..] else {
            break;
        };
        let Some(found) = at(problem, &start, function, time, change) else {
            break;
        };
        let gain = best.judged.misfit - found.judged.misfit;
        if gain > 0.0 {
            best = found;
        }
        if gain < SETTLED {
            break;
        }
    }
    Some(best)
}

/// Refit with a jump at the node nearest to `time`, whose value there states the time.
fn at(problem: &Problem, start: &[f64], function: usize, time: f64, change: f64) -> Option<Found> {
    let grid = &problem.system.grid;
    let first = problem.functions.ranges()[function].start;
    let addition = Addition::Jump { function, time };
    let found = plain(problem, start, addition, &[change])?;
    let [before, at, after] = [0, 1, 2].map(|i| found.theta[first + i]);
    let within = 0.5 - (at - before) / (after - before);
    let time = node_time(grid, time) + grid.step() * within;
    Some(Found {
        additions: vec![Addition::Jump { function, time }],
        ..found
    })
}

/// The parameters with the level before the jump for that of the function, whose first is `first`, and the change.
fn constants(found: &Found, first: usize) -> (Vec<f64>, f64) {
    let theta = &found.theta;
    let start = [&theta[..=first], &theta[first + 3..]].concat();
    (start, theta[first + 2] - theta[first])
}

/// The time within a range at which a jump has the least squares, by one linearisation at the parameters `theta` with a jump at `time`.
fn moved(
    problem: &Problem,
    theta: &[f64],
    function: usize,
    time: f64,
    [from, to]: [f64; 2],
) -> Option<f64> {
    let grid = &problem.system.grid;
    let (start, end) = (grid.start(), grid.start() + grid.duration());
    let width = (to - from) / (TIMES + 1) as f64;
    let times: Vec<f64> = (1..=TIMES).map(|i| from + width * i as f64).collect();
    let inner = times.iter().copied().chain([time]);
    let mut knots: Vec<f64> = [start, end].into_iter().chain(inner).collect();
    knots.sort_by(f64::total_cmp);
    knots.dedup_by(|a, b| *a - *b < 0.5 * grid.step());
    *knots.last_mut()? = end;
    let (with_jump, _) = Addition::Jump { function, time }.added(
        problem,
        &vec![0.0; problem.parameters()],
        &[0.0],
    )?;
    let evaluation = with_jump.evaluate(theta).ok()?;
    let own = problem.functions.get(function);
    let basis = Basis::PiecewiseConstant {
        knots: knots.clone(),
    };
    let cells = knots.len() - 1;
    let mut list: Vec<CoefficientFunction> = problem.functions.iter().cloned().collect();
    list[function] = CoefficientFunction {
        owner: own.owner.clone(),
        is_known_part: own.is_known_part,
        offset: own.offset.clone(),
        ..CoefficientFunction::free(own.quantity, basis, grid, vec![0.0; cells])
    };
    let sets = problem.functions.coefficient_sets().to_vec();
    let functions = Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?
        .with_scalars(problem.functions.scalars().to_vec());
    let first = functions.ranges()[function].start;
    let jacobian = weighted_jacobian(
        &with_functions(problem, functions, Vec::new())?,
        &evaluation,
    );
    let [before, after] = [theta[first], theta[first + 2]];
    let mut residuals = Linearised::at(&with_jump, &evaluation).residuals;
    // Without the function as it is.
    for (j, knot) in knots[..cells].iter().enumerate() {
        let level = if *knot < time - 0.25 * grid.step() {
            before
        } else {
            after
        };
        residuals.axpy(-level, &jacobian.column(first + j), 1.0);
    }
    let others = (0..jacobian.ncols()).filter(|j| !(first..first + cells).contains(j));
    let others: Vec<DVector<f64>> = others.map(|j| jacobian.column(j).into_owned()).collect();
    let whole: DVector<f64> = jacobian.columns(first, cells).column_sum();
    let mut early = DVector::zeros(jacobian.nrows());
    let mut least: Option<(f64, f64)> = None;
    for (j, knot) in knots[1..cells].iter().enumerate() {
        early += jacobian.column(first + j);
        let late = &whole - &early;
        let columns: Vec<DVector<f64>> = others
            .iter()
            .cloned()
            .chain([early.clone(), late])
            .collect();
        let squares = Minimum::of(&DMatrix::from_columns(&columns), &residuals).squares;
        if least.is_none_or(|(known, _)| squares < known) {
            least = Some((squares, *knot));
        }
    }
    least.map(|(_, time)| time)
}
