//! Search for one extreme by sequential convex programming with a trust region.

use super::{Extreme, ExtremeStatus, MisfitLimit};
use crate::constraints::{self, Cone, Rows};
use crate::functions::Penalty;
use crate::identifiability::{Quantity, Target};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, Kkt, Subproblem};
use crate::record::{Channel, Loss};
use crate::solvers::{add_priors, linear_predictions};
use crate::study::refit::{positive_rms, sizes};

/// Initial size of the trust region, relative to the natural sizes of the functions.
const FIRST_RADIUS: f64 = 0.25;
/// Smallest and largest size of the trust region.
const RADII: [f64; 2] = [1e-7, 100.0];
/// Smallest gain that continues the search, relative to the size of the quantity.
const SETTLED: f64 = 1e-9;
/// Misfit limit of the convex programs as a share of the root of the stated one. A program may violate a cone by
/// [`Kkt::VIOLATION`]; the margin keeps trial points feasible.
const AIM: f64 = 1.0 - 2.0 * Kkt::VIOLATION;
/// Largest number of programs in a row without a solution: a smaller trust region does not help where the solver fails.
const FAILURES: usize = 4;
/// Largest number of corrections of one trial.
const CORRECTIONS: usize = 6;
/// Shares of the predicted gain above which a step is good and below which it is poor.
const GOOD: f64 = 0.7;
const POOR: f64 = 0.2;

/// Misfit of the samples plus the priors.
fn measure(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> f64 {
    evaluation.misfit + problem.functions.prior_cost(theta)
}

/// The search for extremes of one problem under one misfit limit.
pub struct Search<'a> {
    pub problem: &'a Problem,
    pub level: &'a MisfitLimit,
}

/// Feasible parameters with their simulation.
pub struct FeasiblePoint {
    parameters: Vec<f64>,
    evaluation: Evaluation,
    misfit: f64,
}

/// A step of the search.
struct SearchStep {
    trial: Vec<f64>,
    /// Gain predicted by the linearised problem.
    gain: f64,
    /// True if no step in the trust region has a larger predicted gain.
    is_largest: bool,
}

