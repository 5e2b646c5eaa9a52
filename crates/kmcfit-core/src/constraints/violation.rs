//! Violations of constraints, relative to the scale of each row.

use super::{Cone, Constraints, RowGroup};

/// Largest violation of a satisfied constraint, relative to its row's scale.
pub const TOLERANCE: f64 = 1e-9;

/// The largest violation.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// Violation relative to the row's scale; 0 if all constraints hold.
    pub relative: f64,
    /// Name of the group.
    pub name: String,
    /// Time of the row, s.
    pub time: f64,
}

impl RowGroup {
    /// Scale of row `i`: the larger of the size of its bounds and the sum of the sizes of its terms.
    pub fn scale(&self, i: usize, theta: &[f64]) -> f64 {
        let terms: f64 = self.rows.row(i).map(|(j, a)| (a * theta[j]).abs()).sum();
        let finite = |b: f64| if b.is_finite() { b.abs() } else { 0.0 };
        let [lower, upper] = self.bounds(i);
        let bound = finite(lower).max(finite(upper));
        // A row whose terms are zero has the scale of its coefficients; a bound of one parameter is a scale in any unit.
        match bound > 0.0 && self.single(i).is_some() {
            true => terms.max(bound),
            false => terms.max(bound).max(self.rows.scale(i)),
        }
    }

    /// Distance of row `i` outside its bounds, relative to its scale; not positive inside.
    pub fn relative_violation(&self, i: usize, theta: &[f64]) -> f64 {
        let value: f64 = self.rows.row(i).map(|(j, a)| a * theta[j]).sum();
        let [lower, upper] = self.bounds(i);
        if value.is_nan() {
            return f64::INFINITY;
        }
        (lower - value).max(value - upper) / self.scale(i, theta).max(f64::MIN_POSITIVE)
    }
}

impl Cone {
    /// Values `rows z - right`: the bound, then the components of the norm.
    pub fn parts(&self, z: &[f64]) -> Vec<f64> {
        let values = self.rows.multiply(z);
        let pairs = values.iter().zip(self.rows.right());
        pairs.map(|(value, right)| value - right).collect()
    }

    /// Scale of the cone: the largest size of a right-hand side, or sum of the sizes of a row's terms. At the apex, where all parts
    /// vanish, their rounding errors are relative to it.
    pub fn scale(&self, z: &[f64]) -> f64 {
        let row = |i: usize| {
            let terms: f64 = self.rows.row(i).map(|(j, a)| (a * z[j]).abs()).sum();
            terms.max(self.rows.right()[i].abs())
        };
        (0..self.rows.len()).map(row).fold(0.0, f64::max)
    }

    /// Violation of the cone at `z`, relative to its scale; not positive inside.
    pub fn violation(&self, z: &[f64]) -> f64 {
        let parts = self.parts(z);
        let Some((bound, parts)) = parts.split_first() else {
            return 0.0;
        };
        let norm = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
        if (norm - bound).is_nan() {
            return f64::INFINITY;
        }
        (norm - bound) / self.scale(z).max(f64::MIN_POSITIVE)
    }
}

impl Constraints {
    /// Largest violation at `theta`; `None` without constraints.
    pub fn largest_violation(&self, theta: &[f64]) -> Option<Violation> {
        let rows = self.groups.iter().flat_map(|group| {
            (0..group.rows.len()).map(move |i| {
                (
                    group.relative_violation(i, theta),
                    &group.name,
                    group.times[i][0],
                )
            })
        });
        let cones = self.cones.iter().flat_map(|group| {
            let pairs = group.cones.iter().zip(&group.times);
            pairs.map(move |(cone, time)| (cone.violation(theta), &group.name, *time))
        });
        let worst = rows.chain(cones).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Violation {
            relative: worst.0.max(0.0),
            name: worst.1.clone(),
            time: worst.2,
        })
    }

    /// True if all constraints hold to `tolerance`, relative to their scales.
    pub fn hold(&self, theta: &[f64], tolerance: f64) -> bool {
        self.largest_violation(theta)
            .is_none_or(|v| v.relative <= tolerance)
    }
}
