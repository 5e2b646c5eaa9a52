//! Solution of a program: attempts with different settings, each checked by the residuals of the optimality conditions.

use super::clarabel::{Ending, Settings};
use super::scaling::ScaledProgram;
use super::{Kkt, PrimalDual, Subproblem};
use crate::constraints::{Rows, TOLERANCE};

/// Status of a program, from the residuals of its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ConicStatus {
    /// Solved: the residuals are within the limits ([`Kkt::is_solution`]).
    Solved,
    /// Solved to reduced accuracy ([`Kkt::is_reduced`]): usable as a trial step or a starting point, but not as a minimum.
    Almost,
    /// A combination of the constraints proves that no point satisfies them.
    Infeasible,
    /// No attempt gave a solution or a proof of infeasibility.
    Stalled,
}

impl ConicStatus {
    /// True if there is a usable point.
    pub fn is_point(self) -> bool {
        matches!(self, ConicStatus::Solved | ConicStatus::Almost)
    }

    /// Status as a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            ConicStatus::Solved => "the quadratic program was solved",
            ConicStatus::Almost => "the quadratic program was solved to reduced accuracy",
            ConicStatus::Infeasible => {
                "no point satisfies all constraints of the quadratic program"
            }
            ConicStatus::Stalled => "the quadratic program could not be solved: its solver stalled",
        }
    }
}

/// Result of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Status.
    pub status: ConicStatus,
    /// Variables of the best point of all attempts.
    pub z: Vec<f64>,
    /// Multipliers of the inequality rows, positive at the upper bound, negative at the lower one:
    /// `gradient of (cost/2) + G^T multipliers + ... = 0`.
    pub multipliers: Vec<f64>,
    /// Multipliers of the equality rows, same convention.
    pub equality_multipliers: Vec<f64>,
    /// First component of each cone's multiplier: not negative, the decrease of half the cost per unit by which the bound of the cone is relaxed.
    pub cone_multipliers: Vec<f64>,
    /// Residuals of the optimality conditions; `None` without a finite point.
    pub kkt: Option<Kkt>,
    /// Runs of the interior-point solver.
    pub attempts: u32,
}

/// Settings of one run of the interior-point method.
struct ClarabelAttempt {
    /// Regularisation of the diagonal of its systems.
    regularisation: f64,
    units: Units,
}

/// Units of the program.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Units {
    /// Original units.
    Own,
    /// Scaled by [`ScaledProgram`].
    ScaledProgram,
}

/// Settings in the order of the attempts. No regularisation suits all programs: a large one exceeds the small coefficients of heavily weighted
/// residuals, a small one leaves nearly singular systems. The first solves most programs of the shipped models; the normalised ones are for
/// rows and variables of very different units.
const ATTEMPTS: [ClarabelAttempt; 5] = [
    ClarabelAttempt {
        regularisation: 1e-14,
        units: Units::Own,
    },
    ClarabelAttempt {
        regularisation: 1e-8,
        units: Units::Own,
    },
    ClarabelAttempt {
        regularisation: 1e-8,
        units: Units::ScaledProgram,
    },
    ClarabelAttempt {
        regularisation: 1e-12,
        units: Units::ScaledProgram,
    },
    ClarabelAttempt {
        regularisation: 1e-10,
        units: Units::Own,
    },
];

impl ScaledProgram {
    /// [`Subproblem::run_clarabel`] in these units.
    fn run(&self, settings: Settings) -> Ending {
        let ending = self.sub.run_clarabel(settings);
        match ending {
            Ending::Point(point) => Ending::Point(self.original(&self.sub.repaired(point))),
            Ending::Contradiction(proof) => Ending::Contradiction(self.original(&proof)),
            Ending::Nothing => Ending::Nothing,
        }
    }
}

impl Subproblem {
    /// Default iteration limit of Clarabel, which needs ten to thirty; programs not solved after a hundred iterations do not converge.
    pub const ITERATIONS: u32 = 100;

    /// Minimiser under all constraints.
    pub fn solve(&self) -> Solution {
        self.solve_within(Self::ITERATIONS)
    }

    /// Solution for a trial step, which is verified by a simulation: the first point of reduced accuracy ([`Kkt::is_reduced`]) ends the attempts,
    /// without a search for a proof of infeasibility.
    pub fn solve_for_step(&self) -> Solution {
        self.solve_until(Self::ITERATIONS, Kkt::is_reduced, false)
    }

    /// [`Subproblem::solve`] with at most `iterations` iterations per attempt; with zero iterations the program is stalled.
    ///
    /// Along time by the interior-point method on stages, in few variables by active sets, otherwise by Clarabel.
    ///
    /// The status of Clarabel is not used: its point is polished on its active set and accepted by its residuals, its proof of
    /// infeasibility is checked. A rejected result is followed by an attempt with other settings.
    pub fn solve_within(&self, iterations: u32) -> Solution {
        self.solve_until(iterations, Kkt::is_solution, true)
    }

