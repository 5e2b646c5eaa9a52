//! Residuals of the optimality conditions, by which every solution of a program is accepted or rejected.
//!
//! The status of a solver refers to its own iterates, tests and scaling. Here the Karush–Kuhn–Tucker conditions are computed from the data
//! of the program, each in a unit that is independent of the units of rows, variables and cost.

use super::dot2::{CompensatedSum, add_transposed_product, residuals};
use super::{PrimalDual, Subproblem};
use crate::constraints::{Rows, TOLERANCE};

/// Error of a sum of a few products, relative to the sum of their absolute values.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Residuals of the optimality conditions at a point with multipliers. Multipliers are first projected onto their cones, so that wrong
/// signs count as a residual of the gradient.
///
/// The first three are shares of the cost: their sum bounds the difference of the point's cost from the minimum, if the minimum is within the
/// natural size of each variable. The reference `S` is half of the larger of the cost at the point and at zero, with a lower bound set by the
/// rounding error of the residuals. The natural size `X_j` of a variable is the larger of `|z_j|` and the change that costs `S` by its residuals
/// and its proximal term, `sqrt(2 S / (|F_j|^2 + d_j))`; without either, the change that matches the other terms of a row or of an absolute value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kkt {
    /// Stationarity `sqrt(sum_j (r_j X_j)^2) / S` of the gradient `r` of the Lagrangian: the predicted decrease for
    /// `sum_j (delta_j / X_j)^2 <= 1`; or `sum_j r_j^2 / (2 d_j) / S`, the bound by the proximal terms, if smaller.
    /// With a known Newton step, its predicted decrease ([`Subproblem::kkt_with_decrease`]).
    pub stationarity: f64,
    /// Complementarity `sum |multiplier| distance / S`: for rows the distance from the bound of the multiplier's sign, for cones the inner
    /// product, for absolute values `w |T z - t| / 2` less the multiplier's part.
    pub complementarity: f64,
    /// Cost of the violations, `sum |multiplier| violation / S`.
    pub violation_cost: f64,
    /// Largest violation of a row, relative to the larger of its bound and `sum_j |a_j| X_j`; of a cone relative to
    /// the largest of these over its rows.
    pub feasibility: f64,
}

impl Kkt {
    /// Largest sum of the shares of the cost for a solution: a third of 1e-9, the smallest significant decrease of a fit, and three times the
    /// gap at which the interior-point method ends.
    pub const COST: f64 = 3e-10;
    /// Largest violation for a solution, ten times the tolerance of constraints: a step is clipped to its bounds and checked again, and the
    /// cost of violations of the linearised equation of motion is included in the share of the cost.
    pub const VIOLATION: f64 = 10.0 * TOLERANCE;
    /// Both limits for a solution of reduced accuracy, usable as a trial step or a starting point but not as a minimum: a step is accepted with
    /// a twentieth of its predicted decrease, for which four digits suffice.
    pub const REDUCED: f64 = 1e-4;

    /// Sum of the shares of the cost.
    pub fn cost(&self) -> f64 {
        self.stationarity + self.complementarity + self.violation_cost
    }

    /// True for the residuals of a solution.
    pub fn is_solution(&self) -> bool {
        // False for NaN.
        self.cost() <= Self::COST && self.feasibility <= Self::VIOLATION
    }

    /// True for a solution within the tolerance of constraints, which needs no polish.
    pub(super) fn is_near(&self) -> bool {
        self.is_solution() && self.feasibility <= TOLERANCE
    }

    /// True for the residuals of a solution of reduced accuracy.
    pub fn is_reduced(&self) -> bool {
        self.cost() <= Self::REDUCED && self.feasibility <= Self::REDUCED
    }

    /// True if these residuals are smaller than `other`, or `other` has NaN.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.size() < other.size() || (other.size().is_nan() && !self.size().is_nan())
    }

    /// Residuals relative to the limits of a solution; at most 1 for a solution.
    pub fn size(&self) -> f64 {
        (self.cost() / Self::COST).max(self.feasibility / Self::VIOLATION)
    }
}

/// Sum `sum_j |a_ij| x_j`.
fn terms(rows: &Rows, i: usize, x: &[f64]) -> f64 {
    rows.row(i).map(|(j, a)| (a * x[j]).abs()).sum()
}

