//! Histograms and trends of the estimates of a fleet.

use super::statistics::Distribution;
use super::trend::Trend;
use crate::report::{Axis, Colour, Figure, Mark, Panel, Style, quantity};

/// Largest number of bars of a histogram.
const MOST_BARS: usize = 40;
/// Most points of a trend; of more records every second, third, ... is drawn.
const MOST_POINTS: usize = 4000;
/// Bins of the medians of a trend.
const BINS: usize = 12;
/// Number of records from which the dots of a trend are smaller.
const MANY: usize = 400;

/// Histograms of all estimates.
pub(super) fn histograms(shown: &[&Distribution]) -> Option<Figure> {
    let figure = Figure::new(
        "distributions",
        "Histograms",
        "Number of records in equal intervals; the dashed line is the median. The outermost intervals also contain all values farther than three interquartile ranges from the quartiles.",
    );
    let figure = figure.columns(2).panels(shown.iter().map(|d| histogram(d)));
    (!figure.panels.is_empty()).then_some(figure)
}

fn histogram(distribution: &Distribution) -> Panel {
    // A trend widens the distribution: the distance of the quartiles measures it, the deviation only its scatter about the trend.
    let [first, third] = distribution.quartiles;
    let reach = 3.0 * (third - first);
    let [mut low, mut high] = distribution.range;
    if reach > 0.0 {
        low = low.max(first - reach);
        high = high.min(third + reach);
    }
    let bars = ((distribution.count as f64).sqrt().ceil() as usize).clamp(5, MOST_BARS);
    let width = (high - low) / bars as f64;
    let mut counts = vec![0usize; bars];
    for value in distribution.values.iter().filter(|x| x.is_finite()) {
        let bar = ((value - low) / width)
            .floor()
            .clamp(0.0, (bars - 1) as f64);
        counts[bar as usize] += 1;
    }
    // The outline of the bars.
    let (mut x, mut y) = (vec![low], vec![0.0]);
    for (i, count) in counts.iter().enumerate() {
        let left = low + i as f64 * width;
        x.extend([left, left + width]);
        y.extend([*count as f64; 2]);
    }
    x.push(high);
    y.push(0.0);
    let name = quantity(&distribution.name);
    Panel::new(
        Axis::linear(name, distribution.unit.clone()),
        Axis::linear("records", ""),
    )
    .mark(Mark::line("records", &x, &y, Style::new(Colour::nth(0))))
    .mark(Mark::vertical("median", distribution.median, Style::nth(1)))
}

/// An estimate along the trend: each record, and the medians of bins.
pub(super) fn trend_figure(distribution: &Distribution, trend: &Trend) -> Option<Figure> {
    let pairs = trend.values.iter().zip(&distribution.values);
    let mut pairs: Vec<(f64, f64)> = pairs
        .map(|(x, y)| (*x, *y))
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    if pairs.len() < 3 || pairs.first()?.0 == pairs.last()?.0 {
        return None;
    }
    let every = pairs.len().div_ceil(MOST_POINTS);
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.iter().step_by(every).copied().unzip();
    let bins = BINS.min(pairs.len() / 3).max(1);
    let medians = pairs.chunks(pairs.len().div_ceil(bins)).map(|bin| {
        let middle = |mut list: Vec<f64>| {
            list.sort_by(f64::total_cmp);
            list[list.len() / 2]
        };
        let (x, y): (Vec<f64>, Vec<f64>) = bin.iter().copied().unzip();
        (middle(x), middle(y))
    });
    let (middle_x, middle_y): (Vec<f64>, Vec<f64>) = medians.unzip();
    let name = quantity(&distribution.name);
    let width = if x.len() > MANY { 3.0 } else { 6.0 };
    // No dot is cut by the frame.
    let (low, high) = (pairs.first()?.0, pairs.last()?.0);
    let margin = 0.03 * (high - low);
    let panel = Panel::new(
        Axis::linear(trend.name.clone(), trend.unit.clone()).limits(low - margin, high + margin),
        Axis::linear(name.clone(), distribution.unit.clone()),
    )
    .mark(Mark::points(
        "records",
        &x,
        &y,
        Style::new(Colour::nth(0)).width(width),
    ))
    .mark(Mark::line(
        "median of neighbours",
        &middle_x,
        &middle_y,
        Style::nth(1),
    ));
    let panel = match &distribution.trend {
        Some(line) => {
            let at = |x: f64| line.value + line.slope * (x - line.at);
            let ends = [at(low), at(high)];
            panel.mark(Mark::line("trend", &[low, high], &ends, Style::nth(2)))
        }
        None => panel,
    };
    let thinned = match every {
        1 => String::new(),
        every => format!(" One record of {every} is drawn."),
    };
    Some(
        Figure::new(
            format!("trend-{}", distribution.name),
            format!("{name} over {}", trend.name),
            format!("Each record, the medians of equal numbers of neighbours, and the line with the median slope of all pairs of records.{thinned}"),
        )
        .panel(panel),
    )
}
