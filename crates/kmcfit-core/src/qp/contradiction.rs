//! Proofs of infeasibility of a program (Farkas' lemma), checked in floating-point arithmetic.

use super::clarabel::{Ending, Settings};
use super::{PrimalDual, Subproblem};
use crate::constraints::{Cone, Rows, TOLERANCE};

/// Distance, in natural sizes of the variables, up to which a proof must exclude feasible points: a nonzero slope of the combination
/// admits points far out.
const REACH: f64 = 1e3;
/// Shares of the largest multiplier below which multipliers are taken as zeros of an interior-point method. A valid proof without them
/// is as good.
const SMALL: [f64; 4] = [0.0, 1e-10, 1e-7, 1e-4];
/// Error of a sum of products, relative to the sum of their absolute values; as in the residuals of the optimality conditions.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Regularisations for the program of least violations.
const VIOLATION_ATTEMPTS: [f64; 2] = [1e-8, 1e-12];

/// Largest number of corrections of the active set of the least violations; larger than in a polish, because many rows are violated at
/// the start.
const VIOLATION_ROUNDS: usize = 24;

/// Combination `sum_i y_i (row_i z) <= bound` of the rows, valid for every feasible point.
struct Combination {
    slope: Vec<f64>,
    /// Sums of the absolute values of the slope's terms.
    terms: Vec<f64>,
    bound: f64,
    /// Sum of the absolute values of the bound's terms.
    bounds: f64,
}

impl Combination {
    fn add(&mut self, rows: &Rows, i: usize, factor: f64, bound: f64) {
        for (j, a) in rows.row(i) {
            self.slope[j] += factor * a;
            self.terms[j] += (factor * a).abs();
        }
        self.bound += factor * bound;
        self.bounds += (factor * bound).abs();
    }
}

impl Subproblem {
    /// True if the multipliers of `candidate` prove that no point satisfies the rows (Farkas' lemma).
    ///
    /// Every feasible point satisfies the combination of all rows with their multipliers, `v z <= b`. With `v = 0` and `b < 0` there is no
    /// such point. In floating-point arithmetic `v` is not exactly zero; then `|z_j| >= R U_j` for some variable, with
    /// `R = -b / sum_j |v_j| U_j`, in natural sizes `U_j` for which the terms of a variable are as large as those of `b`. A proof has `R` of at
    /// least 1000, and a `b` that is negative even if every row is violated within the tolerance of constraints.
    pub fn is_contradiction(&self, candidate: &PrimalDual) -> bool {
        let mut candidate = candidate.clone();
        candidate.project_multipliers(self);
        SMALL.iter().any(|small| {
            self.leave_out_small(&mut candidate, *small);
            self.proves(&candidate)
        })
    }

    fn proves(&self, candidate: &PrimalDual) -> bool {
        let mut sum = Combination {
            slope: vec![0.0; self.variables],
            terms: vec![0.0; self.variables],
            bound: 0.0,
            bounds: 0.0,
        };
        for (i, e) in candidate.equalities.iter().enumerate() {
            sum.add(&self.equalities, i, *e, self.equalities.right()[i]);
        }
        for (i, g) in candidate.inequalities.iter().enumerate() {
            if *g != 0.0 {
                let bound = if *g > 0.0 {
                    self.upper[i]
                } else {
                    self.inequalities.right()[i]
                };
                sum.add(&self.inequalities, i, *g, bound);
            }
        }
        for (cone, multipliers) in self.cones.iter().zip(&candidate.cones) {
            for (i, c) in multipliers.iter().enumerate() {
                sum.add(&cone.rows, i, -c, cone.rows.right()[i]);
            }
        }
        let Combination {
            slope,
            terms,
            bound,
            bounds,
        } = sum;
        let slopes = slope.iter().zip(&terms);
        let reached: f64 = slopes
            .filter(|(_, terms)| **terms > 0.0)
            .map(|(v, terms)| (v.abs() - ROUNDING * terms).max(0.0) / terms * bounds)
            .sum();
        -bound > TOLERANCE * bounds && -bound >= REACH * reached
    }

