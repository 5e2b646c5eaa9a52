//! Equation-error method: minimises the residual of the equation of motion, one convex problem.

use super::equation::{Equation, EquationForm, Equations};
use super::widths;
use super::{Accuracy, ConvexMinimum, minimise};
use crate::host::Instant;
use crate::objective::{Evaluation, Gradient};
use crate::problem::Problem;
use crate::qp::{ConicStatus, StageLayout, Subproblem};
use crate::record::Measurements;
use crate::solvers::fit::Fit;
use crate::solvers::history::{IterationRecord, ratio};
use crate::solvers::iterate::Iterate;
use crate::solvers::linearization::{add_penalties, add_variations};
use crate::solvers::optimality::{Optimality, judged};
use crate::solvers::reason::{Reason, UnsupportedRecord};
use crate::solvers::solve_counts::SolveCounts;
use crate::solvers::termination::{Outcome, Status};
use crate::solvers::timings::{Timings, timed};

/// Factor between a function and its start beyond which the problem is solved again, and the number of repetitions.
const FAR: f64 = 1e4;
const AGAIN: usize = 3;
/// Relative rounding error of a term of the equation of motion, with derivatives of smoothed samples and parameters of the
/// accuracy of a factorisation.
const TERM_ROUNDING: f64 = 1000.0 * f64::EPSILON;
/// Most solutions of the reweighted problem of a robust loss with a new scale each, and with the last scale; they end earlier where
/// the cost no longer falls.
const SCALES: usize = 20;
const REWEIGHTINGS: usize = 200;
/// Most restorations of the state of nonlinear terms; they end earlier where the cost no longer falls.
const RESTORATIONS: usize = 8;
/// Relative decrease of the cost of a robust loss below which it has converged: a hundredth of [`Optimality::LEAST`].
const DECREASE: f64 = 1e-10;

/// Minimises over the samples of all experiments
///
/// ```text
/// J = integral (m (y'' + b'') + sum_j p_j phi_j(y, y') - f)^2 dt + penalties      (N^2 s)
/// ```
///
/// with `y`, `y'`, `y''` from the samples ([`Measurements`]) and equal weights; in the weak form ([`Equations`]) of the averages of the
/// parenthesis by bump functions. A robust loss of the channels acts on these residuals, in units of their scale. Nothing is simulated:
/// the trajectories of the fit are the measured responses, the predictions those of the equation of motion. Scalars keep their start
/// values.
pub fn fit(problem: &Problem, start: &[f64], observe: &mut dyn FnMut(&IterationRecord)) -> Fit {
    let clock = Instant::now();
    let mut timings = Timings::default();
    let measurements = timed(&mut timings.start, || {
        Measurements::with_scalars(problem, problem.scalars(start))
    });
    let measurements = match measurements {
        Ok(measurements) => measurements,
        Err(reason) => return failed(problem, start, reason),
    };
    let mut cost = Cost::of(problem, &measurements);
    let minimum = cost.minimise(start, &mut timings);
    // With the scales of robust losses at the minimum.
    let first = cost.point(start.to_vec());
    let mut counts = SolveCounts::default();
    let mut optimality = None;
    let (outcome, found) = match minimum {
        Ok((minimum, programs)) => {
            counts.qp = programs;
            let point = cost.point(minimum.parameters.clone());
            let nodal = &point.evaluation.nodal;
            let has_mass = nodal.inertias[0].iter().all(|m| *m > 0.0);
            let reason = reason(problem, &minimum, has_mass);
            let status = match minimum.program {
                Some(ConicStatus::Almost) => Status::Stalled,
                _ if !has_mass => Status::Infeasible,
                _ => Status::Converged,
            };
            let mut outcome = Outcome::new(status, reason);
            if problem.parameters() > 0 {
                optimality = cost.optimality(&point, &minimum, &mut timings);
                if status == Status::Converged {
                    outcome = judged(outcome, optimality.as_ref());
                }
            }
            (outcome, Some(point))
        }
        Err(status) => {
            counts.qp = 1;
            let word = match status {
                ConicStatus::Infeasible => Status::Infeasible,
                _ => Status::Stalled,
            };
            (Outcome::new(word, Reason::Program(status)), None)
        }
    };
    let history: Vec<IterationRecord> = (found.iter())
        .map(|best| row(problem, &first, best))
        .collect();
    history.iter().for_each(observe);
    Fit {
        initial_cost: first.evaluation.cost,
        started_from: first.evaluation.cost,
        initial_norm_squared: first.gradient.norm_squared,
        best: found.unwrap_or(first),
        history,
        snapshots: Vec::new(),
        outcome,
        counts,
        timings,
        elapsed: clock.elapsed(),
        attempts: Vec::new(),
        optimality,
    }
}

