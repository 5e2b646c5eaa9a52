//! Thinning of curves, which bounds the size of pages of long records without visible change.

use super::axis::{Scale, drawable, even, extent};
use super::plot_mark::{Mark, MarkKind};
use kmcfit_core::internals::signal::Extremes;

/// Detail of the curves of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Detail {
    /// Longest curve that is not thinned, points.
    pub(super) few: usize,
    /// Columns of a longer curve, in each of which its first, lowest, highest and last point are kept.
    columns: u32,
}

impl Detail {
    /// Columns finer than the pixels of a chart.
    pub const FULL: Self = Self {
        few: 4000,
        columns: 700,
    };
    /// Fewest columns.
    const FEWEST: u32 = 16;

    /// Half the columns; `None` where curves would lose their shape.
    pub fn coarser(self) -> Option<Self> {
        let columns = self.columns / 2;
        (columns >= Self::FEWEST).then_some(Self {
            few: 2 * columns as usize,
            columns,
        })
    }
}

/// Tolerance, relative to the range of the curve, within which points on a straight line are removed.
const STRAIGHT: f64 = 1e-6;

/// A curve, points or a band of more than `most` points on the scales of x and y, with the points that show.
pub(super) fn thinned(
    mut mark: Mark,
    [x_scale, y_scale]: [Scale; 2],
    most: usize,
    detail: Detail,
) -> Mark {
    let is_band = mark.kind == MarkKind::Band;
    let is_curve = is_band || matches!(mark.kind, MarkKind::Line | MarkKind::Points);
    if !is_curve || mark.x.len() <= most {
        return mark;
    }
    let mut ys = vec![(mark.y.as_slice(), y_scale)];
    ys.extend(is_band.then_some((&mark.high[..], y_scale)));
    let is_joined = mark.kind != MarkKind::Points;
    let (points, is_thinned) = kept((&mark.x, x_scale), &ys, is_joined, detail);
    let Mark { x, y, high, .. } = &mut mark;
    for values in [x, y, high].into_iter().filter(|values| !values.is_empty()) {
        *values = points.iter().map(|i| values[*i]).collect();
    }
    mark.is_thinned |= is_thinned;
    mark
}

/// Indices of the kept points of curves `ys` over one `x`, and true if removed points would be visible when zoomed.
/// `joined`: the points are joined by lines.
fn kept(
    x: (&[f64], Scale),
    ys: &[(&[f64], Scale)],
    joined: bool,
    detail: Detail,
) -> (Vec<usize>, bool) {
    let count = (ys.iter().map(|(y, _)| y.len())).fold(x.0.len(), usize::min);
    let thinned = count > detail.few;
    let points = match thinned {
        true => columns(x, ys, count, f64::from(detail.columns)),
        false => (0..count).collect(),
    };
    let [(y, scale)] = ys else {
        return (points, thinned);
    };
    let straight = match joined {
        true => corners(x, (y, *scale), &points),
        false => points.clone(),
    };
    // Curves over the same points share their abscissae, so removing few points saves nothing.
    match straight.len() < points.len() / 2 {
        true => (straight, thinned),
        false => (points, thinned),
    }
}

/// Per column the first and last point, and the lowest and highest of every curve.
fn columns(
    (x, scale): (&[f64], Scale),
    ys: &[(&[f64], Scale)],
    count: usize,
    columns: f64,
) -> Vec<usize> {
    let (low, high) = extent(scale, x).unwrap_or((0.0, 1.0));
    let column = |x: f64| (columns * (even(scale, x) - low) / (high - low)).floor();
    let bound = |column: f64| {
        let place = low + column / columns * (high - low);
        match scale {
            Scale::Linear => place,
            Scale::Log => 10f64.powf(place),
        }
    };
    let x = &x[..count];
    let is_ascending = x.is_sorted();
    let mut kept = Vec::new();
    let mut first = 0;
    while first < count {
        let here = column(x[first]);
        // A point that cannot be drawn has no column.
        let inside = match low < high {
            true => bound(here)..bound(here + 1.0),
            false => f64::NEG_INFINITY..f64::INFINITY,
        };
        let after = &x[first + 1..];
        let next = match is_ascending && after.first().is_some_and(|x| inside.contains(x)) {
            true => after.partition_point(|x| *x < inside.end),
            false => {
                let next = after.iter().position(|x| !inside.contains(x));
                next.unwrap_or(after.len())
            }
        };
        let end = first + 1 + next;
        let mut few = vec![first, end - 1];
        for (y, scale) in ys {
            few.extend(peaks(*scale, &y[first..end]).map(|i| first + i));
        }
        few.sort_unstable();
        few.dedup();
        kept.extend(few);
        first = end;
    }
    kept
}

/// Indices of the first of the lowest and of the last of the highest drawable values, and of the first one that cannot be drawn.
fn peaks(scale: Scale, y: &[f64]) -> impl Iterator<Item = usize> {
    let drawable = drawable(scale);
    let found = Extremes::of(y, drawable.clone());
    let lowest = y.iter().position(|y| *y == found.low);
    let highest = y.iter().rposition(|y| *y == found.high);
    let ends = [lowest, highest].into_iter();
    let ends = ends.filter(move |_| found.low <= found.high);
    let gap = (!found.are_all_within).then(|| y.iter().position(|y| !drawable.contains(y)));
    ends.chain([gap.flatten()]).flatten()
}