impl Subproblem {
    /// Residuals of the optimality conditions at `candidate`.
    pub fn kkt(&self, candidate: &PrimalDual) -> Kkt {
        let mut candidate = candidate.clone();
        candidate.project_multipliers(self);
        let z = &candidate.z;
        let residuals = residuals(&self.residuals, z);
        let at_zero = self.value(&vec![0.0; self.variables]) - self.constant;
        let joined = self.joined_sizes(z);
        let scale = self.cost_scale(z, &joined, at_zero);
        let natural = self.natural_scales(z, &joined, scale);
        let mut gradient = vec![CompensatedSum::default(); self.variables];
        for ((sum, d), z) in gradient.iter_mut().zip(&self.proximal).zip(z) {
            sum.add_product(*d, *z);
        }
        for (rows, factors) in [
            (&self.residuals, &residuals),
            (&self.absolute, &candidate.absolute),
            (&self.equalities, &candidate.equalities),
            (&self.inequalities, &candidate.inequalities),
        ] {
            add_transposed_product(&mut gradient, rows, factors);
        }
        for (cone, multipliers) in self.cones.iter().zip(&candidate.cones) {
            let negative: Vec<f64> = multipliers.iter().map(|c| -c).collect();
            add_transposed_product(&mut gradient, &cone.rows, &negative);
        }
        let gradient: Vec<f64> = gradient.iter().map(CompensatedSum::total).collect();
        let within = gradient.iter().zip(&natural);
        let within = within.map(|(r, x)| (r * x) * (r * x)).sum::<f64>().sqrt();
        let near = gradient.iter().zip(&self.proximal);
        let near: f64 = near
            .map(|(r, d)| if *r == 0.0 { 0.0 } else { r * r / (2.0 * d) })
            .sum();
        // Not f64::min, which ignores NaN.
        let stationarity = if near < within { near } else { within };
        let mut rows = RowResiduals::default();
        self.add_rows(&candidate, &natural, &mut rows);
        self.add_cones(&candidate, &natural, &mut rows);
        // With zero cost at the point and at zero, the shares are zero.
        let share = |x: f64| if x == 0.0 { 0.0 } else { x / scale };
        Kkt {
            stationarity: share(stationarity),
            complementarity: share(rows.complementarity),
            violation_cost: share(rows.violation_cost),
            feasibility: rows.feasibility,
        }
    }

    /// [`Subproblem::kkt`] with the known decrease of half the cost by a Newton step on the active rows, `decrease = 1/2 r' H^-1 r` for the
    /// gradient `r`, which uses the curvature along each direction instead of that of each variable.
    pub(super) fn kkt_with_decrease(&self, candidate: &PrimalDual, decrease: f64) -> Kkt {
        let mut kkt = self.kkt(candidate);
        let at_zero = self.value(&vec![0.0; self.variables]) - self.constant;
        let scale = self.cost_scale(&candidate.z, &self.joined_sizes(&candidate.z), at_zero);
        if decrease <= kkt.stationarity * scale {
            kkt.stationarity = decrease / scale;
        }
        kkt
    }

    /// Reference of the shares: half of the largest of the cost at `z`, `at_zero`, and the cost for which the rounding error of the residuals
    /// equals [`Kkt::COST`], because cancelling residuals do not determine the minimum more accurately.
    fn cost_scale(&self, z: &[f64], joined: &[f64], at_zero: f64) -> f64 {
        let sizes = z
            .iter()
            .zip(joined)
            .map(|(z, joined)| match joined.is_finite() {
                true => z.abs().max(*joined),
                false => z.abs(),
            });
        let sizes: Vec<f64> = sizes.collect();
        let rows = self.residuals.right().iter().enumerate();
        let rounding = rows.map(|(i, f)| ROUNDING * (terms(&self.residuals, i, &sizes) + f.abs()));
        let known: f64 = rounding.map(|r| r * r).sum::<f64>() / Kkt::COST;
        let cost = at_zero.max(self.value(z) - self.constant);
        0.5 * cost.max(known)
    }

    /// Change of each variable that equals the other terms or the bounds of a row, the smallest over the rows; infinite without rows.
    fn joined_sizes(&self, z: &[f64]) -> Vec<f64> {
        let mut joined = vec![f64::INFINITY; self.variables];
        for (i, right) in self.equalities.right().iter().enumerate() {
            join(&self.equalities, i, right.abs(), z, &mut joined);
        }
        for (i, lower) in self.inequalities.right().iter().enumerate() {
            let bound = finite(*lower).max(finite(self.upper[i]));
            join(&self.inequalities, i, bound, z, &mut joined);
        }
        joined
    }

    /// Natural sizes `max(|z_j|, sqrt(2 scale / (|F_j|^2 + d_j)))`; for variables without curvature those by [`Subproblem::joined_sizes`], or
    /// in the same way by the absolute values.
    fn natural_scales(&self, z: &[f64], joined: &[f64], scale: f64) -> Vec<f64> {
        let mut curvature = self.proximal.clone();
        for i in 0..self.residuals.len() {
            self.residuals
                .row(i)
                .for_each(|(j, a)| curvature[j] += a * a);
        }
        let mut by_absolute = vec![f64::INFINITY; self.variables];
        for (i, right) in self.absolute.right().iter().enumerate() {
            join(&self.absolute, i, right.abs(), z, &mut by_absolute);
        }
        let size = |(j, z): (usize, &f64)| {
            let flat = [joined[j], by_absolute[j]];
            let own = match curvature[j] > 0.0 {
                true => (2.0 * scale / curvature[j]).sqrt(),
                false => flat.into_iter().find(|x| x.is_finite()).unwrap_or(0.0),
            };
            z.abs().max(own)
        };
        z.iter().enumerate().map(size).collect()
    }