fn reason(problem: &Problem, minimum: &ConvexMinimum, has_mass: bool) -> Reason {
    if problem.functions.iter().all(|f| f.parameters() == 0) {
        return Reason::NoParameters;
    }
    Reason::EquationError {
        program: minimum.program,
        has_mass,
    }
}

/// Single row of the history.
fn row(problem: &Problem, first: &Iterate, best: &Iterate) -> IterationRecord {
    IterationRecord {
        iteration: 1,
        cost: best.evaluation.cost,
        cost_ratio: ratio(best.evaluation.cost, first.evaluation.cost),
        gradient_norm_squared_ratio: ratio(
            first.gradient.norm_squared,
            first.gradient.norm_squared,
        ),
        step: 1.0,
        relative_change: first.relative_change(problem, &best.parameters),
    }
}

/// Result of a fit whose samples do not provide a response: the start, without a cost.
fn failed(problem: &Problem, start: &[f64], reason: UnsupportedRecord) -> Fit {
    let mut evaluation = problem.workspace();
    evaluation.nodal = problem.functions.nodal(start);
    for (samples, experiment) in evaluation.predictions.iter_mut().zip(&problem.experiments) {
        for (predicted, channel) in samples.iter_mut().zip(&experiment.channels) {
            *predicted = vec![f64::NAN; channel.len()];
        }
    }
    Fit {
        best: Iterate::new(
            start.to_vec(),
            evaluation,
            Gradient {
                euclidean: vec![f64::NAN; start.len()],
                l2: vec![f64::NAN; start.len()],
                norm_squared: f64::NAN,
            },
        ),
        initial_cost: f64::NAN,
        started_from: f64::NAN,
        initial_norm_squared: f64::NAN,
        history: Vec::new(),
        snapshots: Vec::new(),
        outcome: Outcome::new(Status::Failed, Reason::UnsupportedRecord(reason)),
        counts: SolveCounts::default(),
        timings: Timings::default(),
        elapsed: std::time::Duration::ZERO,
        attempts: Vec::new(),
        optimality: None,
    }
}

/// Cost of the equation error.
struct Cost<'a> {
    problem: &'a Problem,
    measurements: &'a Measurements,
    equations: Equations<'a>,
}

impl<'a> Cost<'a> {
    fn of(problem: &'a Problem, measurements: &'a Measurements) -> Self {
        widths::choose(problem, measurements);
        Self {
            problem,
            measurements,
            equations: Equations::of(problem, measurements),
        }
    }

    /// Minimum of the cost and the number of quadratic programs. The nonlinear terms are those of a state that is restored with the
    /// parameters of the previous minimum, until the cost no longer falls.
    fn minimise(
        &mut self,
        start: &[f64],
        timings: &mut Timings,
    ) -> Result<(ConvexMinimum, u64), ConicStatus> {
        let (mut minimum, mut programs) = self.minimise_losses(start, timings)?;
        for _ in 0..RESTORATIONS {
            let parameters = &minimum.parameters;
            let is_lower = timed(&mut timings.linear_algebra, || {
                self.equations.restore(self.problem, parameters)
            });
            if !is_lower {
                break;
            }
            let (next, more) = self.minimise_losses(parameters, timings)?;
            programs += more;
            minimum = next;
        }
        Ok((minimum, programs))
    }

