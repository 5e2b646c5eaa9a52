//! Error of a piecewise-linear function that stands for a smooth one.
//!
//! The best approximation, in L2, of a function with the second derivative `f''` on knots a distance `h` apart differs from it by
//!
//! ```text
//! e = f'' h^2 (1/12 - s (1 - s)/2),    0 <= s <= 1 between two knots
//! ```
//!
//! (the leading term for smooth `f`): `f'' h^2/12` at the knots, half of it with the opposite sign between them. `f''` follows from the
//! values at the knots by divided differences. Noise of the values adds about a fifth of their standard error, which widens
//! intervals by 2 %.

use crate::functions::{Basis, CoefficientFunction};

/// Fewest knots that have a second difference.
const FEWEST: usize = 3;

/// `e` at these times (s) of a function with the parameters `theta`, in its unit; zero for other bases.
pub(super) fn basis_error(
    function: &CoefficientFunction,
    theta: &[f64],
    times: &[f64],
) -> Vec<f64> {
    let Some(Basis::PiecewiseLinear { knots }) = &function.basis else {
        return vec![0.0; times.len()];
    };
    if knots.len() < FEWEST || theta.len() != knots.len() {
        return vec![0.0; times.len()];
    }
    let bends = second_derivatives(knots, theta);
    let at = |time: &f64| {
        let after = knots.partition_point(|knot| knot <= time);
        let i = after.clamp(1, knots.len() - 1) - 1;
        let h = knots[i + 1] - knots[i];
        let s = ((time - knots[i]) / h).clamp(0.0, 1.0);
        let bend = bends[i] + s * (bends[i + 1] - bends[i]);
        bend * h * h * (1.0 / 12.0 - 0.5 * s * (1.0 - s))
    };
    times.iter().map(at).collect()
}

/// Second derivatives at the knots by divided differences; those of the neighbours at both ends.
fn second_derivatives(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let slope = |i: usize| (values[i + 1] - values[i]) / (knots[i + 1] - knots[i]);
    let inner = (1..knots.len() - 1).map(|i| {
        let width = 0.5 * (knots[i + 1] - knots[i - 1]);
        (slope(i) - slope(i - 1)) / width
    });
    let inner: Vec<f64> = inner.collect();
    let ends = [inner[0], inner[inner.len() - 1]];
    std::iter::once(ends[0])
        .chain(inner.iter().copied())
        .chain(std::iter::once(ends[1]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::functions::CoefficientKind;
    use crate::system::Grid;

    /// The projection of a parabola onto a piecewise-linear basis: the error is that of the formula away from the ends, where the
    /// projection differs, to the error of the projection by the trapezoidal rule.
    #[test]
    fn the_error_of_a_parabola_is_that_of_its_projection() {
        let grid = Grid::new(0.0, 12.0, 4801).unwrap();
        let knots: Vec<f64> = (0..=12).map(f64::from).collect();
        let basis = Basis::PiecewiseLinear { knots };
        let parabola: Vec<f64> = grid.times().iter().map(|t| 1.0 + 0.5 * t * t).collect();
        let theta = basis.project(&grid, &parabola).unwrap();
        let start = vec![0.0; theta.len()];
        let function = CoefficientFunction::free(CoefficientKind::Stiffness, basis, &grid, start);
        let found = basis_error(&function, &theta, &grid.times());
        let fitted = function.design.multiply(&theta, grid.nodes());
        for i in 2000..2800 {
            let error = parabola[i] - fitted[i];
            assert!(
                (found[i] - error).abs() < 1e-3 / 12.0,
                "{i}: {} {error}",
                found[i]
            );
        }
    }

    #[test]
    fn a_line_and_other_bases_have_no_error() {
        let grid = Grid::new(0.0, 1.0, 11).unwrap();
        let knots = vec![0.0, 0.25, 1.0];
        let basis = Basis::PiecewiseLinear { knots };
        let kind = CoefficientKind::Stiffness;
        let line = CoefficientFunction::free(kind, basis, &grid, vec![1.0, 1.5, 3.0]);
        assert_eq!(
            basis_error(&line, &line.start, &grid.times()),
            vec![0.0; 11]
        );
        let constant = CoefficientFunction::constant(kind, 1.0, 11);
        assert_eq!(basis_error(&constant, &[1.0], &grid.times()), vec![0.0; 11]);
    }
}
