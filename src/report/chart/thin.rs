//! Thinning of long curves, which bounds the size of drawings without visible change.

use super::axis::{Scale, drawable, even, extent};
use super::plot_mark::{Mark, MarkKind};
use kmcfit_core::signal::Extremes;

/// Longest curve that is drawn whole, points.
const MOST: usize = 4000;
/// Columns of a longer curve, in each of which its first, lowest, highest and last point are kept: finer than the pixels of a panel.
const COLUMNS: f64 = 700.0;

/// A curve, points or a band of more than [`MOST`] points on the scales of x and y, with the points that show.
pub(super) fn thinned(mut mark: Mark, [x_scale, y_scale]: [Scale; 2]) -> Mark {
    let is_curve = matches!(
        mark.kind,
        MarkKind::Line | MarkKind::Points | MarkKind::Band
    );
    let Mark { x, y, high, .. } = &mut mark;
    let mut ys = vec![(y.as_slice(), y_scale)];
    ys.extend((!high.is_empty()).then_some((&high[..], y_scale)));
    let count = (ys.iter().map(|(y, _)| y.len())).fold(x.len(), usize::min);
    if !is_curve || count <= MOST {
        return mark;
    }
    let points = columns((x, x_scale), &ys, count, COLUMNS);
    for values in [x, y, high].into_iter().filter(|values| !values.is_empty()) {
        *values = points.iter().map(|i| values[*i]).collect();
    }
    mark.is_thinned = true;
    mark
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
        let position = low + column / columns * (high - low);
        match scale {
            Scale::Linear => position,
            Scale::Log => 10f64.powf(position),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Colour, Style};

    fn kept(x: &[f64], y: &[f64], scale: Scale) -> Mark {
        let mark = Mark::line("", x, y, Style::new(Colour::Blue));
        thinned(mark, [scale, Scale::Linear])
    }

    #[test]
    fn short_curves_stay_whole_and_long_ones_keep_their_peaks() {
        let x: Vec<f64> = (0..65_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|x| (0.3 * x).sin()).collect();
        y[40_001] = 9.0;
        y[50_001] = f64::NAN;
        let mark = kept(&x, &y, Scale::Linear);
        assert!(mark.is_thinned && mark.x.len() <= 4 * 701 + 1);
        let at = |i: f64| mark.x.contains(&i);
        assert!([0.0, 40_001.0, 50_001.0, 64_999.0].into_iter().all(at));
        assert!(mark.x.is_sorted());
        let mark = kept(&x[..4000], &y[..4000], Scale::Linear);
        assert!(!mark.is_thinned && mark.x.len() == 4000);
        // Points above each other are one column.
        let mark = kept(&vec![1.0; 9000], &x[..9000], Scale::Linear);
        assert_eq!(mark.y, [0.0, 8999.0]);
    }

    /// On a scale of frequencies each octave has its columns, with the peak of each; a frequency of zero has none.
    #[test]
    fn columns_of_logarithmic_scales_are_equally_wide_on_them() {
        let x: Vec<f64> = (0..40_000).map(f64::from).collect();
        let mut y = vec![1.0; 40_000];
        (y[300], y[30_000]) = (50.0, 1e-6);
        let mark = kept(&x, &y, Scale::Log);
        let at = |i: f64| mark.x.contains(&i);
        assert!([0.0, 1.0, 300.0, 30_000.0, 39_999.0].into_iter().all(at));
        // 700 columns of log10(39,999) = 4.602: 152 in each decade, of each the first and the last point.
        let above = |from: f64| {
            let decade = from..10.0 * from;
            mark.x.iter().filter(|x| decade.contains(x)).count()
        };
        let decades = [300.0, 3000.0].map(above);
        assert!(decades.iter().all(|n| n.abs_diff(304) <= 8), "{decades:?}");
    }
}