    /// Minimum of the cost and the number of quadratic programs. With a robust loss the least-squares problem is solved again with the
    /// weights and the scale of the residuals, then with the weights alone, until the cost no longer decreases.
    fn minimise_losses(
        &mut self,
        start: &[f64],
        timings: &mut Timings,
    ) -> Result<(ConvexMinimum, u64), ConicStatus> {
        let (mut minimum, mut programs) = self.minimise_squares(start, timings)?;
        if !self.equations.are_robust() || self.problem.parameters() == 0 {
            return Ok((minimum, programs));
        }
        for round in 0..SCALES + REWEIGHTINGS {
            if round < SCALES {
                self.equations.set_scales(self.problem, &minimum.parameters);
            }
            let next = self.minimise_from(&minimum.parameters, timings)?;
            programs += u64::from(next.program.is_some());
            let [before, after] = [&minimum, &next].map(|m| self.cost(&m.parameters));
            let is_lower = after < before;
            if is_lower {
                minimum = next;
            }
            if !is_lower || before - after <= DECREASE * after {
                break;
            }
        }
        Ok((minimum, programs))
    }

    /// Minimum for the present weights and the number of quadratic programs. Where a function is far smaller than its start, the problem
    /// is solved again from the minimum: the unknown is the step, whose rounding error otherwise exceeds the function.
    fn minimise_squares(
        &self,
        start: &[f64],
        timings: &mut Timings,
    ) -> Result<(ConvexMinimum, u64), ConicStatus> {
        let mut minimum = self.minimise_from(start, timings)?;
        let mut programs = u64::from(minimum.program.is_some());
        let mut from = self.measurements.sizes(self.problem, start);
        for _ in 0..AGAIN {
            let sizes = self.measurements.sizes(self.problem, &minimum.parameters);
            let far = |(from, size): (&f64, &f64)| *from > FAR * size;
            if !from.iter().zip(&sizes).any(far) {
                break;
            }
            let Ok(next) = self.minimise_from(&minimum.parameters, timings) else {
                break;
            };
            programs += u64::from(next.program.is_some());
            minimum = next;
            from = sizes;
        }
        Ok((minimum, programs))
    }

    /// First-order condition at `point`, the `minimum`. The problem is convex, so solving it again from there gives the excess
    /// of its cost over the minimum, of J and of the proximal term that determines the remaining directions. `None` if it cannot
    /// be solved again.
    fn optimality(
        &self,
        point: &Iterate,
        minimum: &ConvexMinimum,
        timings: &mut Timings,
    ) -> Option<Optimality> {
        let problem = self.problem;
        // Not counted, so not timed as a program.
        let mut own = Timings::default();
        let again = self.minimise_from(&point.parameters, &mut own);
        timings.linear_algebra += own.sum();
        let again = again.ok()?;
        let here = point.evaluation.cost;
        let cost = |theta: &[f64]| self.point(theta.to_vec()).evaluation.cost + minimum.pull(theta);
        let gap = cost(&point.parameters) - cost(&again.parameters);
        let gap = (gap - self.rounding(point)).max(0.0);
        let worst = problem.constraints.largest_violation(&point.parameters);
        Some(Optimality {
            stationarity: gap / Optimality::reference(problem, here),
            step: point.relative_change(problem, &again.parameters),
            feasibility: worst.map_or(0.0, |v| v.relative),
            complementarity: again.kkt.map_or(0.0, |kkt| kkt.complementarity),
            tolerance: Optimality::LEAST,
        })
    }

    /// Rounding error of J at `point`: that of the terms of the equation of motion, which cancel where it holds. With doubled
    /// parameters the error is the sum of their terms.
    fn rounding(&self, point: &Iterate) -> f64 {
        let twice: Vec<f64> = point.parameters.iter().map(|p| 2.0 * p).collect();
        let terms = self.point(twice).evaluation.misfit;
        let rounding = TERM_ROUNDING * terms.sqrt();
        2.0 * rounding * point.evaluation.cost.sqrt() + rounding * rounding
    }

