//! Selection rules on a path of fits with falling penalty weights: discrepancy principle, L-curve, generalised cross-validation.

use super::path::PathPoint;
use crate::problem::Problem;

/// The largest weight with chi-square at most `n + 2 sqrt(2 n)`.
pub(super) fn discrepancy(problem: &Problem, points: &[PathPoint]) -> Option<usize> {
    let limit = problem.largest_chi_square()?;
    points.iter().position(|p| p.misfit <= limit)
}

/// Point of largest curvature of (log misfit, log roughness) along the path.
pub(super) fn l_curve(points: &[PathPoint]) -> Option<usize> {
    let position = |p: &PathPoint| (p.misfit.ln(), p.roughness.ln());
    let curvature = |w: &[PathPoint]| {
        let [(x0, y0), (x1, y1), (x2, y2)] = [position(&w[0]), position(&w[1]), position(&w[2])];
        // Menger curvature, signed by the turn; the corner turns right as the weight falls.
        let cross = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0);
        let side = |ax: f64, ay: f64, bx: f64, by: f64| (ax - bx).hypot(ay - by);
        let sides = side(x0, y0, x1, y1) * side(x1, y1, x2, y2) * side(x0, y0, x2, y2);
        -2.0 * cross / sides
    };
    let turns = points.windows(3).map(curvature).enumerate();
    let finite = turns.filter(|(_, c)| c.is_finite() && *c > 0.0);
    finite
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(i, _)| i + 1)
}

/// Point of the least score of generalised cross-validation.
pub(super) fn gcv(points: &[PathPoint]) -> Option<usize> {
    let scores = points.iter().enumerate().filter(|(_, p)| p.gcv.is_finite());
    scores
        .min_by(|a, b| a.1.gcv.total_cmp(&b.1.gcv))
        .map(|(i, _)| i)
}

/// Note on the choice of the discrepancy principle.
pub(super) fn remark(
    problem: &Problem,
    index: Option<usize>,
    points: &[PathPoint],
) -> Option<String> {
    match index {
        Some(0) => Some(
                "the largest weight tried fits within the noise and was used: the data are compatible with the smoothest \
                 functions"
                .into(),
        ),
        None => {
            let least = points
                .iter()
                .map(|p| p.misfit)
                .fold(f64::INFINITY, f64::min);
            Some(format!(
                "no weight on the path lowers chi-square to {:.1}; the least is {least:.1}. The sigma may be too \
                 small, or the model cannot explain the samples",
                problem.largest_chi_square().unwrap_or(f64::NAN)
            ))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a path with these natural logarithms of misfit and roughness.
    fn path(positions: impl IntoIterator<Item = [f64; 2]>) -> Vec<PathPoint> {
        let point = |[misfit, roughness]: [f64; 2]| PathPoint {
            weight: 1.0,
            iterations: 1,
            misfit: misfit.exp(),
            roughness: roughness.exp(),
            degrees_of_freedom: 1.0,
            gcv: 1.0,
            bic: None,
            parameters: Vec::new(),
        };
        positions.into_iter().map(point).collect()
    }

    /// As the weight falls, first the misfit falls and then the roughness rises.
    #[test]
    fn the_corner_is_where_roughness_begins_to_rise() {
        for corner in 1..8 {
            let position = |i: usize| {
                let [left, right] = [corner.max(i) - i, corner.max(i) - corner];
                [3.0 + 2.0 * left as f64, 2.0 * right as f64 - 5.0]
            };
            assert_eq!(l_curve(&path((0..9).map(position))), Some(corner));
            // In the opposite order the path turns to the other side and has no corner.
            assert_eq!(l_curve(&path((0..9).rev().map(position))), None);
        }
    }

    /// From falling misfit to rising roughness in two turns, at the third point and at the fifth.
    #[test]
    fn the_sharper_of_two_turns_is_the_corner() {
        for (between, corner) in [(160f64, 4), (110.0, 2)] {
            let headings = [180.0, 180.0, between, between, 90.0, 90.0];
            let mut at = [1.0, -2.0];
            let steps = headings.map(|degrees| {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                at = [at[0] + cosine, at[1] + sine];
                at
            });
            let positions = std::iter::once([1.0, -2.0]).chain(steps);
            assert_eq!(l_curve(&path(positions)), Some(corner));
        }
    }

    /// Two arcs: one of radius 3 by chords of 40 degrees, then one of radius 1 by chords of 10 degrees. The angles between chords
    /// are larger on the first, the curvature is larger on the second.
    #[test]
    fn the_corner_has_the_largest_curvature_for_any_density_of_points() {
        let chord = |radius: f64, degrees: f64| 2.0 * radius * (0.5 * degrees).to_radians().sin();
        let wide = [160.0, 120.0].map(|heading| (heading, chord(3.0, 40.0)));
        let narrow = [95.0, 85.0, 75.0, 65.0].map(|heading| (heading, chord(1.0, 10.0)));
        let mut at = [0.0, 0.0];
        let steps = wide.into_iter().chain(narrow).map(|(heading, length)| {
            let (sine, cosine) = f64::to_radians(heading).sin_cos();
            at = [at[0] + length * cosine, at[1] + length * sine];
            at
        });
        let positions: Vec<_> = std::iter::once([0.0, 0.0]).chain(steps).collect();
        let corner = l_curve(&path(positions)).expect("a corner");
        assert!((3..=5).contains(&corner), "{corner}");
    }
}
