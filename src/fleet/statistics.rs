//! Distribution of the estimates over the records, and records that stand out.

/// Modified z-score from which a value is an outlier (Iglewicz and Hoaglin 1993).
pub(super) const OUTLYING: f64 = 3.5;
/// Fewest records of which trend and outliers are read.
pub(super) const FEWEST: usize = 8;
/// Most records all of whose pairs give the median slope.
const MOST_PAIRED: usize = 1000;
/// Deviations below this share of the median are rounding errors.
const ROUNDING: f64 = 1e-12;
/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
const DEVIATION: f64 = 1.4826;

/// Distribution of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Name of the estimate, as in a row.
    pub name: String,
    /// Unit; empty if dimensionless.
    pub unit: String,
    /// Median.
    pub median: f64,
    /// Slope of the line through the estimates over the axis of the fleet, and the line at each record; without a slope the median.
    pub slope: Option<f64>,
    /// The line at each record.
    pub line: Vec<f64>,
    /// Values in the order of the records; NaN where a record has none.
    pub values: Vec<f64>,
    /// Distances from the line, in standard deviations; 0 with fewer than 8 values, and of a record without a value or a place on the axis.
    pub scores: Vec<f64>,
}

impl Distribution {
    /// Distribution of values over an axis, NaN for those that are absent; `None` without any.
    pub fn of(name: &str, unit: &str, values: Vec<f64>, axis: &[f64]) -> Option<Self> {
        let all = sorted(values.iter().copied());
        let median = quantile(&all, 0.5)?;
        let slope = median_slope(axis, &values);
        // The line leads through the median of the values less their trend.
        let moved = |(x, y): (&f64, &f64)| y - slope.unwrap_or(0.0) * x;
        let offset = quantile(&sorted(axis.iter().zip(&values).map(moved)), 0.5);
        let line: Vec<f64> = match slope.zip(offset) {
            Some((slope, offset)) => axis.iter().map(|x| offset + slope * x).collect(),
            None => vec![median; values.len()],
        };
        let residuals = || values.iter().zip(&line).map(|(y, line)| y - line);
        let deviation = DEVIATION * quantile(&sorted(residuals().map(f64::abs)), 0.5)?;
        // The deviation of few values is uncertain: of three normal ones a quarter has an outlier.
        let is_judged = all.len() >= FEWEST && deviation > ROUNDING * median.abs();
        let score = |residual: f64| match is_judged && residual.is_finite() {
            true => residual / deviation,
            false => 0.0,
        };
        Some(Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            median,
            slope,
            scores: residuals().map(score).collect(),
            line,
            values,
        })
    }

    /// True for a quantity that is the same in all records, as a fixed one.
    pub fn is_constant(&self) -> bool {
        let mut present = self.values.iter().filter(|x| x.is_finite());
        present.all(|x| *x == self.median)
    }

    /// Indices of the outliers.
    pub fn outliers(&self) -> impl Iterator<Item = usize> {
        let scores = self.scores.iter().enumerate();
        scores
            .filter(|(_, score)| score.abs() > OUTLYING)
            .map(|(i, _)| i)
    }
}

/// Median slope of pairs of records (Theil 1950): of many records each with the one half of them later. `None` with fewer than [`FEWEST`]
/// and with equal places.
fn median_slope(axis: &[f64], values: &[f64]) -> Option<f64> {
    let pairs = axis.iter().zip(values).map(|(x, y)| (*x, *y));
    let mut points: Vec<(f64, f64)> = pairs
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    (points.len() >= FEWEST).then_some(())?;
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = points.len() / 2;
    let slopes = points.iter().enumerate().flat_map(|(i, a)| {
        let later = match points.len() > MOST_PAIRED {
            true => points.get(i + half..=i + half).unwrap_or_default(),
            false => &points[i + 1..],
        };
        later.iter().map(move |b| (b.1 - a.1) / (b.0 - a.0))
    });
    quantile(&sorted(slopes), 0.5)
}

/// The finite values in their order.
fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut finite: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite
}

/// Quantile of sorted values, interpolated linearly between them; `None` without any.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let position = share * (sorted.len().max(1) - 1) as f64;
    let below = position.floor() as usize;
    let low = *sorted.get(below)?;
    let above = sorted.get(below + 1).unwrap_or(&low);
    Some(low + (position - below as f64) * (above - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: Vec<f64>, axis: &[f64]) -> Option<Distribution> {
        Distribution::of("x", "", values, axis)
    }

    /// Quantiles of 1 to 101 are their numbers; the median absolute deviation is 25.
    #[test]
    fn quantiles_and_outliers_of_known_values() {
        let mut values: Vec<f64> = (1..=101).map(f64::from).collect();
        values.push(f64::NAN);
        let found = of(values.clone(), &[]).expect("values");
        assert_eq!(found.median, 51.0);
        assert_eq!(found.outliers().count(), 0);
        values[7] = 51.0 + 4.0 * 26.0 * DEVIATION;
        let found = of(values, &[]).expect("values");
        assert_eq!(found.outliers().collect::<Vec<_>>(), [7]);
        assert!((3.5..4.5).contains(&found.scores[7]));
    }

    /// On a line of slope -2 with errors of 0.1, a value that is no extreme stands out by its distance from the line; of 40 records as of
    /// 4000.
    #[test]
    fn outliers_are_those_of_the_trend() {
        for count in [40, 4000] {
            let axis: Vec<f64> = (0..count).map(f64::from).collect();
            let value = |x: &f64| 10.0 - 2.0 * x + 0.1 * (x * 2.4).sin();
            let mut values: Vec<f64> = axis.iter().map(value).collect();
            values[20] += 5.0;
            let found = of(values, &axis).expect("values");
            assert!((found.slope.expect("a slope") + 2.0).abs() < 0.01);
            assert_eq!(found.outliers().collect::<Vec<_>>(), [20]);
        }
    }

    #[test]
    fn equal_values_have_no_outliers() {
        let found = of(vec![2.0; 5], &[]).expect("values");
        assert!(found.is_constant() && found.outliers().count() == 0);
        assert_eq!(of(vec![f64::NAN], &[]), None);
    }
}