    fn minimise_from(
        &self,
        start: &[f64],
        timings: &mut Timings,
    ) -> Result<ConvexMinimum, ConicStatus> {
        let problem = self.problem;
        let sub = timed(&mut timings.linear_algebra, || self.assembled(start));
        let sizes = self.measurements.sizes(problem, start);
        let excess = |theta: &[f64]| self.excess(theta);
        let optimum = Accuracy::Optimum;
        minimise(problem, sub, start, &sizes, optimum, &excess, timings)
    }

    /// Squares of J in steps from `start`, without constraints; with a robust loss those of its majorant that touches J there.
    fn assembled(&self, start: &[f64]) -> Subproblem {
        let problem = self.problem;
        let mut sub = Subproblem::new(problem.parameters());
        match self.equations.form {
            EquationForm::Pointwise => {
                sub.elimination_order = problem.functions.first_nodes();
                sub.layout = StageLayout::of(&problem.functions);
            }
            // A bump function has parameters of many nodes, of which there are few.
            EquationForm::Weak => sub.elimination_order = vec![0; problem.parameters()],
        }
        for equation in &self.equations.list {
            let residuals = equation.residuals_at(problem, start);
            let root = |e: f64| (equation.weight() * equation.loss.weight(e)).sqrt();
            equation.add_rows(problem, &residuals, root, &mut sub);
        }
        add_penalties(problem, start, &mut sub);
        add_variations(problem, start, &mut sub);
        self.add_soft(start, &mut sub);
        sub
    }

    /// Adds soft constraints with their excess as further variables: `lower <= a theta - excess <= upper`, penalty
    /// `weight excess^2`.
    fn add_soft(&self, start: &[f64], sub: &mut Subproblem) {
        for group in &self.problem.soft {
            let excess = sub.add_variables(group.rows.len());
            let root = group.row_weight().sqrt();
            for (i, &e) in excess.iter().enumerate() {
                sub.residuals.push([(e, root)], 0.0);
                let value: f64 = group.rows.row(i).map(|(j, a)| a * start[j]).sum();
                let [lower, upper] = group.bounds(i).map(|bound| bound - value);
                let row = group.rows.row(i).chain([(e, -1.0)]);
                sub.bound(row, lower, upper);
            }
        }
    }

    fn excess(&self, theta: &[f64]) -> Vec<f64> {
        let groups = self.problem.soft.iter();
        groups
            .flat_map(|group| (0..group.rows.len()).map(|i| group.excess(i, theta)))
            .collect()
    }

    fn misfit(&self, theta: &[f64]) -> f64 {
        let of_record = |e: &Equation| e.misfit(&e.residuals_at(self.problem, theta));
        self.equations.list.iter().map(of_record).sum()
    }

    /// The cost J.
    fn cost(&self, theta: &[f64]) -> f64 {
        self.misfit(theta) + self.problem.regularisation(theta)
    }

    /// Iterate at the parameters `theta`.
    fn point(&self, theta: Vec<f64>) -> Iterate {
        let problem = self.problem;
        let mut evaluation = problem.workspace();
        problem.set_parameters(&theta, &mut evaluation);
        evaluation.misfit = self.misfit(&theta);
        evaluation.regularisation = problem.regularisation(&theta);
        evaluation.cost = evaluation.misfit + evaluation.regularisation;
        self.report_responses(&mut evaluation);
        let gradient = self.gradient(&theta);
        Iterate::new(theta, evaluation, gradient)
    }

    /// Sets the measured responses and the predictions of the equation of motion.
    fn report_responses(&self, evaluation: &mut Evaluation) {
        let problem = self.problem;
        for (e, measured) in self.measurements.experiments.iter().enumerate() {
            let Some(measured) = measured else { continue };
            let experiment = &problem.experiments[e];
            evaluation.trajectories[e] =
                measured.trajectory(&problem.system.grid, experiment.nodes);
            let view = problem.view(evaluation, e);
            let channels = experiment.channels.iter();
            let predictions = channels.map(|channel| measured.predict(problem, channel, view));
            evaluation.predictions[e] = predictions.collect();
        }
    }