    /// [`Subproblem::solve_within`] by Clarabel alone: the reference for all programs.
    pub fn solve_by_clarabel(&self, iterations: u32) -> Solution {
        (self.at_once(iterations).or_else(|| self.at_zero()))
            .unwrap_or_else(|| self.by_clarabel(iterations, Kkt::is_solution, true))
    }

    /// A step of a fit on the stages of [`Subproblem::layout`]: a point that satisfies the constraints and brings the cost down
    /// to the minimum but for [`Subproblem::STEP_GAP`] of the decrease, or the minimum itself; and by how much the cost may exceed
    /// the minimum, zero for the minimum itself. `None` where there is none.
    pub fn step_on_stages(&self, iterations: u32) -> Option<(Vec<f64>, f64)> {
        let is_usable = iterations > 0 && self.layout.is_some() && self.is_finite();
        is_usable.then_some(())?;
        let found = self.minimise_on_stages(iterations, Self::STEP_GAP)?;
        let excess = 2.0 * (found.gap + found.decrease);
        if excess <= 4.0 * Self::STEP_GAP * found.fall {
            return Some((found.point.z, excess));
        }
        let kkt = self.kkt_with_decrease(&found.point, found.decrease);
        kkt.is_solution().then_some((found.point.z, 0.0))
    }

    /// Largest excess of the cost of a step over the minimum, as a share of the decrease; the next linearisation removes it.
    const STEP_GAP: f64 = 5e-3;

    /// On stages, at zero, in few variables, and then by Clarabel, until the residuals of a point are within limits.
    fn solve_until(
        &self,
        iterations: u32,
        is_enough: impl Fn(&Kkt) -> bool,
        seeks_proof: bool,
    ) -> Solution {
        (self.at_once(iterations))
            .or_else(|| self.on_stages(iterations))
            .or_else(|| self.at_zero())
            .or_else(|| self.in_few_variables())
            .unwrap_or_else(|| self.by_clarabel(iterations, is_enough, seeks_proof))
    }

    /// The end of a program that no solver takes.
    fn at_once(&self, iterations: u32) -> Option<Solution> {
        if iterations == 0 || !self.is_finite() {
            return Some(self.refused(None, 0));
        }
        let infeasible = || self.solution(ConicStatus::Infeasible, None, 0);
        self.has_impossible_row().then(infeasible)
    }

    fn on_stages(&self, iterations: u32) -> Option<Solution> {
        let found = self.minimise_on_stages(iterations, 0.0)?;
        let kkt = self.kkt_with_decrease(&found.point, found.decrease);
        self.judged(found.point, kkt, 1)
    }

    /// Zero, where it is the minimum: with zero cost there, the interior-point method has no unit of the cost.
    fn at_zero(&self) -> Option<Solution> {
        let zero = PrimalDual::zero(self);
        let kkt = self.kkt(&zero);
        self.judged(zero, kkt, 0)
    }

    fn in_few_variables(&self) -> Option<Solution> {
        let few = self.minimum_in_few_variables();
        let (point, kkt) = few.or_else(|| self.minimum_from_zero())?;
        let is_resolved = ScaledProgram::new(self).resolves(&point.z);
        is_resolved.then(|| self.solution(ConicStatus::Solved, Some((point, kkt)), 0))
    }

    /// The solution, if its residuals are those of one.
    fn judged(&self, point: PrimalDual, kkt: Kkt, attempts: u32) -> Option<Solution> {
        let solved = || self.solution(ConicStatus::Solved, Some((point, kkt)), attempts);
        kkt.is_solution().then(solved)
    }

    /// Attempts until the residuals of a point are within limits; without such a point, with `seeks_proof` a proof of infeasibility.
    fn by_clarabel(
        &self,
        iterations: u32,
        is_enough: impl Fn(&Kkt) -> bool,
        seeks_proof: bool,
    ) -> Solution {
        let mut normalised = None;
        let mut best: Option<(PrimalDual, Kkt)> = None;
        for (attempts, attempt) in (1..).zip(ATTEMPTS) {
            let settings = Settings {
                regularisation: attempt.regularisation,
                iterations,
            };
            let ending = match attempt.units {
                Units::Own => match self.run_clarabel(settings) {
                    Ending::Point(point) => Ending::Point(self.repaired(point)),
                    ending => ending,
                },
                Units::ScaledProgram => normalised
                    .get_or_insert_with(|| ScaledProgram::new(self))
                    .run(settings),
            };
            match ending {
                Ending::Point(point) => {
                    let kkt = self.kkt(&point);
                    let normalised = normalised.get_or_insert_with(|| ScaledProgram::new(self));
                    if !normalised.resolves(&point.z) {
                        continue;
                    }
                    if is_enough(&kkt) {
                        let status = match kkt.is_solution() {
                            true => ConicStatus::Solved,
                            false => ConicStatus::Almost,
                        };
                        return self.solution(status, Some((point, kkt)), attempts);
                    }
                    if best
                        .as_ref()
                        .is_none_or(|(_, best)| kkt.is_better_than(best))
                    {
                        best = Some((point, kkt));
                    }
                }
                Ending::Contradiction(proof) if self.is_contradiction(&proof) => {
                    return self.solution(ConicStatus::Infeasible, None, attempts);
                }
                Ending::Contradiction(_) | Ending::Nothing => {}
            }
        }
        let attempts = ATTEMPTS.len() as u32;
        let normalised = normalised.unwrap_or_else(|| ScaledProgram::new(self));
        if seeks_proof && normalised.sub.has_violations(iterations) {
            return self.solution(ConicStatus::Infeasible, best, attempts);
        }
        self.refused(best, attempts)
    }

