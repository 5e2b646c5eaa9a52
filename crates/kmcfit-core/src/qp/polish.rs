//! Polish of a nearly optimal point: the program with its active rows as equalities, which is linear.
//!
//! An interior-point method approaches its bounds without reaching them, and stops early where its systems are ill-conditioned. The active rows
//! are recognisable before that. With these rows as equalities, one sparse factorisation gives the minimum to machine precision; multipliers of
//! the wrong sign and violated rows then correct the active set.

use super::{Kkt, PrimalDual, Subproblem};
use crate::constraints::Rows;

/// Largest number of corrections of the active set: after two, few of hundreds of rows change, and cycling sets do not end.
const ROUNDS: usize = 12;
/// Largest number of consecutive corrections without a better point; two, because a wrong row is removed only after it was added.
const IN_VAIN: usize = 2;

/// Distance from its bound, as a share of the largest of all rows, of a row that is active where the step begins.
const ACTIVE_AT_ZERO: f64 = 1e-9;
/// Largest number of corrections from there; with five to twenty, fits with total variation take the same time.
const ROUNDS_FROM_ZERO: usize = 3;

/// State of a row or an absolute value in the active set.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Held {
    /// Between its bounds.
    Free,
    /// At its lower bound; for an absolute value, of a negative number.
    Lower,
    /// At its upper bound; for an absolute value, of a positive number.
    Upper,
    /// An absolute value is zero.
    Zero,
}

/// The active set.
#[derive(Clone, PartialEq, Eq)]
struct ActiveSet {
    rows: Vec<Held>,
    absolute: Vec<Held>,
}

impl Subproblem {
    /// True if [`Subproblem::polish`] applies: without cones, whose boundary is curved.
    pub fn can_be_polished(&self) -> bool {
        self.cones.is_empty()
    }

    /// Best of `from` and the minima under the active sets that follow from it, with its residuals.
    pub fn polish(&self, from: PrimalDual) -> (PrimalDual, Kkt) {
        self.polish_within(from, ROUNDS, IN_VAIN)
    }

    /// [`Subproblem::polish`] with at most `rounds` corrections of the active set, of which at most `most_in_vain` consecutive ones without a
    /// better point.
    pub(super) fn polish_within(
        &self,
        from: PrimalDual,
        rounds: usize,
        most_in_vain: usize,
    ) -> (PrimalDual, Kkt) {
        let kkt = self.kkt(&from);
        if kkt.is_near() || !self.can_be_polished() || !from.is_finite() {
            return (from, kkt);
        }
        let set = self.active_set(&from);
        self.corrected_minimum(set, (from, kkt), rounds, most_in_vain)
    }

    /// Minimum in few variables from the rows that are active at zero, where a step of a fit begins: late in a fit they are those of the
    /// minimum, and no interior-point method is needed. `None` if a few corrections do not find it.
    pub(super) fn minimum_from_zero(&self) -> Option<(PrimalDual, Kkt)> {
        let is_small = self.elimination_order.len() == self.variables
            && self.elimination_order.iter().all(|position| *position == 0);
        (is_small && self.can_be_polished()).then_some(())?;
        let zero = PrimalDual::zero(self);
        let kkt = self.kkt(&zero);
        let set = self.active_set_at_zero();
        let found = self.corrected_minimum(set, (zero, kkt), ROUNDS_FROM_ZERO, ROUNDS_FROM_ZERO);
        found.1.is_near().then_some(found)
    }

