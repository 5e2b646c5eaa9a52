//! Distribution of the estimates over the records, and records that stand out.

use serde::Serialize;

/// Modified z-score from which a value is an outlier (Iglewicz and Hoaglin 1993).
const OUTLYING: f64 = 3.5;
/// Fewest records of which a trend is read.
const FEWEST: usize = 8;
/// Most records of whose pairs the median slope is taken; of more every second, third, ... is used.
const MOST_PAIRED: usize = 1000;
/// Deviations below this share of the median are rounding errors.
const ROUNDING: f64 = 1e-12;
/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
const DEVIATION: f64 = 1.4826;

/// Distribution of an estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// Name of the estimate, as in a row.
    pub name: String,
    /// Unit; empty if dimensionless.
    pub unit: String,
    /// Number of values.
    pub count: usize,
    /// Median.
    pub median: f64,
    /// First and third quartile.
    pub quartiles: [f64; 2],
    /// Percentiles 2.5 and 97.5.
    pub central95: [f64; 2],
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Change for a unit of the axis of the fleet: the median slope of all pairs of records (Theil 1950, Sen 1968); 0 without an axis.
    pub slope: f64,
    /// Standard deviation about that line of a normal distribution with the same median absolute deviation.
    pub deviation: f64,
    /// Number of outliers.
    pub outliers: usize,
    /// Values in the order of the records; NaN where a record has none.
    #[serde(skip)]
    pub values: Vec<f64>,
    /// Distances from the line, in standard deviations; 0 where half of the values lie on it.
    #[serde(skip)]
    pub scores: Vec<f64>,
}

impl Distribution {
    /// Distribution of values over an axis, NaN for those that are absent; `None` without any.
    pub fn of(name: String, unit: String, values: Vec<f64>, axis: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let median = quantile(&sorted, 0.5);
        let slope = slope(axis, &values);
        let residuals: Vec<f64> = line_residuals(axis, &values, slope);
        let mut deviations: Vec<f64> = (residuals.iter().filter(|r| r.is_finite()))
            .map(|residual| residual.abs())
            .collect();
        deviations.sort_by(f64::total_cmp);
        let deviation = DEVIATION * quantile(&deviations, 0.5);
        let score = |residual: &f64| match deviation > ROUNDING * median.abs() {
            true => residual / deviation,
            false => 0.0,
        };
        let scores: Vec<f64> = residuals.iter().map(score).collect();
        Some(Self {
            name,
            unit,
            count: sorted.len(),
            median,
            quartiles: [0.25, 0.75].map(|share| quantile(&sorted, share)),
            central95: [0.025, 0.975].map(|share| quantile(&sorted, share)),
            range: [first, last],
            slope,
            deviation,
            outliers: scores.iter().filter(|score| score.abs() > OUTLYING).count(),
            values,
            scores,
        })
    }

    /// True for a quantity that is the same in all records, as a fixed one.
    pub fn is_constant(&self) -> bool {
        self.range[0] == self.range[1]
    }
}

/// Median slope of all pairs, of at most [`MOST_PAIRED`] records; 0 with fewer than [`FEWEST`] values of which a trend would be read.
fn slope(axis: &[f64], values: &[f64]) -> f64 {
    let points = axis.iter().zip(values).map(|(x, y)| (*x, *y));
    let points: Vec<(f64, f64)> = points
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    if points.len() < FEWEST {
        return 0.0;
    }
    let every = points.len().div_ceil(MOST_PAIRED);
    let points: Vec<(f64, f64)> = points.into_iter().step_by(every).collect();
    let mut slopes = Vec::new();
    for (i, a) in points.iter().enumerate() {
        let later = points[i + 1..].iter().filter(|b| b.0 != a.0);
        slopes.extend(later.map(|b| (b.1 - a.1) / (b.0 - a.0)));
    }
    slopes.sort_by(f64::total_cmp);
    match slopes.is_empty() {
        true => 0.0,
        false => quantile(&slopes, 0.5),
    }
}