    fn add_rows(&self, candidate: &PrimalDual, natural: &[f64], sums: &mut RowResiduals) {
        let z = &candidate.z;
        for (i, residual) in residuals(&self.equalities, z).into_iter().enumerate() {
            let right = self.equalities.right()[i];
            let size = terms(&self.equalities, i, natural).max(right.abs());
            sums.violate(residual.abs(), size, candidate.equalities[i]);
        }
        let values = self.inequalities.multiply(z);
        for (i, value) in values.iter().enumerate() {
            let (lower, upper) = (self.inequalities.right()[i], self.upper[i]);
            let multiplier = candidate.inequalities[i];
            let outside = (lower - value).max(value - upper);
            let bound = if lower - value > value - upper {
                lower
            } else {
                upper
            };
            if outside > 0.0 || outside.is_nan() {
                let size = terms(&self.inequalities, i, natural).max(finite(bound));
                sums.violate(outside, size, multiplier);
            }
            if multiplier != 0.0 {
                let bound = if multiplier > 0.0 { upper } else { lower };
                sums.complementarity += (multiplier * (bound - value)).abs();
            }
        }
        for (i, jump) in residuals(&self.absolute, z).into_iter().enumerate() {
            let half = 0.5 * self.absolute_weights[i];
            let lost = half - candidate.absolute[i] * jump.signum();
            sums.complementarity += lost.max(0.0) * jump.abs();
        }
    }

    fn add_cones(&self, candidate: &PrimalDual, natural: &[f64], sums: &mut RowResiduals) {
        for (cone, multipliers) in self.cones.iter().zip(&candidate.cones) {
            let parts = cone.parts(&candidate.z);
            let Some((bound, parts)) = parts.split_first() else {
                continue;
            };
            let norm = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
            let outside = (norm - bound).max(0.0);
            sums.violate(outside, cone.scale(natural), multipliers[0]);
            let products = std::iter::once(bound).chain(parts).zip(multipliers);
            let inner: f64 = products.map(|(s, c)| s * c).sum();
            sums.complementarity += inner.abs();
        }
    }
}

/// Reduces the sizes `joined` of the variables of row `i` to the changes that equal its other terms at `z` or its bound.
fn join(rows: &Rows, i: usize, bound: f64, z: &[f64], joined: &mut [f64]) {
    let all = terms(rows, i, z);
    for (j, a) in rows.row(i).filter(|(_, a)| *a != 0.0) {
        let others = bound.max(all - (a * z[j]).abs());
        if others > 0.0 {
            joined[j] = joined[j].min(others / a.abs());
        }
    }
}

/// Absolute value of a bound; 0 if infinite.
fn finite(bound: f64) -> f64 {
    if bound.is_finite() { bound.abs() } else { 0.0 }
}

#[derive(Default)]
struct RowResiduals {
    complementarity: f64,
    violation_cost: f64,
    feasibility: f64,
}

