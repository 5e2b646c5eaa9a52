//! First-order condition of the constrained problem, measured at the end of a fit.
//!
//! A stopping test uses the last steps, which may be short without a minimum. Therefore the problem is linearised once more at
//! the final point and solved under its constraints; the predicted decrease of J measures the distance from a minimum.

use super::iterate::Iterate;
use super::linearization::{Linearization, Reduced, linearise};
use super::reason::{ConditionFailure, Reason};
use super::termination::{Outcome, Status};
use super::timings::Timings;
use crate::constraints::TOLERANCE;
use crate::number_format::number_or_nan;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::qp::{Solution, Subproblem};
use serde::{Deserialize, Serialize};

/// Share of the zero-response misfit below which a fit is exact: its residuals are then ten digits below the measurements.
const NEGLIGIBLE: f64 = 1e-20;
/// Most memory of the linearised problem, bytes: the first-order condition of larger fits is not measured.
const MOST_MEMORY: u64 = 8_000_000_000;
/// Relative rounding error of a computed response, in units of machine precision: some thousand steps.
const MOTION_ROUNDING: f64 = 1000.0;
/// Memory of a linearised problem with many parameters: 3564 bytes per node were measured for nodal functions.
const BYTES_PER_NODE: u64 = 4000;

/// First-order condition at a point; all values are dimensionless.
///
/// With the linearised predictions `z + Z delta`, the linearised problem at the parameters `theta` is
///
/// ```text
/// minimise  L(delta) = misfit(z + Z delta) + penalties(theta + delta) + J |delta|^2
/// under the constraints at theta + delta,
/// ```
///
/// `|delta|^2 = sum_f 1/T integral (delta p_f / size of p_f)^2 dt`: a change of a function by its size costs J, so that
/// undetermined directions predict no decrease. Without constraints the decrease is `g' (4 H)^-1 g` with the gradient `g`
/// and the Gauss–Newton Hessian `2 H`, penalties and `J |.|^2` included. It is zero exactly where the Karush–Kuhn–Tucker
/// conditions hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Optimality {
    /// Predicted decrease `(J - min L) / J`, less the rounding error of the response, plus the residuals of the optimality
    /// conditions of the program, if one was solved.
    #[serde(deserialize_with = "number_or_nan")]
    pub stationarity: f64,
    /// Largest change of a function by that step, relative to its size; it converges to zero in a fit without residuals.
    #[serde(deserialize_with = "number_or_nan")]
    pub step: f64,
    /// Largest violation of a constraint, relative to its scale.
    #[serde(deserialize_with = "number_or_nan")]
    pub feasibility: f64,
    /// Complementarity `sum |multiplier| distance / J` of all bounds, with the multipliers of the linearised problem.
    #[serde(deserialize_with = "number_or_nan")]
    pub complementarity: f64,
    /// Limit of `complementarity` and of one of `stationarity` and `step` at a minimum: the tolerance of the stopping test, or
    /// [`Optimality::LEAST`].
    #[serde(deserialize_with = "number_or_nan")]
    pub tolerance: f64,
}

impl Optimality {
    /// Smallest tolerance: ten times the accuracy of a program as a share of J ([`crate::qp::Kkt::COST`] is a third of it).
    pub const LEAST: f64 = 1e-8;

    /// True if the point satisfies the first-order condition.
    pub fn holds(&self) -> bool {
        let is_flat = self.stationarity <= self.tolerance;
        let is_settled = self.step <= self.tolerance;
        (is_flat || is_settled)
            && self.complementarity <= self.tolerance
            && self.feasibility <= TOLERANCE
    }

    /// Part of the condition that is violated.
    fn failure(&self) -> ConditionFailure {
        if self.feasibility > TOLERANCE {
            return ConditionFailure::Violation(self.feasibility);
        }
        if self.complementarity > self.tolerance {
            return ConditionFailure::Complementarity(self.complementarity);
        }
        ConditionFailure::Stationarity(self.stationarity)
    }

    /// Reference cost of the shares: J, or 1e-12 of the zero-response misfit where J is less. No step lowers J by more than J, so
    /// a fit whose residuals are below 1e-10 of the measurements has a share below [`Optimality::LEAST`].
    pub fn reference(problem: &Problem, cost: f64) -> f64 {
        cost.max(NEGLIGIBLE * problem.zero_response_misfit() / Self::LEAST)
    }

    /// True if J is so small that no step can lower it by a significant share.
    pub fn is_exact(problem: &Problem, cost: f64) -> bool {
        cost <= NEGLIGIBLE * problem.zero_response_misfit()
    }