/// Distances from the line with a slope, whose median is 0; without a place on the axis from the median of the values.
fn line_residuals(axis: &[f64], values: &[f64], slope: f64) -> Vec<f64> {
    let median_of = |list: &mut dyn Iterator<Item = f64>| {
        let mut list: Vec<f64> = list.filter(|x| x.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        if list.is_empty() {
            0.0
        } else {
            quantile(&list, 0.5)
        }
    };
    let middle = median_of(&mut axis.iter().copied());
    let place = |i: usize| {
        axis.get(i)
            .copied()
            .filter(|x| x.is_finite())
            .unwrap_or(middle)
    };
    let moved = |(i, y): (usize, &f64)| y - slope * (place(i) - middle);
    let level = median_of(&mut values.iter().enumerate().map(moved));
    values
        .iter()
        .enumerate()
        .map(|(i, y)| moved((i, y)) - level)
        .collect()
}

/// Quantile of sorted values, interpolated linearly between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// An estimate of a record that stands out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlier {
    /// Index of the record.
    #[serde(skip)]
    pub index: usize,
    /// The record.
    pub record: String,
    /// Name of the estimate that lies farthest from its trend.
    pub estimate: String,
    /// Its value.
    pub value: f64,
    /// Its distance from the trend in standard deviations.
    pub score: f64,
}

/// Statistics of a fleet.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Statistics {
    /// Records.
    pub records: usize,
    /// Records without a row.
    pub missing: usize,
    /// Rows with the verdicts Adequate, Check and Inadequate.
    pub verdicts: [usize; 3],
    /// First reasons of the verdicts other than Adequate, each with its number of rows, the most frequent first.
    pub reasons: Vec<(String, usize)>,
    /// Rows with an error.
    pub errors: usize,
    /// Of these, rows that a time limit ended.
    pub time_limits: usize,
    /// Distribution of each estimate.
    pub distributions: Vec<Distribution>,
    /// Records that stand out, the farthest first.
    pub outliers: Vec<Outlier>,
    /// Sum of the times of the records, s.
    pub seconds: f64,
}

impl Statistics {
    /// The records with an outlying estimate, each once, the farthest first.
    pub fn find_outliers(
        distributions: &[Distribution],
        names: &dyn Fn(usize) -> String,
    ) -> Vec<Outlier> {
        let count = distributions.first().map_or(0, |d| d.values.len());
        let farthest = |index: usize| {
            let scores = distributions.iter().map(|d| (d, d.scores[index]));
            let scores = scores.filter(|(_, score)| score.abs() > OUTLYING);
            scores.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        };
        let mut found: Vec<Outlier> = (0..count)
            .filter_map(|index| {
                let (distribution, score) = farthest(index)?;
                Some(Outlier {
                    index,
                    record: names(index),
                    estimate: distribution.name.clone(),
                    value: distribution.values[index],
                    score,
                })
            })
            .collect();
        found.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: Vec<f64>, axis: &[f64]) -> Option<Distribution> {
        Distribution::of("x".into(), String::new(), values, axis)
    }

    /// Quantiles of 1 to 101 are their numbers; the median absolute deviation is 25.
    #[test]
    fn quantiles_and_outliers_of_known_values() {
        let mut values: Vec<f64> = (1..=101).map(f64::from).collect();
        values.push(f64::NAN);
        let found = of(values.clone(), &[]).expect("values");
        assert_eq!((found.count, found.median), (101, 51.0));
        assert_eq!(found.quartiles, [26.0, 76.0]);
        assert_eq!(found.deviation, 25.0 * DEVIATION);
        assert_eq!(found.outliers, 0);
        values[7] = 51.0 + 4.0 * 26.0 * DEVIATION;
        let found = of(values, &[]).expect("values");
        assert_eq!(found.outliers, 1);
        let outliers = Statistics::find_outliers(&[found], &|i| i.to_string());
        assert_eq!(outliers[0].record, "7");
        assert!((3.5..4.5).contains(&outliers[0].score));
    }

    /// On a line of slope -2 with errors of 0.1, a value that is no extreme stands out by its distance from the line.
    #[test]
    fn outliers_are_those_of_the_trend() {
        let axis: Vec<f64> = (0..40).map(f64::from).collect();
        let value = |x: &f64| 10.0 - 2.0 * x + 0.1 * (x * 2.4).sin();
        let mut values: Vec<f64> = axis.iter().map(value).collect();
        values[20] += 5.0;
        let found = of(values, &axis).expect("values");
        assert!((found.slope + 2.0).abs() < 0.01, "{}", found.slope);
        assert_eq!(found.outliers, 1);
        assert!(found.scores[20] > 20.0);
    }

    #[test]
    fn equal_values_have_no_outliers() {
        let found = of(vec![2.0; 5], &[]).expect("values");
        assert!(found.is_constant() && found.outliers == 0);
        assert_eq!(of(vec![f64::NAN], &[]), None);
    }
}