    /// Best of `best` and the minima under `set` and the active sets that follow from it.
    fn corrected_minimum(
        &self,
        mut set: ActiveSet,
        mut best: (PrimalDual, Kkt),
        rounds: usize,
        most_in_vain: usize,
    ) -> (PrimalDual, Kkt) {
        let mut seen = vec![set.clone()];
        let mut point = best.0.clone();
        // Multipliers of dependent rows are not unique; those nearest to zero cancel least.
        point.equalities.fill(0.0);
        point.inequalities.fill(0.0);
        let mut in_vain = 0;
        for _ in 0..rounds {
            let Some(next) = self.minimum_on(&set, &point) else {
                break;
            };
            let kkt = self.kkt(&next);
            // The first point within the limits ends the search, even if its multipliers are less accurate.
            let is_better = kkt.is_near() || kkt.is_better_than(&best.1);
            if is_better {
                best = (next.clone(), kkt);
            }
            in_vain = if is_better { 0 } else { in_vain + 1 };
            if kkt.is_near() || in_vain > most_in_vain {
                break;
            }
            let corrected = self.corrected(&set, &next);
            // For a nearly singular system, the correction from another point differs.
            if corrected != set && seen.contains(&corrected) {
                break;
            }
            set = corrected;
            seen.push(set.clone());
            point = next;
        }
        best
    }

    /// Rows whose bounds are met at zero, and absolute values of zero there.
    fn active_set_at_zero(&self) -> ActiveSet {
        let scaled = |rows: &Rows, right: &[f64]| -> Vec<f64> {
            let each = right.iter().enumerate();
            each.map(|(i, b)| b / rows.scale(i).max(f64::MIN_POSITIVE))
                .collect()
        };
        let lower = scaled(&self.inequalities, self.inequalities.right());
        let upper = scaled(&self.inequalities, &self.upper);
        let limit = ACTIVE_AT_ZERO * largest_finite(lower.iter().chain(&upper));
        let rows = lower.iter().zip(&upper).map(|(lower, upper)| match () {
            () if lower == upper => Held::Upper,
            () if lower.abs().min(upper.abs()) > limit => Held::Free,
            () if lower.abs() <= upper.abs() => Held::Lower,
            () => Held::Upper,
        });
        let opposite = scaled(&self.absolute, self.absolute.right());
        let limit = ACTIVE_AT_ZERO * largest_finite(&opposite);
        let absolute = opposite.iter().map(|t| match () {
            () if t.abs() <= limit => Held::Zero,
            () if *t < 0.0 => Held::Upper,
            () => Held::Lower,
        });
        ActiveSet {
            rows: rows.collect(),
            absolute: absolute.collect(),
        }
    }

    /// Rows whose multipliers exceed their distances from the bound, both in natural sizes: the slack relative to the row's terms, its cost relative
    /// to the cost.
    fn active_set(&self, candidate: &PrimalDual) -> ActiveSet {
        let z = &candidate.z;
        let at_zero = self.value(&vec![0.0; self.variables]) - self.constant;
        let scale = 0.5 * at_zero.max(self.value(z) - self.constant);
        let values = self.inequalities.multiply(z);
        let row = |(i, value): (usize, &f64)| {
            let (lower, upper) = (self.inequalities.right()[i], self.upper[i]);
            if lower == upper {
                return Held::Upper;
            }
            let multiplier = candidate.inequalities[i];
            let (bound, held) = match multiplier > 0.0 {
                true => (upper, Held::Upper),
                false => (lower, Held::Lower),
            };
            let terms: f64 = self
                .inequalities
                .row(i)
                .map(|(j, a)| (a * z[j]).abs())
                .sum();
            let size = terms.max(bound.abs()).max(f64::MIN_POSITIVE);
            let distance = (bound - value).abs() / size;
            let price = (multiplier * size).abs() / scale;
            if multiplier != 0.0 && distance < price {
                held
            } else {
                Held::Free
            }
        };
        let rows = values.iter().enumerate().map(row).collect();
        let values = self.absolute.multiply(z);
        let absolute = values.iter().enumerate().map(|(i, value)| {
            let jump = value - self.absolute.right()[i];
            let half = 0.5 * self.absolute_weights[i];
            let terms: f64 = self.absolute.row(i).map(|(j, a)| (a * z[j]).abs()).sum();
            let size = terms
                .max(self.absolute.right()[i].abs())
                .max(f64::MIN_POSITIVE);
            let room = (half - candidate.absolute[i].abs()) * size / scale;
            match jump.abs() / size < room {
                true => Held::Zero,
                false if jump > 0.0 => Held::Upper,
                false => Held::Lower,
            }
        });
        ActiveSet {
            rows,
            absolute: absolute.collect(),
        }
    }

