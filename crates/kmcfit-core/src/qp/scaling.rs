//! Scaling of a program to coefficients near 1: variables `z_j / u_j`, rows and cones times a factor each, the cost times
//! another.

use super::kkt::ROUNDING;
use super::{PrimalDual, Subproblem};
use crate::constraints::{Cone, Rows, TOLERANCE};

/// Rounds of scaling by square roots: each halves the remaining exponents; after twelve, those of the largest and smallest floating-point
/// numbers are below 1.
const ROUNDS: usize = 12;

/// A program scaled by variables `z_j / units_j`, a factor for every row and cone, and a factor for half the cost. All factors are powers of
/// two, which change no digit.
pub struct ScaledProgram {
    /// Scaled program.
    pub sub: Subproblem,
    units: Vec<f64>,
    equalities: Vec<f64>,
    inequalities: Vec<f64>,
    absolute: Vec<f64>,
    cones: Vec<f64>,
    cost: f64,
}

impl ScaledProgram {
    /// Scales `original` so that the largest coefficients of every row and column (Ruiz), and the cost at zero, are near 1.
    pub fn new(original: &Subproblem) -> Self {
        let units = units(original);
        let scaled = original.in_units(&units);
        let at_zero = scaled.value(&vec![0.0; scaled.variables]) - scaled.constant;
        let near = scaled.proximal.iter().fold(0.0f64, |m, d| m.max(*d));
        let size = if at_zero > 0.0 { at_zero } else { near };
        // The square root is a power of two as well.
        let root = match size > 0.0 && size.is_finite() {
            true => power_of_two(1.0 / size.sqrt()),
            false => 1.0,
        };
        let cost = root * root;
        let factors = |rows: &Rows| -> Vec<f64> {
            let each = (0..rows.len()).map(|i| row_factor(rows.scale(i)));
            each.collect()
        };
        let equalities = factors(&scaled.equalities);
        let inequalities = factors(&scaled.inequalities);
        let absolute = factors(&scaled.absolute);
        let scale =
            |cone: &Cone| (0..cone.rows.len()).fold(0.0f64, |m, i| m.max(cone.rows.scale(i)));
        let cones: Vec<f64> = scaled.cones.iter().map(|c| row_factor(scale(c))).collect();
        let mut sub = Subproblem::new(scaled.variables);
        let weight_roots = vec![root; scaled.residuals.len()];
        sub.residuals = times(&scaled.residuals, &weight_roots);
        sub.proximal = scaled.proximal.iter().map(|d| d * cost).collect();
        sub.equalities = times(&scaled.equalities, &equalities);
        sub.inequalities = times(&scaled.inequalities, &inequalities);
        sub.upper = product(&scaled.upper, &inequalities);
        sub.absolute = times(&scaled.absolute, &absolute);
        let weights = scaled.absolute_weights.iter().zip(&absolute);
        sub.absolute_weights = weights.map(|(w, factor)| w * cost / factor).collect();
        let each = scaled.cones.iter().zip(&cones);
        sub.cones = each
            .map(|(cone, factor)| Cone {
                rows: times(&cone.rows, &vec![*factor; cone.rows.len()]),
            })
            .collect();
        Self {
            sub,
            units,
            equalities,
            inequalities,
            absolute,
            cones,
            cost,
        }
    }

    /// True if a point of the original program is near enough for its rows and cost to be computed with the accuracy of constraints
    /// ([`TOLERANCE`]): farther out along a direction without cost, the rounding errors of a row's terms exceed that share of the largest bound, or
    /// of the largest distance at which a residual vanishes, and residuals relative to the terms are small at any point.
    pub fn resolves(&self, z: &[f64]) -> bool {
        let rows = [
            &self.sub.equalities,
            &self.sub.inequalities,
            &self.sub.absolute,
        ];
        let bounds = rows.into_iter().flat_map(|rows| rows.right());
        let bounds = bounds.chain(&self.sub.upper).map(|bound| bound.abs());
        // Where all bounds are zero, the residuals alone say how far from zero a point is.
        let targets = self.sub.residuals.right().iter().enumerate();
        let distances = targets.map(|(i, f)| f.abs() / self.sub.residuals.scale(i));
        let sizes = bounds.chain(distances);
        let largest = sizes.filter(|size| size.is_finite()).fold(1.0, f64::max);
        let mut sizes = z.iter().zip(&self.units).map(|(z, unit)| (z / unit).abs());
        sizes.all(|size| ROUNDING * size <= TOLERANCE * largest)
    }