    /// Measures the condition at `point`; `None` if the linearised problem cannot be solved, or exceeds the memory limit.
    pub fn at(problem: &Problem, point: &Iterate, tolerance: f64) -> Option<Self> {
        let cost = point.evaluation.cost;
        let worst = problem.constraints.largest_violation(&point.parameters);
        let feasibility = worst.map_or(0.0, |v| v.relative);
        let reference = Self::reference(problem, cost);
        if Self::is_exact(problem, cost) {
            return Some(Self {
                stationarity: cost / reference,
                step: 0.0,
                feasibility,
                complementarity: 0.0,
                tolerance,
            });
        }
        if linearisation_memory(problem) > MOST_MEMORY {
            return None;
        }
        let (mut sub, _) = linearise(
            problem,
            &point.parameters,
            &point.evaluation,
            &Linearization::Fresh,
            &mut Timings::default(),
        );
        let scales = point.relative_metric(problem);
        for (d, s) in sub.proximal.iter_mut().zip(&scales) {
            *d = cost * s;
        }
        let found = LinearisedMinimum::of(&sub)?;
        let parameters: Vec<f64> = point
            .parameters
            .iter()
            .zip(&found.z)
            .map(|(p, d)| p + d)
            .collect();
        let promised = cost - sub.value(&found.z) + found.accuracy * cost;
        let promised = (promised - response_rounding(problem, cost)).max(0.0);
        let share = |x: f64| if x == 0.0 { 0.0 } else { x / reference };
        Some(Self {
            stationarity: share(promised),
            step: point.relative_change(problem, &parameters),
            feasibility,
            complementarity: share(found.complementarity),
            tolerance,
        })
    }
}

/// Memory of the linearised problem, bytes.
fn linearisation_memory(problem: &Problem) -> u64 {
    let (parameters, samples) = (problem.parameters(), problem.sample_count() as u64);
    if parameters > FEW_PARAMETERS {
        let nodes: usize = problem.experiments.iter().map(|e| e.nodes).sum();
        return BYTES_PER_NODE.saturating_mul(nodes as u64);
    }
    // Root and residual of a sample, and its derivatives where they are not reduced in blocks.
    let numbers = match Reduced::is_computed_by_blocks(problem) {
        true => 2,
        false => 2 + 2 * parameters as u64,
    };
    samples.saturating_mul(8 * numbers)
}

/// Change of the cost caused by the rounding error of the response, which changes a sum of squared residuals by their
/// product.
pub(super) fn response_rounding(problem: &Problem, cost: f64) -> f64 {
    let rounding = MOTION_ROUNDING * f64::EPSILON * problem.zero_response_misfit().sqrt();
    2.0 * rounding * cost.sqrt() + rounding * rounding
}

/// Minimum of a linearised problem.
struct LinearisedMinimum {
    z: Vec<f64>,
    /// Complementarity `sum |multiplier| distance` at zero, of the full cost.
    complementarity: f64,
    /// Residuals of the optimality conditions.
    accuracy: f64,
}

impl LinearisedMinimum {
    fn of(sub: &Subproblem) -> Option<Self> {
        if let Some(z) = sub
            .solve_equality_constrained()
            .filter(|z| sub.holds(z, 0.1 * TOLERANCE))
        {
            return Some(Self {
                z,
                complementarity: 0.0,
                accuracy: 0.0,
            });
        }
        let solution = sub.solve();
        if !solution.status.is_point() {
            return None;
        }
        let complementarity = complementarity(sub, &solution);
        Some(Self {
            complementarity,
            accuracy: solution.kkt.map_or(0.0, |kkt| kkt.cost()),
            z: solution.z,
        })
    }
}

/// Complementarity `2 sum |multiplier| distance` at zero; multipliers refer to half the cost.
fn complementarity(sub: &Subproblem, solution: &Solution) -> f64 {
    let bounds = sub.inequalities.right().iter().zip(&sub.upper);
    let rows = bounds.zip(&solution.multipliers);
    let distance = |((lower, upper), m): ((&f64, &f64), &f64)| match *m {
        m if m > 0.0 => m * upper.max(0.0),
        m if m < 0.0 => m * lower.min(0.0),
        _ => 0.0,
    };
    2.0 * rows.map(distance).sum::<f64>()
}

/// `converged` where the outcome claims a minimum and the condition holds, `stalled` where it does not.
pub(super) fn judged(outcome: Outcome, optimality: Option<&Optimality>) -> Outcome {
    if optimality.is_some_and(Optimality::holds) {
        return outcome;
    }
    let reason = Reason::NoMinimum {
        met: Box::new(outcome.reason),
        failure: optimality.map(Optimality::failure),
    };
    Outcome::new(Status::Stalled, reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    /// Few parameters need two numbers a sample, and not the 4000 bytes a node of a program with states.
    #[test]
    fn few_parameters_need_little_memory() {
        let times: Vec<f64> = (0..1000).map(|i| 0.05 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| (1.1 * t).cos()).collect();
        let bytes = |stiffness: CoefficientSpec| {
            let record = Record::new("decay").displacement(&times, &samples);
            let mass = CoefficientSpec::fixed(1.0);
            let parts = [mass, CoefficientSpec::constant(0.1), stiffness];
            let problem = Builder::new(parts).record(record).build();
            linearisation_memory(&problem.expect("a problem"))
        };
        assert!(bytes(CoefficientSpec::constant(1.2)) <= 1000 * 8 * 6);
        assert!(bytes(CoefficientSpec::nodal(1.2)) >= 1000 * BYTES_PER_NODE);
    }
}