impl RowResiduals {
    fn violate(&mut self, violation: f64, size: f64, multiplier: f64) {
        if violation == 0.0 {
            return;
        }
        self.violation_cost += (multiplier * violation).abs();
        let relative = violation / size;
        // NaN is the largest violation.
        self.feasibility = match relative.is_nan() {
            true => f64::INFINITY,
            false => self.feasibility.max(relative),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::Cone;

    /// `(z - 2)^2` for `z <= 1`: at 1 the multiplier is 1.
    fn bounded() -> Subproblem {
        let mut sub = Subproblem::new(1);
        sub.residuals.push([(0, 1.0)], 2.0);
        sub.bound([(0, 1.0)], f64::NEG_INFINITY, 1.0);
        sub
    }

    fn at(sub: &Subproblem, z: f64, multiplier: f64) -> Kkt {
        sub.kkt(&PrimalDual {
            z: vec![z],
            inequalities: vec![multiplier],
            ..PrimalDual::zero(sub)
        })
    }

    /// Half the cost at zero is 2, the natural size of z is 2.
    #[test]
    fn residuals_by_hand() {
        let sub = bounded();
        let solved = at(&sub, 1.0, 1.0);
        assert!(solved.is_solution() && solved.size() == 0.0, "{solved:?}");
        // Inside: the gradient is -1.5, times 2, over 2.
        let inside = at(&sub, 0.5, 0.0);
        assert_eq!(inside.stationarity, 1.5);
        // The multiplier balances it half a unit from the bound.
        let distant = at(&sub, 0.5, 1.5);
        assert_eq!(
            (distant.stationarity, distant.complementarity),
            (0.0, 0.375)
        );
        // Outside by 0.5 of a terms' size of 2.
        let outside = at(&sub, 1.5, 0.5);
        assert_eq!((outside.violation_cost, outside.feasibility), (0.125, 0.25));
        // A multiplier of the wrong sign is projected to zero.
        assert_eq!(at(&sub, 2.0, -1.0).stationarity, 0.0);
        assert!(!at(&sub, f64::NAN, 0.0).is_solution());
    }

    /// A proximal term bounds the predicted decrease by `r^2 / (2 d)`.
    #[test]
    fn proximal_terms() {
        let mut sub = bounded();
        sub.proximal[0] = 1e6;
        let kkt = at(&sub, 0.0, 0.0);
        assert!(
            (kkt.stationarity - 4.0 / 2e6 / 2.0).abs() < 1e-18,
            "{kkt:?}"
        );
    }

    /// Residuals are independent of the units of variables, rows and cost.
    #[test]
    fn units_do_not_matter() {
        let expected = at(&bounded(), 0.5, 0.7);
        for (unit, row, cost) in [
            (1e6, 1.0, 1.0),
            (1.0, 1e-6, 1.0),
            (1.0, 1.0, 1e9),
            (1e-9, 1e5, 1e-7),
        ] {
            let mut sub = Subproblem::new(1);
            sub.residuals.push([(0, unit * cost)], 2.0 * cost);
            sub.bound([(0, unit * row)], f64::NEG_INFINITY, row);
            let found = at(&sub, 0.5 / unit, 0.7 * cost * cost / row);
            for (a, b) in [
                (found.stationarity, expected.stationarity),
                (found.complementarity, expected.complementarity),
                (found.feasibility, expected.feasibility),
            ] {
                assert!((a - b).abs() <= 1e-12, "{found:?} {expected:?}");
            }
        }
    }

    /// The nearest point of the unit disc to (3, 4), and the soft threshold of `(z - 3)^2 + |z|`.
    #[test]
    fn cones_and_absolute_values() {
        let mut sub = Subproblem::new(2);
        sub.residuals.push([(0, 1.0)], 3.0);
        sub.residuals.push([(1, 1.0)], 4.0);
        let mut rows = Rows::new();
        rows.push([], -1.0);
        rows.push([(0, 1.0)], 0.0);
        rows.push([(1, 1.0)], 0.0);
        sub.cones.push(Cone { rows });
        let mut candidate = PrimalDual::zero(&sub);
        candidate.z = vec![0.6, 0.8];
        candidate.cones[0] = vec![4.0, -2.4, -3.2];
        let kkt = sub.kkt(&candidate);
        assert!(kkt.is_solution(), "{kkt:?}");
        candidate.cones[0] = vec![0.0; 3];
        assert!(sub.kkt(&candidate).stationarity > 0.1);

        let mut sub = Subproblem::new(1);
        sub.residuals.push([(0, 1.0)], 3.0);
        sub.absolute.push([(0, 1.0)], 0.0);
        sub.absolute_weights.push(1.0);
        let mut candidate = PrimalDual::zero(&sub);
        candidate.z = vec![2.5];
        candidate.absolute = vec![0.5];
        assert_eq!(sub.kkt(&candidate).size(), 0.0);
        candidate.absolute = vec![-0.5];
        assert!(sub.kkt(&candidate).complementarity > 0.1);
    }

    /// `(z_1 - 2)^2 + (z_2 - 1)^2` with `z_2 = 0` twice: multipliers whose rounding error exceeds the gradient do not hide it.
    #[test]
    fn a_gradient_does_not_vanish_in_the_rounding_of_multipliers_that_cancel() {
        let mut sub = Subproblem::new(2);
        sub.residuals.push([(0, 1.0)], 2.0);
        sub.equalities.push([(1, 1.0)], 0.0);
        sub.equalities.push([(1, 3.0)], 0.0);
        sub.residuals.push([(1, 1.0)], 1.0);
        let kkt = sub.kkt(&PrimalDual {
            z: vec![2.0, 0.0],
            equalities: [-3.0, 1.0].map(|y| y * 2f64.powi(100)).to_vec(),
            ..PrimalDual::zero(&sub)
        });
        // The gradient in the second variable is -1, its natural size sqrt(5) at half the cost at zero, 2.5.
        assert!(
            (kkt.stationarity - 5f64.sqrt() / 2.5).abs() < 1e-15,
            "{kkt:?}"
        );
    }
}