/// The ends of the straight segments of a curve: all points between them are within [`STRAIGHT`] of the segments.
fn corners(x: (&[f64], Scale), y: (&[f64], Scale), points: &[usize]) -> Vec<usize> {
    let Some((low, high)) = extent(y.1, y.0) else {
        return points.to_vec();
    };
    let room = STRAIGHT * (high - low);
    let at = |i: &usize| (even(x.1, x.0[*i]), even(y.1, y.0[*i]));
    let places: Vec<(f64, f64)> = points.iter().map(at).collect();
    // Positions in `points`.
    let mut kept = vec![0];
    let mut slopes = (f64::NEG_INFINITY, f64::INFINITY);
    for now in 1..points.len() {
        let before = now - 1;
        let from = |anchor: usize| {
            let ((x0, y0), (x1, y1)) = (places[anchor], places[now]);
            let run = x1 - x0;
            (
                (y1 - y0) / run,
                room / run,
                run > 0.0 && (y1 - y0).is_finite(),
            )
        };
        let anchor = kept.last().copied().unwrap_or(before);
        let (slope, wide, drawable) = from(anchor);
        if drawable && slopes.0 <= slope && slope <= slopes.1 {
            slopes = (slopes.0.max(slope - wide), slopes.1.min(slope + wide));
            continue;
        }
        if anchor != before {
            kept.push(before);
        }
        let (slope, wide, drawable) = from(before);
        slopes = (slope - wide, slope + wide);
        if !drawable {
            kept.push(now);
            slopes = (f64::NEG_INFINITY, f64::INFINITY);
        }
    }
    kept.push(points.len().saturating_sub(1));
    kept.dedup();
    kept.iter()
        .filter_map(|i| points.get(*i))
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINEAR: Scale = Scale::Linear;

    #[test]
    fn short_curves_stay_whole_and_long_ones_keep_their_peaks() {
        let x: Vec<f64> = (0..65_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|x| (0.3 * x).sin()).collect();
        y[40_001] = 9.0;
        y[50_001] = f64::NAN;
        let (points, thinned) = kept((&x, LINEAR), &[(&y, LINEAR)], true, Detail::FULL);
        assert!(thinned && points.len() <= 4 * 701 + 1, "{}", points.len());
        assert!(
            [0, 40_001, 50_001, 64_999]
                .iter()
                .all(|i| points.contains(i))
        );
        assert!(points.is_sorted());
        let (points, thinned) = kept(
            (&x[..4000], LINEAR),
            &[(&y[..4000], LINEAR)],
            true,
            Detail::FULL,
        );
        assert!(!thinned && points.len() == 4000);
    }

    #[test]
    fn straight_pieces_are_their_ends() {
        let x: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 0.01).collect();
        let bent: Vec<f64> = x.iter().map(|x| (x - 4.0).abs()).collect();
        let of = |y: &[f64]| kept((&x, LINEAR), &[(y, LINEAR)], true, Detail::FULL).0;
        assert_eq!(of(&bent), [0, 400, 1000]);
        assert_eq!(of(&vec![2.0; 1001]), [0, 1000]);
        // Removed points are on the remaining segments.
        let curved: Vec<f64> = x.iter().map(|x| (1e-3 * x).sin()).collect();
        let corners = of(&curved);
        assert!(corners.len() < 500, "{}", corners.len());
        for pair in corners.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            for i in a..b {
                let share = (x[i] - x[a]) / (x[b] - x[a]);
                let line = curved[a] + share * (curved[b] - curved[a]);
                assert!((line - curved[i]).abs() <= 1.01 * STRAIGHT * 0.01, "{i}");
            }
        }
    }

    #[test]
    fn points_above_each_other_are_one_column() {
        let (x, y) = (
            vec![1.0; 9000],
            (0..9000).map(f64::from).collect::<Vec<_>>(),
        );
        let kept = kept((&x, LINEAR), &[(&y, LINEAR)], false, Detail::FULL);
        assert_eq!(kept.0, [0, 8999]);
    }

    /// On a scale of frequencies each octave has its columns, with the peak of each; a frequency of zero has none.
    #[test]
    fn columns_of_logarithmic_scales_are_equally_wide_on_them() {
        let x: Vec<f64> = (0..40_000).map(f64::from).collect();
        let mut y = vec![1.0; 40_000];
        (y[300], y[30_000]) = (50.0, 1e-6);
        let log = Scale::Log;
        let (points, thinned) = kept((&x, log), &[(&y, log)], false, Detail::FULL);
        assert!(thinned && points.is_sorted());
        assert!(
            [0, 1, 300, 30_000, 39_999]
                .iter()
                .all(|i| points.contains(i))
        );
        // 700 columns of log10(39,999) = 4.602: 152 in each decade, of each the first and the last point.
        let above = |from: usize| {
            let decade = from..10 * from;
            points.iter().filter(|i| decade.contains(*i)).count()
        };
        let decades = [300, 3000].map(above);
        assert!(decades.iter().all(|n| n.abs_diff(304) <= 8), "{decades:?}");
    }

    #[test]
    fn gaps_stay_gaps() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let mut y = vec![1.0; 100];
        y[50] = f64::NAN;
        let (points, _) = kept((&x, LINEAR), &[(&y, LINEAR)], true, Detail::FULL);
        assert_eq!(points, [0, 49, 50, 51, 99]);
    }
}