    /// Point clipped to its bounds and polished.
    fn repaired(&self, mut point: PrimalDual) -> PrimalDual {
        self.clip(&mut point.z);
        self.polish(point).0
    }

    fn refused(&self, best: Option<(PrimalDual, Kkt)>, attempts: u32) -> Solution {
        let is_reduced = best.as_ref().is_some_and(|(_, kkt)| kkt.is_reduced());
        let status = match is_reduced {
            true => ConicStatus::Almost,
            false => ConicStatus::Stalled,
        };
        self.solution(status, best, attempts)
    }

    fn solution(
        &self,
        status: ConicStatus,
        found: Option<(PrimalDual, Kkt)>,
        attempts: u32,
    ) -> Solution {
        let kkt = found.as_ref().map(|(_, kkt)| *kkt);
        let mut candidate =
            found.map_or_else(|| PrimalDual::zero(self), |(candidate, _)| candidate);
        candidate.project_multipliers(self);
        let first = |cone: &Vec<f64>| cone.first().copied().unwrap_or(0.0);
        Solution {
            status,
            multipliers: candidate.inequalities,
            equality_multipliers: candidate.equalities,
            cone_multipliers: candidate.cones.iter().map(first).collect(),
            z: candidate.z,
            kkt,
            attempts,
        }
    }

    /// Clips every variable to the bounds of single-variable rows: an interior-point method violates them by its accuracy, which may be a large
    /// share of a small variable.
    pub(super) fn clip(&self, z: &mut [f64]) {
        let mut clip = |rows: &Rows, i: usize, upper: f64| {
            let mut entries = rows.row(i).filter(|(_, a)| *a != 0.0);
            if let (Some((j, a)), None) = (entries.next(), entries.next()) {
                let (one, other) = (rows.right()[i] / a, upper / a);
                // Not clamp(), which panics for bounds that cross.
                z[j] = z[j].max(one.min(other)).min(one.max(other));
            }
        };
        for (i, upper) in self.upper.iter().enumerate() {
            clip(&self.inequalities, i, *upper);
        }
        for (i, right) in self.equalities.right().iter().enumerate() {
            clip(&self.equalities, i, *right);
        }
    }

    /// True if a single row has no solution: its bounds cross beyond the tolerance of constraints, or it has no entries and excludes zero.
    fn has_impossible_row(&self) -> bool {
        let is_impossible = |rows: &Rows, i: usize, lower: f64, upper: f64| {
            let crosses = lower > upper && lower - upper > TOLERANCE * (lower.abs() + upper.abs());
            crosses || (rows.scale(i) == 0.0 && (lower > 0.0 || upper < 0.0))
        };
        let equalities = self.equalities.right().iter().enumerate();
        let bounds = self.inequalities.right().iter().zip(&self.upper);
        let rows = bounds.enumerate();
        { equalities }.any(|(i, right)| is_impossible(&self.equalities, i, *right, *right)) || {
            rows
        }
        .any(|(i, (l, u))| is_impossible(&self.inequalities, i, *l, *u))
    }

    /// True if all coefficients are finite; bounds may be infinite on their own side.
    fn is_finite(&self) -> bool {
        let rows = [&self.residuals, &self.absolute, &self.equalities];
        let cones = self.cones.iter().map(|cone| &cone.rows);
        let finite = rows.into_iter().chain(cones).all(|rows| {
            let right = rows.right().iter().all(|b| b.is_finite());
            right && (0..rows.len()).all(|i| rows.scale(i).is_finite() && !has_nan(rows, i))
        });
        let bounds = self.inequalities.right().iter().zip(&self.upper);
        let bounded = bounds.enumerate().all(|(i, (lower, upper))| {
            let is_bound = *lower < f64::INFINITY && *upper > f64::NEG_INFINITY;
            is_bound && self.inequalities.scale(i).is_finite() && !has_nan(&self.inequalities, i)
        });
        let weights = self.proximal.iter().chain(&self.absolute_weights);
        finite && bounded && weights.fold(0.0, |sum: f64, w| sum + w).is_finite()
    }
}

fn has_nan(rows: &Rows, i: usize) -> bool {
    rows.row(i).any(|(_, a)| a.is_nan())
}
