//! Curves in pixels: gaps, thinning and clipping.

use super::drawing::{Frame, Point};

/// Splits a curve at points that cannot be drawn.
pub(super) fn runs(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        if point.0.is_finite() && point.1.is_finite() {
            if let Some(run) = runs.last_mut() {
                run.push(point);
            }
        } else {
            runs.push(Vec::new());
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Keeps the first, lowest, highest and last of the consecutive points in one pixel column; the thinned curve covers
/// the same pixels.
pub(super) fn thin(run: &[Point]) -> Vec<Point> {
    let mut kept = Vec::new();
    for column in run.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        keep_extremes(column, &mut kept);
    }
    kept
}

fn keep_extremes(column: &[Point], kept: &mut Vec<Point>) {
    let mut indices = [0; 4];
    for (index, point) in column.iter().enumerate() {
        if point.1 < column[indices[1]].1 {
            indices[1] = index;
        }
        if point.1 > column[indices[2]].1 {
            indices[2] = index;
        }
        indices[3] = index;
    }
    indices.sort_unstable();
    for (place, &index) in indices.iter().enumerate() {
        if place == 0 || index != indices[place - 1] {
            kept.push(column[index]);
        }
    }
}

/// The parts of a path inside a frame.
pub(super) fn clip(path: &[Point], frame: &Frame) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for pair in path.windows(2) {
        let Some((from, to)) = clip_segment(pair[0], pair[1], frame) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&from) => piece.push(to),
            _ => pieces.push(vec![from, to]),
        }
    }
    pieces
}

/// The part of a segment inside a frame, by Liang and Barsky's parametric clipping.
fn clip_segment(from: Point, to: Point, frame: &Frame) -> Option<(Point, Point)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (slope, room) in [
        (-dx, from.0 - frame.left),
        (dx, frame.right() - from.0),
        (-dy, from.1 - frame.top),
        (dy, frame.bottom() - from.1),
    ] {
        if slope == 0.0 && room < 0.0 {
            return None;
        } else if slope < 0.0 {
            enter = enter.max(room / slope);
        } else if slope > 0.0 {
            leave = leave.min(room / slope);
        }
    }
    // Ends inside the frame are passed on unchanged, so that consecutive segments join exactly.
    let at = |s: f64| (from.0 + s * dx, from.1 + s * dy);
    let first = if enter > 0.0 { at(enter) } else { from };
    let last = if leave < 1.0 { at(leave) } else { to };
    (enter <= leave).then_some((first, last))
}

/// Moves a point into a frame.
pub(super) fn clamp(point: Point, frame: &Frame) -> Point {
    (
        point.0.clamp(frame.left, frame.right()),
        point.1.clamp(frame.top, frame.bottom()),
    )
}

/// True for a point in a frame, edges included.
pub(super) fn inside(point: Point, frame: &Frame) -> bool {
    clamp(point, frame) == point
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame {
        left: 0.0,
        top: 0.0,
        width: 10.0,
        height: 10.0,
    };

    #[test]
    fn gaps_split_a_curve() {
        let y = [1.0, f64::NAN, 2.0, 3.0, f64::INFINITY];
        let points = y.iter().enumerate().map(|(i, &y)| (i as f64, y));
        assert_eq!(
            runs(points),
            [vec![(0.0, 1.0)], vec![(2.0, 2.0), (3.0, 3.0)]]
        );
    }

    #[test]
    fn thinning_keeps_every_extreme() {
        let wave = |i: usize| (i as f64 * 600.0 / 128_000.0, (i as f64 * 0.7).sin() * 100.0);
        let mut points: Vec<Point> = (0..128_000).map(wave).collect();
        points[77_777].1 = 250.0;
        points[99_999].1 = -250.0;
        let thinned = thin(&points);
        assert!(thinned.len() <= 4 * 600);
        assert!(thinned.contains(&points[77_777]) && thinned.contains(&points[99_999]));
        assert_eq!(thinned.first(), points.first());
        assert_eq!(thinned.last(), points.last());
        assert!(thinned.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [(0.5, 3.0), (1.5, 1.0), (2.5, 2.0)];
        assert_eq!(thin(&points), points);
    }

    #[test]
    fn clipping_cuts_at_the_edge() {
        let path = [(5.0, 5.0), (5.0, 20.0), (8.0, 20.0), (8.0, 5.0)];
        let pieces = clip(&path, &FRAME);
        let left = vec![(5.0, 5.0), (5.0, 10.0)];
        let right = vec![(8.0, 10.0), (8.0, 5.0)];
        assert_eq!(pieces, [left, right]);
        assert!(clip(&[(20.0, 0.0), (20.0, 5.0)], &FRAME).is_empty());
    }
}
