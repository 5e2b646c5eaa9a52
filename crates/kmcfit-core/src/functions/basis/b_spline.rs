//! Cubic B-splines: smooth functions with local parameters.

use super::knots::KnotSpans;
use super::space::BasisFunctions;

/// Degree of the pieces.
const DEGREE: usize = 3;

/// Clamped cubic B-splines: end knots are repeated, so that the first and the last parameter are the values at the ends of the
/// record.
pub(super) struct CubicSpline {
    knots: KnotSpans,
}

impl CubicSpline {
    /// Splines with the knots `knots` (s).
    pub fn new(knots: &[f64]) -> Self {
        Self {
            knots: KnotSpans::new(knots),
        }
    }

    /// Knot `i` of the clamped sequence, in which cell `s` starts at `i = s + DEGREE`.
    fn clamped(&self, i: usize) -> f64 {
        let index = i.saturating_sub(DEGREE).min(self.knots.cells());
        self.knots.times()[index]
    }
}

impl BasisFunctions for CubicSpline {
    fn parameters(&self) -> usize {
        self.knots.cells() + DEGREE
    }

    fn degree(&self) -> usize {
        DEGREE
    }

    fn breaks(&self) -> Vec<f64> {
        self.knots.times().to_vec()
    }

    /// Recursion of Cox and de Boor, by degree; its last steps compute derivatives:
    ///
    /// ```text
    /// N_{i,p}  = (t - u_i) / (u_{i+p} - u_i) N_{i,p-1}
    ///          + (u_{i+p+1} - t) / (u_{i+p+1} - u_{i+1}) N_{i+1,p-1}
    /// N_{i,p}' = p / (u_{i+p} - u_i) N_{i,p-1} - p / (u_{i+p+1} - u_{i+1}) N_{i+1,p-1}
    /// ```
    fn row(&self, t: f64, derivative: usize, entries: &mut Vec<(usize, f64)>) {
        let Some(degree_of_values) = DEGREE.checked_sub(derivative) else {
            return;
        };
        let (cell, t) = self.knots.locate(t);
        let mut values = [1.0, 0.0, 0.0, 0.0];
        for degree in 1..=DEGREE {
            let mut raised = [0.0; DEGREE + 1];
            for r in 0..degree {
                // Function of lower degree with support [begin, end].
                let i = cell + DEGREE + 1 + r - degree;
                let (begin, end) = (self.clamped(i), self.clamped(i + degree));
                let (falling, rising) = match degree <= degree_of_values {
                    true => (end - t, t - begin),
                    false => (-(degree as f64), degree as f64),
                };
                raised[r] += falling / (end - begin) * values[r];
                raised[r + 1] += rising / (end - begin) * values[r];
            }
            values = raised;
        }
        entries.extend(values.into_iter().enumerate().map(|(r, v)| (cell + r, v)));
    }
}