impl Search<'_> {
    /// Simulation at `theta`; `None` if the misfit limit, a budget or a constraint is violated.
    pub fn point(&self, theta: &[f64]) -> Option<FeasiblePoint> {
        let evaluation = self.problem.evaluate(theta).ok()?;
        let misfit = measure(self.problem, theta, &evaluation);
        let ranges = self.problem.functions.ranges();
        let rough = |(p, budget): &(Penalty, f64)| {
            p.roughness(&theta[ranges[p.function].clone()]) <= budget * (1.0 + 1e-6)
        };
        let fits = misfit <= self.level.misfit
            && self.problem.constraints.hold(theta, constraints::TOLERANCE)
            && self.level.budgets.iter().all(rough);
        fits.then(|| FeasiblePoint {
            parameters: theta.to_vec(),
            evaluation,
            misfit,
        })
    }

    /// Extreme of `target` towards `side` (-1 smallest, 1 largest) from `start`; `None` if `start` is not feasible.
    pub fn extreme(&self, start: &[f64], target: &Target, side: f64) -> Option<Extreme> {
        let at = |theta: &[f64]| target.at(self.problem, theta);
        let mut here = self.point(start)?;
        let mut quantity = at(start)?;
        let sizes = sizes(self.problem, start);
        let mut radius = FIRST_RADIUS;
        let (mut ended, mut programs, mut failures) = (ExtremeStatus::ProgramLimit, 0, 0);
        let size = size_of(&quantity, &sizes);
        let reach = self.level.reach * size;
        while programs < self.level.programs {
            let value = quantity.value;
            if side * value >= reach * (1.0 - 1e-6) {
                ended = ExtremeStatus::SearchLimit;
                break;
            }
            programs += 1;
            let proposal = self.push(&here, &quantity, side, radius, reach, &sizes);
            failures = if proposal.is_some() { 0 } else { failures + 1 };
            let gain = proposal.as_ref().map_or(0.0, |p| p.gain);
            if proposal.as_ref().is_some_and(|p| p.is_largest) && gain <= SETTLED * size {
                ended = ExtremeStatus::Converged;
                break;
            }
            let next = proposal.and_then(|p| self.restored(p.trial, &sizes));
            let next = next.and_then(|n| Some((at(&n.parameters)?, n)));
            let gained = next
                .as_ref()
                .map_or(f64::NAN, |(there, _)| side * (there.value - value));
            match next {
                Some(next) if gained > 1e-3 * gain && gained > 0.0 => {
                    (quantity, here) = next;
                    if gained > GOOD * gain {
                        radius = (2.0 * radius).min(RADII[1]);
                    } else if gained < POOR * gain {
                        radius *= 0.5;
                    }
                }
                _ => radius *= 0.25,
            }
            if radius < RADII[0] || failures == FAILURES {
                ended = ExtremeStatus::NoFeasibleStep;
                break;
            }
        }
        Some(Extreme {
            function: quantity.name,
            time: target.time(),
            largest: side > 0.0,
            value: quantity.value,
            parameters: here.parameters,
            misfit: here.misfit,
            ended,
            programs,
        })
    }

    /// The problem linearised about `theta`: misfit limit as a cone, constraints and budgets, in variables scaled by
    /// `units`.
    fn linearised(&self, theta: &[f64], evaluation: &Evaluation) -> Subproblem {
        let mut sub = linear_predictions(self.problem, evaluation);
        let surplus = self.surplus(&sub, evaluation);
        add_priors(self.problem, theta, &mut sub);
        let samples = std::mem::take(&mut sub.residuals);
        sub.residuals = Rows::new();
        let left = (self.level.misfit - surplus).max(f64::MIN_POSITIVE.sqrt());
        sub.cones.push(ball(&samples, AIM * left.sqrt()));
        let ranges = self.problem.functions.ranges();
        for (penalty, budget) in &self.level.budgets {
            let range = ranges[penalty.function].clone();
            let mut rows = Rows::new();
            let residuals = penalty.residuals(&theta[range.clone()]);
            for (i, r) in residuals.iter().enumerate() {
                let row = penalty.rows.row(i).map(|(j, a)| (range.start + j, a));
                rows.push(row, -r);
            }
            sub.cones.push(ball(&rows, budget.sqrt()));
        }
        sub.constrain(&self.problem.constraints, theta);
        sub
    }

    /// Misfit minus its weighted squares, zero for least squares. The quadratic majorant of a robust loss lies above the
    /// loss and touches it at the current point, so a step feasible for the majorant is feasible for the loss.
    fn surplus(&self, samples: &Subproblem, evaluation: &Evaluation) -> f64 {
        let plain = |c: &Channel| c.loss() == Loss::Squares;
        if self.problem.channels().all(plain) {
            return 0.0;
        }
        let squares: f64 = samples.residuals.right().iter().map(|r| r * r).sum();
        evaluation.misfit - squares
    }

    /// Units of the unknowns: natural sizes of parameters, sizes of the responses for states.
    fn units(&self, sub: &Subproblem, evaluation: &Evaluation, sizes: &[f64]) -> Vec<f64> {
        let mut units = sizes.to_vec();
        if sub.variables > sizes.len() {
            for response in &evaluation.trajectories {
                let pair = [response.displacement(0), response.velocity(0)].map(positive_rms);
                units.extend((1..response.nodes()).flat_map(|_| pair));
            }
        }
        units.resize(sub.variables, 1.0);
        units
    }

    /// Step with the largest gain in the linearised problem.
    fn push(
        &self,
        here: &FeasiblePoint,
        quantity: &Quantity,
        side: f64,
        radius: f64,
        reach: f64,
        sizes: &[f64],
    ) -> Option<SearchStep> {
        let theta = &here.parameters;
        let slopes = &quantity.gradient;
        let mut sub = self.linearised(theta, &here.evaluation);
        for (j, size) in sizes.iter().enumerate() {
            sub.bound([(j, 1.0)], -radius * size, radius * size);
        }
        // A target beyond the trust region, where the objective "distance to the target" is linear.
        let most: f64 = slopes
            .iter()
            .map(|(j, a)| (a * sizes[*j] * radius).abs())
            .sum();
        let most = most.max(f64::MIN_POSITIVE);
        let row: Vec<(usize, f64)> = slopes.iter().map(|(j, a)| (*j, side * a / most)).collect();
        let left = (reach - side * quantity.value) / most;
        sub.bound(row.iter().copied(), f64::NEG_INFINITY, left.max(0.0));
        sub.absolute.push(row.iter().copied(), 1.0);
        sub.absolute_weights.push(1.0);
        let (delta, is_largest) = self.solved(&sub, &here.evaluation, sizes)?;
        let gain: f64 = row.iter().map(|(j, a)| a * delta[*j]).sum();
        Some(SearchStep {
            trial: self.problem.constraints.moved(theta, &delta),
            gain: gain * most,
            is_largest,
        })
    }

    /// Parameter changes that solve a linearised problem, and the optimality of the solution. Each trial is simulated, so a
    /// feasible point is usable although it may not be optimal.
    fn solved(
        &self,
        sub: &Subproblem,
        evaluation: &Evaluation,
        sizes: &[f64],
    ) -> Option<(Vec<f64>, bool)> {
        let units = self.units(sub, evaluation, sizes);
        let solution = sub.in_units(&units).solve_for_step();
        let is_within = (solution.kkt).is_some_and(|kkt| kkt.feasibility <= Kkt::REDUCED);
        let is_point = is_within && solution.status != ConicStatus::Infeasible;
        is_point.then(|| {
            let pairs = solution.z.iter().zip(&units).take(sizes.len());
            let delta = pairs.map(|(z, unit)| z * unit).collect();
            (delta, solution.status == ConicStatus::Solved)
        })
    }

    /// Trial restored to the misfit limit by successive smallest changes, each for the linearisation at the previous point;
    /// `None` if that fails.
    fn restored(&self, trial: Vec<f64>, sizes: &[f64]) -> Option<FeasiblePoint> {
        let mut theta = trial;
        let mut before = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            if let Some(point) = self.point(&theta) {
                return Some(point);
            }
            let evaluation = self.problem.evaluate(&theta).ok()?;
            let misfit = measure(self.problem, &theta, &evaluation);
            if misfit > before {
                return None;
            }
            before = misfit;
            let mut sub = self.linearised(&theta, &evaluation);
            for (d, size) in sub.proximal.iter_mut().zip(sizes) {
                *d = 1.0 / (size * size);
            }
            // The proximal term vanishes at a zero step and gives no scale; a constant does.
            sub.constant = 1.0;
            let (delta, _) = self.solved(&sub, &evaluation, sizes)?;
            theta = self.problem.constraints.moved(&theta, &delta);
        }
        self.point(&theta)
    }
}

/// Cone `|F z - f| <= radius`, divided by the radius.
fn ball(rows: &Rows, radius: f64) -> Cone {
    let mut cone = Rows::new();
    cone.push([], -1.0);
    for i in 0..rows.len() {
        cone.push(
            rows.row(i).map(|(j, a)| (j, a / radius)),
            rows.right()[i] / radius,
        );
    }
    Cone { rows: cone }
}

/// Natural size of a quantity, from the sizes of its parameters.
fn size_of(quantity: &Quantity, sizes: &[f64]) -> f64 {
    let slopes = quantity.gradient.iter();
    let change: f64 = slopes.map(|(j, a)| (a * sizes[*j]).abs()).sum();
    change.max(quantity.value.abs()).max(f64::MIN_POSITIVE)
}