    /// Active set after the minimum on `set`: rows with multipliers of the wrong sign are removed, violated rows are added.
    fn corrected(&self, set: &ActiveSet, at: &PrimalDual) -> ActiveSet {
        let values = self.inequalities.multiply(&at.z);
        let row = |(i, held): (usize, &Held)| {
            let (lower, upper) = (self.inequalities.right()[i], self.upper[i]);
            let multiplier = at.inequalities[i];
            match held {
                _ if lower == upper => Held::Upper,
                Held::Upper if multiplier < 0.0 => Held::Free,
                Held::Lower if multiplier > 0.0 => Held::Free,
                Held::Free if values[i] < lower => Held::Lower,
                Held::Free if values[i] > upper => Held::Upper,
                held => *held,
            }
        };
        let rows = set.rows.iter().enumerate().map(row).collect();
        let values = self.absolute.multiply(&at.z);
        let absolute = set.absolute.iter().enumerate().map(|(i, held)| {
            let jump = values[i] - self.absolute.right()[i];
            let half = 0.5 * self.absolute_weights[i];
            match held {
                Held::Zero if at.absolute[i] > half => Held::Upper,
                Held::Zero if at.absolute[i] < -half => Held::Lower,
                Held::Upper if jump < 0.0 => Held::Zero,
                Held::Lower if jump > 0.0 => Held::Zero,
                held => *held,
            }
        });
        ActiveSet {
            rows,
            absolute: absolute.collect(),
        }
    }

    /// Minimum with the rows of `set` as equalities, as a correction of `from`, by one symmetric factorisation of
    ///
    /// ```text
    /// [D F' A'; F -I 0; A 0 0] (z, F z - f, multipliers) = (-T' a, f, b)
    /// ```
    ///
    /// with `a` of the absolute values that are not zero.
    fn minimum_on(&self, set: &ActiveSet, from: &PrimalDual) -> Option<PrimalDual> {
        let held = self.held_rows(set);
        let (n, r) = (self.variables, self.residuals.len());
        let matrix = self.kkt_matrix(&held);
        let mut side = [&vec![0.0; n], self.residuals.right(), held.right()].concat();
        let mut next = from.clone();
        for (i, held) in set.absolute.iter().enumerate() {
            let half = 0.5 * self.absolute_weights[i];
            next.absolute[i] = match held {
                Held::Upper => half,
                Held::Lower => -half,
                Held::Zero | Held::Free => continue,
            };
            let multiplier = next.absolute[i];
            self.absolute
                .row(i)
                .for_each(|(j, a)| side[j] -= multiplier * a);
        }
        // Multipliers are corrected as well, which gives the nearest ones for dependent rows.
        let mut residuals = self.residuals.multiply(&from.z);
        let right = self.residuals.right();
        residuals.iter_mut().zip(right).for_each(|(r, f)| *r -= f);
        let multipliers = held_multipliers(set, from);
        let start = [&from.z, residuals.as_slice(), &multipliers].concat();
        let solution = matrix.solve_from(&start, &side)?;
        next.z.copy_from_slice(&solution[..n]);
        let mut multipliers = solution[n + r..].iter().copied();
        let mut take = || multipliers.next().unwrap_or(0.0);
        next.equalities.fill_with(&mut take);
        for (multiplier, held) in next.inequalities.iter_mut().zip(&set.rows) {
            *multiplier = match held {
                Held::Free => 0.0,
                _ => take(),
            };
        }
        for (multiplier, held) in next.absolute.iter_mut().zip(&set.absolute) {
            if *held == Held::Zero {
                *multiplier = take();
            }
        }
        next.is_finite().then_some(next)
    }

