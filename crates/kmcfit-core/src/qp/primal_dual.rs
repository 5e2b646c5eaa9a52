//! Primal-dual points: variables of a subproblem with multipliers of all its rows.

use super::Subproblem;

/// A point and multipliers of half the cost, `1/2 |F z - f|^2 + 1/2 sum d z^2 + 1/2 sum w |T z - t|`:
/// at a minimum
///
/// ```text
/// F'(F z - f) + D z + T' a + E' e + G' g - sum_k A_k' c_k = 0
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PrimalDual {
    /// Variables.
    pub z: Vec<f64>,
    /// Multipliers `g` of the inequalities, positive at an upper bound, negative at a lower one.
    pub inequalities: Vec<f64>,
    /// Multipliers `e` of the equalities.
    pub equalities: Vec<f64>,
    /// Multipliers `a` of the absolute values, between `-w/2` and `w/2`.
    pub absolute: Vec<f64>,
    /// Multipliers `c_k` of the cones, each in the second-order cone.
    pub cones: Vec<Vec<f64>>,
}

impl PrimalDual {
    /// Zero variables and multipliers.
    pub fn zero(sub: &Subproblem) -> Self {
        Self {
            z: vec![0.0; sub.variables],
            inequalities: vec![0.0; sub.inequalities.len()],
            equalities: vec![0.0; sub.equalities.len()],
            absolute: vec![0.0; sub.absolute.len()],
            cones: sub.cones.iter().map(|c| vec![0.0; c.rows.len()]).collect(),
        }
    }

    /// True if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let cones = self.cones.iter().flatten();
        let rows = self.inequalities.iter().chain(&self.equalities);
        let rows = rows.chain(&self.absolute).chain(cones);
        self.z.iter().chain(rows).all(|x| x.is_finite())
    }

    /// Projects the multipliers onto those with valid signs: zero at an infinite bound, within half the weight for absolute values, within the cone
    /// for cones.
    pub fn project_multipliers(&mut self, sub: &Subproblem) {
        let bounds = sub.inequalities.right().iter().zip(&sub.upper);
        for (g, (lower, upper)) in self.inequalities.iter_mut().zip(bounds) {
            let is_wrong = (*g > 0.0 && !upper.is_finite()) || (*g < 0.0 && !lower.is_finite());
            if is_wrong {
                *g = 0.0;
            }
        }
        for (a, w) in self.absolute.iter_mut().zip(&sub.absolute_weights) {
            *a = a.max(-0.5 * w).min(0.5 * w);
        }
        self.cones.iter_mut().for_each(|c| project_onto_cone(c));
    }
}

/// Projects `x` onto the cone `|x_1..| <= x_0`.
fn project_onto_cone(x: &mut [f64]) {
    let Some((bound, parts)) = x.split_first_mut() else {
        return;
    };
    let norm = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
    if norm <= *bound {
        return;
    }
    let mean = (0.5 * (norm + *bound)).max(0.0);
    *bound = mean;
    let factor = if norm > 0.0 { mean / norm } else { 0.0 };
    parts.iter_mut().for_each(|p| *p *= factor);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_cone() {
        for (x, expected) in [
            ([5.0, 3.0, 4.0], [5.0, 3.0, 4.0]),
            ([-6.0, 3.0, 4.0], [0.0, 0.0, 0.0]),
            ([1.0, 3.0, 4.0], [3.0, 1.8, 2.4]),
        ] {
            let mut found = x;
            project_onto_cone(&mut found);
            let error = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(error.fold(0.0, f64::max) < 1e-15, "{found:?}");
        }
    }

    #[test]
    fn multipliers_of_the_wrong_sign_are_projected_to_zero() {
        let mut sub = Subproblem::new(1);
        sub.bound([(0, 1.0)], 0.0, f64::INFINITY);
        sub.bound([(0, 1.0)], f64::NEG_INFINITY, 1.0);
        sub.bound([(0, 1.0)], 0.0, 1.0);
        sub.absolute.push([(0, 1.0)], 0.0);
        sub.absolute_weights.push(4.0);
        let mut candidate = PrimalDual::zero(&sub);
        candidate.inequalities = vec![3.0, -3.0, 3.0];
        candidate.absolute = vec![-5.0];
        candidate.project_multipliers(&sub);
        assert_eq!(candidate.inequalities, [0.0, 0.0, 3.0]);
        assert_eq!(candidate.absolute, [-2.0]);
    }
}
