//! The chart of the summary in a terminal: the estimated coefficient that varies most relative to its interval.

use super::columns::{interval_columns, named_column};
use super::document::ResultDocument;
use super::result_table::ResultTable;
use crate::error::InputError;
use kmcfit_core::number_format::significant;
use std::path::Path;

/// Columns for the numbers beside a chart.
const MARGIN: usize = 10;
/// Rows of the chart, and its narrowest and widest width in columns.
const ROWS: usize = 6;
const WIDTHS: [usize; 2] = [40, 72];
/// Largest extent of a band beyond the estimate, relative to its range, that the plot of the summary includes.
const WIDE_BAND: f64 = 1.5;
/// Variations below this share of the largest value are rounding errors.
const ROUNDING: f64 = 1e-9;

/// A coefficient over time: name, unit, estimate and 95 % band.
struct Curve {
    name: String,
    unit: String,
    values: Vec<f64>,
    band: Option<[Vec<f64>; 2]>,
}

impl Curve {
    /// Range of the estimate relative to the mean width of its band, or to its largest value without one; `None` for a constant.
    fn variation(&self) -> Option<f64> {
        let [low, high] = range(&self.values);
        let largest = low.abs().max(high.abs());
        let is_varying = high - low > ROUNDING * largest;
        let width = self.half_width().map(|half| 2.0 * half);
        is_varying.then(|| (high - low) / width.filter(|w| *w > 0.0).unwrap_or(largest))
    }