    /// Equalities, active rows at their bounds, and zero absolute values, in this order.
    fn held_rows(&self, set: &ActiveSet) -> Rows {
        let mut held = self.equalities.clone();
        for (i, at) in set.rows.iter().enumerate() {
            match at {
                Held::Free | Held::Zero => {}
                Held::Lower => held.push(self.inequalities.row(i), self.inequalities.right()[i]),
                Held::Upper => held.push(self.inequalities.row(i), self.upper[i]),
            }
        }
        for (i, at) in set.absolute.iter().enumerate() {
            if *at == Held::Zero {
                held.push(self.absolute.row(i), self.absolute.right()[i]);
            }
        }
        held
    }
}

/// Largest size of the finite numbers.
fn largest_finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> f64 {
    let sizes = numbers.into_iter().map(|x| x.abs());
    sizes.filter(|size| size.is_finite()).fold(0.0, f64::max)
}

/// Multipliers of the rows of [`Subproblem::held_rows`].
fn held_multipliers(set: &ActiveSet, at: &PrimalDual) -> Vec<f64> {
    let held = |(m, at): (&f64, &Held)| (*at != Held::Free).then_some(*m);
    let zero = |(m, at): (&f64, &Held)| (*at == Held::Zero).then_some(*m);
    let rows = at.inequalities.iter().zip(&set.rows).filter_map(held);
    let absolute = at.absolute.iter().zip(&set.absolute).filter_map(zero);
    let all = at.equalities.iter().copied().chain(rows).chain(absolute);
    all.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::TOLERANCE;
    use crate::qp::ConicStatus;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Least squares in ten variables with bounds, some of them met at zero, and absolute values of differences.
    fn program(random: &mut ChaCha8Rng) -> Subproblem {
        const VARIABLES: usize = 10;
        let mut sub = Subproblem::new(VARIABLES);
        for _ in 0..VARIABLES + 2 {
            let row: Vec<f64> = (0..VARIABLES)
                .map(|_| random.random_range(-1.0..1.0))
                .collect();
            let right = random.random_range(-1.0..1.0);
            sub.residuals.push(row.into_iter().enumerate(), right);
        }
        for j in 1..VARIABLES {
            if random.random_bool(0.5) {
                let room = random.random_range(-1.0..1.0f64).max(0.0);
                sub.bound([(j - 1, 1.0), (j, -0.5)], -room, f64::INFINITY);
            }
            if random.random_bool(0.5) {
                let jump = random.random_range(-1.0..1.0f64).max(0.0);
                sub.absolute.push([(j - 1, -1.0), (j, 1.0)], jump);
                sub.absolute_weights.push(random.random_range(0.0..2.0));
            }
        }
        sub
    }

    /// The same program without places along a chain is solved by the interior-point method.
    #[test]
    fn minima_from_the_rows_active_at_zero_are_those_of_the_interior_point_method() {
        const PROGRAMS: u64 = 200;
        let mut found = 0;
        for seed in 0..PROGRAMS {
            let mut sub = program(&mut ChaCha8Rng::seed_from_u64(seed));
            let expected = sub.solve();
            assert_eq!(expected.status, ConicStatus::Solved, "{seed}");
            assert!(expected.attempts > 0, "{seed}");
            sub.elimination_order = vec![0; sub.variables];
            let Some((point, kkt)) = sub.minimum_from_zero() else {
                continue;
            };
            found += 1;
            assert!(
                kkt.is_solution() && sub.holds(&point.z, TOLERANCE),
                "{seed}"
            );
            let [here, there] = [&point.z, &expected.z].map(|z| sub.value(z));
            // Both solutions are within the accuracy of a program.
            let limit = 2.0 * Kkt::COST * sub.value(&vec![0.0; sub.variables]);
            assert!((here - there).abs() <= limit, "{seed}: {here} {there}");
            assert_eq!(sub.solve().attempts, 0, "{seed}");
        }
        // From another start a few corrections do not always suffice.
        assert!(found > PROGRAMS / 4, "{found}");
    }
}