    fn gradient(&self, theta: &[f64]) -> Gradient {
        let problem = self.problem;
        let mut euclidean = problem.penalty_gradient(theta);
        for equation in &self.equations.list {
            equation.add_gradient(problem, theta, &mut euclidean);
        }
        let l2 = problem.functions.gram_solve(&euclidean);
        Gradient {
            norm_squared: problem.functions.norm_squared(&l2),
            euclidean,
            l2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;
    use crate::system::Grid;

    /// Accelerations at every fifth quarter of a step under a motion of the base, and displacements at the nodes under a force; ten
    /// seconds for the pointwise form, and a hundred for the weak one.
    fn problem(form: EquationForm) -> Problem {
        let times = match form {
            EquationForm::Pointwise => 1,
            EquationForm::Weak => 10,
        };
        let grid = Grid::new(0.0, 10.0 * times as f64, 200 * times + 1).expect("a grid");
        let nodes = grid.times();
        let spaced = (0..=160 * times).map(|i| 0.0625 * i as f64);
        let spaced: Vec<f64> = spaced.collect();
        let at = |times: &[f64], f: fn(f64) -> f64| -> Vec<f64> {
            times.iter().map(|t| f(*t)).collect()
        };
        let shaken = Record::new("shaken")
            .base_acceleration(&nodes, &at(&nodes, |t| (1.1 * t).sin()))
            .acceleration(&spaced, &at(&spaced, |t| (2.0 * t).cos()))
            .sigma(0.1);
        let driven = Record::new("driven")
            .force(&nodes, &at(&nodes, |t| (1.5 * t).sin()))
            .displacement(&nodes, &at(&nodes, |t| 0.3 * (1.5 * t).cos()))
            .sigma(0.1);
        let parts = [
            CoefficientSpec::constant(1.3),
            CoefficientSpec::piecewise_linear(3, 0.2).tikhonov(1, 0.7),
            CoefficientSpec::piecewise_linear(4, 5.0).tikhonov(2, 0.4),
        ];
        let builder = Builder::new(parts).record(shaken).record(driven).grid(grid);
        builder.build().expect("a problem")
    }

    /// Parameters near the start, different for each `seed`.
    fn near_start(problem: &Problem, seed: usize) -> Vec<f64> {
        let start = problem.start().into_iter().enumerate();
        let factor = |j: usize| 1.0 + 0.4 * ((3 * seed + j) as f64).sin();
        start.map(|(j, p)| p * factor(j)).collect()
    }

    /// The cost is a square of the parameters, so central differences have rounding errors alone.
    #[test]
    fn the_gradient_is_that_of_the_cost_at_nodes_and_between() {
        check_gradient(EquationForm::Pointwise);
    }

    #[test]
    fn the_gradient_is_that_of_the_cost_in_the_weak_form() {
        check_gradient(EquationForm::Weak);
    }

    fn check_gradient(form: EquationForm) {
        let problem = problem(form);
        let measurements = Measurements::of(&problem).expect("two responses");
        let cost = Cost::of(&problem, &measurements);
        assert_eq!(cost.equations.form, form);
        let theta = near_start(&problem, 1);
        let gradient = cost.gradient(&theta).euclidean;
        let size = gradient.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        for (j, found) in gradient.iter().enumerate() {
            let step = 0.5 * theta[j];
            let at = |step: f64| {
                let mut moved = theta.clone();
                moved[j] += step;
                cost.point(moved).evaluation.cost
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            let off = (found - difference).abs();
            assert!(off <= 1e-12 * size, "{j}: {found} {difference}");
        }
    }

    #[test]
    fn the_assembled_squares_are_the_cost() {
        for form in [EquationForm::Pointwise, EquationForm::Weak] {
            let problem = problem(form);
            let measurements = Measurements::of(&problem).expect("two responses");
            let cost = Cost::of(&problem, &measurements);
            for seed in 0..3 {
                let [from, to] = [seed, seed + 1].map(|seed| near_start(&problem, seed));
                let step: Vec<f64> = to.iter().zip(&from).map(|(to, from)| to - from).collect();
                let found = cost.assembled(&from).value(&step);
                let expected = cost.point(to).evaluation.cost;
                assert!(
                    (found - expected).abs() <= 1e-12 * expected,
                    "{found} {expected}"
                );
            }
        }
    }
}