    /// Mean half-width of the band.
    fn half_width(&self) -> Option<f64> {
        let [low, high] = self.band.as_ref()?;
        let halves = low.iter().zip(high).map(|(low, high)| 0.5 * (high - low));
        let (sum, count) = halves
            .filter(|half| half.is_finite())
            .fold((0.0, 0), |(sum, count), half| (sum + half, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }

    /// Range of the plot: that of the estimate and its band, of which at most [`WIDE_BAND`] ranges of the estimate beyond it.
    fn extent(&self) -> [f64; 2] {
        let [low, high] = range(&self.values);
        let room = WIDE_BAND * (high - low);
        let band = self
            .band
            .as_ref()
            .map(|[from, to]| [range(from)[0], range(to)[1]]);
        let [from, to] = band.unwrap_or([low, high]);
        [low.min(from.max(low - room)), high.max(to.min(high + room))]
    }

    fn plot(&self, times: &[f64], width: usize) -> String {
        let band = self.half_width().map_or(String::new(), |half| {
            format!(
                "; shaded: 95 % band, mean half-width {}",
                significant(half, 2)
            )
        });
        let mut chart = Chart::new(width, times);
        chart.values = self.extent();
        if let Some([low, high]) = &self.band {
            chart.shade(times, low, high);
        }
        chart.line(times, &self.values);
        format!("{} in {}{band}\n{}", self.name, self.unit, chart.text())
    }
}

/// The plot of the summary: the estimated coefficient that varies most relative to its interval, at most 72 columns wide; `None` if all
/// are constant.
///
/// # Errors
/// When the table of the coefficients cannot be read.
pub fn summary_plot(
    folder: &Path,
    document: &ResultDocument,
    width: usize,
) -> Result<Option<String>, InputError> {
    let table = ResultTable::read(&folder.join("functions.csv"))?;
    let times = table.required("t_s")?;
    let curve = |name: &str| {
        let unit = &document.functions.get(name)?.unit;
        let column = named_column(name, document.is_rotation())?;
        let [low, high] = interval_columns(&column).map(|end| table.column(&end));
        Some(Curve {
            name: super::answer::quantity(name),
            unit: unit.clone(),
            values: table.column(&column)?,
            band: low.zip(high).map(|(low, high)| [low, high]),
        })
    };
    let names = document.all_functions();
    let names = names.filter(|(name, f)| document.is_determined(name) && !f.negligible);
    let curves = names.filter_map(|(name, _)| curve(name));
    let scored = curves.filter_map(|curve| Some((curve.variation()?, curve)));
    let most = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    let width = width.clamp(WIDTHS[0], WIDTHS[1]);
    Ok(most.map(|(_, curve)| curve.plot(&times, width)))
}

/// A chart in Braille: two dots across and four down in each character.
struct Chart {
    width: usize,
    dots: Vec<u8>,
    shades: Vec<bool>,
    times: [f64; 2],
    values: [f64; 2],
}

impl Chart {
    fn new(width: usize, times: &[f64]) -> Self {
        let width = width - MARGIN - 2;
        Self {
            width,
            dots: vec![0; width * ROWS],
            shades: vec![false; width * ROWS],
            times: range(times),
            values: [0.0, 1.0],
        }
    }

    /// The dot of a point, from the upper left.
    fn dot(&self, t: f64, y: f64) -> Option<[usize; 2]> {
        let location = |x: f64, [low, high]: [f64; 2], dots: usize| {
            let share = match high > low {
                true => (x - low) / (high - low),
                false => 0.5,
            };
            let last = (dots - 1) as f64;
            (share.is_finite()).then(|| (share * last).round().clamp(0.0, last) as usize)
        };
        let across = location(t, self.times, 2 * self.width)?;
        let up = location(y, self.values, 4 * ROWS)?;
        Some([across, 4 * ROWS - 1 - up])
    }

    fn line(&mut self, times: &[f64], values: &[f64]) {
        let mut before: Option<[usize; 2]> = None;
        for (t, y) in times.iter().zip(values) {
            let here = self.dot(*t, *y);
            if let Some(end) = here {
                let begin = before.unwrap_or(end);
                let steps = (0..2).map(|i| begin[i].abs_diff(end[i])).max().unwrap_or(0);
                for step in 0..=steps {
                    let share = step as f64 / steps.max(1) as f64;
                    let at = |i: usize| {
                        let (a, b) = (begin[i] as f64, end[i] as f64);
                        (a + share * (b - a)).round() as usize
                    };
                    self.set([at(0), at(1)]);
                }
            }
            before = here;
        }
    }

    fn set(&mut self, [x, y]: [usize; 2]) {
        // Braille counts its first three rows column by column, the fourth after them.
        const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        self.dots[y / 4 * self.width + x / 2] |= BITS[y % 4][x % 2];
    }

    /// Shades the characters whose middle is between two curves at their time.
    fn shade(&mut self, times: &[f64], low: &[f64], high: &[f64]) {
        let [first, last] = self.times;
        let [bottom, top] = self.values;
        for column in 0..self.width {
            let t = first + (column as f64 + 0.5) / self.width as f64 * (last - first);
            let row = times
                .partition_point(|time| *time < t)
                .min(times.len().saturating_sub(1));
            let (Some(low), Some(high)) = (low.get(row), high.get(row)) else {
                continue;
            };
            for line in 0..ROWS {
                let share = 1.0 - (line as f64 + 0.5) / ROWS as f64;
                let y = bottom + share * (top - bottom);
                self.shades[line * self.width + column] = (*low..=*high).contains(&y);
            }
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for row in 0..ROWS {
            let label = match row {
                0 => number(self.values[1]),
                _ if row + 1 == ROWS => number(self.values[0]),
                _ => String::new(),
            };
            let cells = row * self.width..(row + 1) * self.width;
            let cell = |i: usize| match (self.dots[i], self.shades[i]) {
                (0, true) => '░',
                (0, false) => ' ',
                (dots, _) => char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '),
            };
            let line: String = cells.map(cell).collect();
            text += &format!("{label:>MARGIN$} │{}\n", line.trim_end());
        }
        let [first, last] = self.times.map(number);
        let end = format!("{last} s");
        let room = self.width - first.len().min(self.width);
        text + &format!("{:>MARGIN$} {first} {end:>room$}\n", "")
    }
}

/// Smallest and largest finite value.
fn range(values: &[f64]) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|x| x.is_finite());
    match (finite().reduce(f64::min), finite().reduce(f64::max)) {
        (Some(low), Some(high)) => [low, high],
        _ => [0.0, 1.0],
    }
}

/// Four significant digits, in at most ten characters.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    let plain = format!("{rounded}");
    match plain.len() < MARGIN {
        true => plain,
        false => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use insta::assert_snapshot;

    /// A falling line with a band of half-width 3 in a range of 20: the band takes a row above and below; a constant has no variation.
    #[test]
    fn the_band_of_the_small_plot_is_shaded() {
        let times: Vec<f64> = (0..101).map(|i| f64::from(i) * 0.1).collect();
        let values: Vec<f64> = times.iter().map(|t| 30.0 - 2.0 * t).collect();
        let band = [-3.0, 3.0].map(|half| values.iter().map(|v| v + half).collect());
        let mut curve = Curve {
            name: "stiffness k".into(),
            unit: "N/m".into(),
            values,
            band: Some(band),
        };
        assert_snapshot!(curve.plot(&times, 60), @"
        stiffness k in N/m; shaded: 95 % band, mean half-width 3
                33 │⣀⣀⡀░░
                   │ ░⠈⠉⠉⠓⠒⠒⠤⠤⢄⣀⣀⡀░
                   │            ░⠈⠉⠉⠒⠒⠢⠤⠤⢄⣀⣀⡀░
                   │                      ░░⠉⠉⠑⠒⠒⠢⠤⠤⣀⣀⡀░
                   │                                ░░⠈⠉⠉⠑⠒⠒⠤⠤⠤⣀⣀⡀░
                 7 │                                           ░░⠈⠉⠉
                   0                                            10 s
        ");
        assert!((curve.variation().expect("it varies") - 20.0 / 6.0).abs() < 1e-12);
        // A wide band does not flatten the line: 1.5 ranges of it on each side.
        curve.band = Some([-1e3, 1e3].map(|end| vec![end; 101]));
        assert_eq!(curve.extent(), [-20.0, 60.0]);
        curve.values = vec![2.0; 101];
        assert_eq!(curve.variation(), None);
        // Without times there is nothing to draw.
        curve.values.clear();
        assert!(curve.plot(&[], 40).lines().count() == ROWS + 2);
    }
}