    /// Sets multipliers to zero whose product with the size of their row is small relative to the largest; rows without a part in the
    /// contradiction only add slopes.
    fn leave_out_small(&self, candidate: &mut PrimalDual, small: f64) {
        let weigh = |rows: &Rows, multipliers: &[f64]| {
            let each = multipliers.iter().enumerate();
            each.fold(0.0f64, |most, (i, y)| most.max((y * rows.scale(i)).abs()))
        };
        let cones = self.cones.iter().zip(&candidate.cones);
        let largest = weigh(&self.equalities, &candidate.equalities)
            .max(weigh(&self.inequalities, &candidate.inequalities))
            .max(cones.fold(0.0, |most, (c, y)| most.max(weigh(&c.rows, y))));
        for (rows, multipliers) in [
            (&self.equalities, &mut candidate.equalities),
            (&self.inequalities, &mut candidate.inequalities),
        ] {
            for (i, y) in multipliers.iter_mut().enumerate() {
                if (*y * rows.scale(i)).abs() <= small * largest {
                    *y = 0.0;
                }
            }
        }
        for (cone, multipliers) in self.cones.iter().zip(&mut candidate.cones) {
            if weigh(&cone.rows, multipliers) <= small * largest {
                multipliers.fill(0.0);
            }
        }
    }

    /// True if the least squares of the violations prove infeasibility: a program with one more variable per row, whose multipliers are the
    /// proof if its minimum is positive. The rows should have similar sizes.
    pub(super) fn has_violations(&self, iterations: u32) -> bool {
        let sub = self.least_violations();
        // Started from zero multipliers, from which the active set of a few rows is found as well.
        let from = VIOLATION_ATTEMPTS.iter().map(|&regularisation| {
            let settings = Settings {
                regularisation,
                iterations,
            };
            match sub.run_clarabel(settings) {
                Ending::Point(point) => point,
                Ending::Contradiction(_) | Ending::Nothing => PrimalDual::zero(&sub),
            }
        });
        let mut from = from.chain(std::iter::once(PrimalDual::zero(&sub)));
        from.any(|point| {
            let (found, _) = sub.polish_within(point, VIOLATION_ROUNDS, VIOLATION_ROUNDS / 4);
            let proof = PrimalDual {
                equalities: found.equalities,
                inequalities: found.inequalities,
                cones: found.cones,
                ..PrimalDual::zero(self)
            };
            self.is_contradiction(&proof)
        })
    }

    /// Program `sum s^2` under all rows, each with an added variable `s`.
    fn least_violations(&self) -> Self {
        let rows = self.equalities.len() + self.inequalities.len() + self.cones.len();
        let mut sub = Self::new(self.variables + rows);
        sub.proximal[self.variables..].fill(1.0);
        let mut violations = self.variables..self.variables + rows;
        let mut violation = || violations.next().map(|s| (s, 1.0));
        for i in 0..self.equalities.len() {
            let row = self.equalities.row(i).chain(violation());
            sub.equalities.push(row, self.equalities.right()[i]);
        }
        for i in 0..self.inequalities.len() {
            let row = self.inequalities.row(i).chain(violation());
            sub.bound(row, self.inequalities.right()[i], self.upper[i]);
        }
        for cone in &self.cones {
            let mut rows = Rows::new();
            let mut bound = violation();
            for i in 0..cone.rows.len() {
                rows.push(cone.rows.row(i).chain(bound.take()), cone.rows.right()[i]);
            }
            sub.cones.push(Cone { rows });
        }
        sub
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x >= 1`, `y >= 1` and `x + y <= sum`.
    fn rows(sum: f64) -> Subproblem {
        let mut sub = Subproblem::new(2);
        sub.bound([(0, 1.0)], 1.0, f64::INFINITY);
        sub.bound([(1, 1.0)], 1.0, f64::INFINITY);
        sub.bound([(0, 1.0), (1, 1.0)], f64::NEG_INFINITY, sum);
        sub
    }

    fn proof(sub: &Subproblem, multipliers: [f64; 3]) -> bool {
        sub.is_contradiction(&PrimalDual {
            inequalities: multipliers.to_vec(),
            ..PrimalDual::zero(sub)
        })
    }

    #[test]
    fn only_valid_multipliers_are_a_proof() {
        let contradictory = rows(1.5);
        assert!(proof(&contradictory, [-1.0, -1.0, 1.0]));
        assert!(proof(&contradictory, [-1e-9, -1e-9, 1e-9]));
        // A combination with a slope, one of the wrong sign, and zero multipliers.
        assert!(!proof(&contradictory, [-1.0, -0.9, 1.0]));
        assert!(!proof(&contradictory, [1.0, 1.0, -1.0]));
        assert!(!proof(&contradictory, [0.0; 3]));
        // The same combination for a feasible program, and for bounds that cross within the tolerance of constraints.
        assert!(!proof(&rows(2.5), [-1.0, -1.0, 1.0]));
        assert!(!proof(&rows(2.0 - 1e-10), [-1.0, -1.0, 1.0]));
    }

    #[test]
    fn least_violations_find_the_proof() {
        assert!(rows(1.5).has_violations(100));
        assert!(!rows(2.5).has_violations(100));
    }
}