    /// A point of the scaled program in the original variables.
    pub fn original(&self, point: &PrimalDual) -> PrimalDual {
        let multipliers = |values: &[f64], factors: &[f64]| -> Vec<f64> {
            let pairs = values.iter().zip(factors);
            pairs.map(|(m, factor)| m * factor / self.cost).collect()
        };
        let cones = point.cones.iter().zip(&self.cones);
        let cones = cones.map(|(c, factor)| multipliers(c, &vec![*factor; c.len()]));
        PrimalDual {
            z: product(&point.z, &self.units),
            inequalities: multipliers(&point.inequalities, &self.inequalities),
            equalities: multipliers(&point.equalities, &self.equalities),
            absolute: multipliers(&point.absolute, &self.absolute),
            cones: cones.collect(),
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// Power of two nearest to a positive number, in the logarithm.
fn power_of_two(x: f64) -> f64 {
    x.log2().round().exp2()
}

/// Factor that scales a row of this size to near 1.
fn row_factor(size: f64) -> f64 {
    if size > 0.0 && size.is_finite() {
        power_of_two(1.0 / size)
    } else {
        1.0
    }
}

/// Every row and its right-hand side times a factor.
fn times(rows: &Rows, factors: &[f64]) -> Rows {
    let mut scaled = Rows::new();
    for (i, factor) in factors.iter().enumerate() {
        let entries = rows.row(i).map(|(j, a)| (j, a * factor));
        scaled.push(entries, rows.right()[i] * factor);
    }
    scaled
}

/// Units of the variables; rows of residuals are scaled individually, as their variables in a program are.
fn units(sub: &Subproblem) -> Vec<f64> {
    let cones = sub.cones.iter().map(|cone| &cone.rows);
    let rows = [
        &sub.residuals,
        &sub.absolute,
        &sub.equalities,
        &sub.inequalities,
    ];
    let all: Vec<&Rows> = rows.into_iter().chain(cones).collect();
    let mut scales: Vec<Vec<f64>> = all.iter().map(|rows| vec![1.0; rows.len()]).collect();
    let mut units = vec![1.0; sub.variables];
    for _ in 0..ROUNDS {
        let mut largest = vec![0.0f64; sub.variables];
        for (rows, scales) in all.iter().zip(&mut scales) {
            for (i, scale) in scales.iter_mut().enumerate() {
                let mut most = 0.0f64;
                for (j, a) in rows.row(i) {
                    let size = (a * units[j] * *scale).abs();
                    most = most.max(size);
                    largest[j] = largest[j].max(size);
                }
                if most > 0.0 {
                    *scale /= most.sqrt();
                }
            }
        }
        for (unit, most) in units.iter_mut().zip(&largest) {
            if *most > 0.0 {
                *unit /= most.sqrt();
            }
        }
    }
    for (unit, d) in units.iter_mut().zip(&sub.proximal) {
        // A variable in no row is scaled by its proximal term.
        if *unit == 1.0 && *d > 0.0 {
            *unit = 1.0 / d.sqrt();
        }
        *unit = power_of_two(*unit);
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `z_1 - z_2 = 1` in other units of the variables: far out along the line, the rounding error of the row's terms exceeds its tolerance.
    #[test]
    fn points_dominated_by_rounding_errors_are_not_resolved() {
        let units = [2f64.powi(20), 2f64.powi(-20)];
        let mut sub = Subproblem::new(2);
        sub.equalities
            .push([(0, 1.0 / units[0]), (1, -1.0 / units[1])], 1.0);
        let normalised = ScaledProgram::new(&sub);
        let at = |z: f64| [(z + 1.0) * units[0], z * units[1]];
        assert!(normalised.resolves(&at(1e3)));
        assert!(!normalised.resolves(&at(1e12)));
    }

    /// `z_1 <= z_2` with residuals that vanish at 1e9: there is no smaller size.
    #[test]
    fn points_where_the_residuals_vanish_are_resolved() {
        let mut sub = Subproblem::new(2);
        sub.bound([(0, 1.0), (1, -1.0)], f64::NEG_INFINITY, 0.0);
        sub.residuals.push([(0, 1.0)], 1e9);
        sub.residuals.push([(1, 1.0)], 1e9);
        let normalised = ScaledProgram::new(&sub);
        assert!(normalised.resolves(&[1e9, 1e9]));
        assert!(!normalised.resolves(&[1e18, 1e18]));
    }
}
