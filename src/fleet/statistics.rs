//! Distribution of the estimates over the records, and records that stand out.

use rand::SeedableRng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// Modified z-score from which a value is an outlier (Iglewicz and Hoaglin 1993).
const OUTLYING: f64 = 3.5;
/// Fewest records of which trend and outliers are read.
pub(super) const FEWEST: usize = 8;
/// Most records of whose pairs the median slope is taken, chosen at random with [`SEED`].
const MOST_PAIRED: usize = 1000;
/// Seed of the choice of records.
const SEED: u64 = 1;
/// Deviations below this share of the median are rounding errors.
const ROUNDING: f64 = 1e-12;
/// Ratio of the standard deviation to the mean absolute deviation of a normal distribution.
const MEAN_DEVIATION: f64 = 1.2533;
/// Quantile 0.975 of the normal distribution.
const NORMAL: f64 = 1.96;
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
    /// Percentiles 2.5 and 97.5.
    pub central95: [f64; 2],
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Trend over the axis of the fleet; none with fewer than 8 records on it.
    pub trend: Option<LinearTrend>,
    /// Number of outliers.
    pub outliers: usize,
    /// Values in the order of the records; NaN where a record has none.
    pub values: Vec<f64>,
    /// Distances from the line, in standard deviations; 0 with fewer than 8 values, and where all lie on it. Of a record without a place on the axis, and without a
    /// trend, from the median of all values, in their deviation from it.
    pub scores: Vec<f64>,
}

impl Distribution {
    /// Distribution of values over an axis, NaN for those that are absent; `None` without any.
    pub fn of(name: String, unit: String, values: Vec<f64>, axis: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let median = quantile(&sorted, 0.5);
        let trend = LinearTrend::of(axis, &values);
        let from_line = |(i, y): (usize, &f64)| match (&trend, axis.get(i)) {
            (Some(trend), Some(x)) => y - trend.value - trend.slope * (x - trend.at),
            _ => y - median,
        };
        let residuals: Vec<f64> = values.iter().enumerate().map(from_line).collect();
        let deviation = deviation_of(&residuals);
        // The deviation of few values is uncertain: of three normal ones a quarter has an outlier. A record without a place is none.
        let is_judged = sorted.len() >= FEWEST && deviation > ROUNDING * median.abs();
        let score = |residual: &f64| match is_judged && residual.is_finite() {
            true => residual / deviation,
            false => 0.0,
        };
        let scores: Vec<f64> = residuals.iter().map(score).collect();
        Some(Self {
            name,
            unit,
            median,
            central95: [0.025, 0.975].map(|share| quantile(&sorted, share)),
            range: [first, last],
            trend,
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

/// Standard deviation of a normal distribution with the median absolute value of the finite `residuals`, or with their mean where more than half
/// of them are zero (Iglewicz and Hoaglin 1993); 0 without any.
fn deviation_of(residuals: &[f64]) -> f64 {
    let finite = residuals.iter().filter(|r| r.is_finite());
    let sizes: Vec<f64> = finite.map(|residual| residual.abs()).collect();
    let mean = sizes.iter().sum::<f64>() / sizes.len().max(1) as f64;
    match median_of(sizes) {
        0.0 => MEAN_DEVIATION * mean,
        median => DEVIATION * median,
    }
}

/// Median; 0 without values.
fn median_of(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.is_empty() {
        true => 0.0,
        false => quantile(&values, 0.5),
    }
}

/// A straight line through an estimate over the axis of a fleet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearTrend {
    /// Change for a unit of the axis: the median slope of all pairs of records (Theil 1950).
    pub slope: f64,
    /// 95 % confidence interval of the slope, from the variance of Kendall's statistic (Sen 1968).
    pub slope95: [f64; 2],
    /// Median of the axis.
    pub at: f64,
    /// Value of the line there.
    pub value: f64,
}

impl LinearTrend {
    /// Of at most [`MOST_PAIRED`] records; `None` with fewer than [`FEWEST`] or equal places.
    fn of(axis: &[f64], values: &[f64]) -> Option<Self> {
        let points = axis.iter().zip(values).map(|(x, y)| (*x, *y));
        let points: Vec<(f64, f64)> = points
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        (points.len() >= FEWEST).then_some(())?;
        // Of many records a random part: those of a table may alternate between sensors.
        let mut used = points.clone();
        if used.len() > MOST_PAIRED {
            let mut random = ChaCha8Rng::seed_from_u64(SEED);
            used = points.sample(&mut random, MOST_PAIRED).copied().collect();
        }
        let mut slopes = Vec::new();
        for (i, a) in used.iter().enumerate() {
            let later = used[i + 1..].iter().filter(|b| b.0 != a.0);
            slopes.extend(later.map(|b| (b.1 - a.1) / (b.0 - a.0)));
        }
        (!slopes.is_empty()).then_some(())?;
        slopes.sort_by(f64::total_cmp);
        let slope = quantile(&slopes, 0.5);
        let n = used.len() as f64;
        let width = NORMAL * (n * (n - 1.0) * (2.0 * n + 5.0) / 18.0).sqrt();
        let share = 0.5 * width / slopes.len() as f64;
        let limits = [0.5 - share, 0.5 + share].map(|share| share.clamp(0.0, 1.0));
        let at = median_of(points.iter().map(|(x, _)| *x).collect());
        let moved = points.iter().map(|(x, y)| y - slope * (x - at));
        Some(Self {
            slope,
            slope95: limits.map(|share| quantile(&slopes, share)),
            at,
            value: median_of(moved.collect()),
        })
    }
}

/// Quantile of sorted values, interpolated linearly between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// The records with an outlying estimate, each once with the estimate that lies farthest: index of the record, its distribution and the
/// distance in standard deviations, the farthest record first.
pub fn outliers(distributions: &[Distribution]) -> Vec<(usize, &Distribution, f64)> {
    let count = distributions.first().map_or(0, |d| d.values.len());
    let farthest = |index: usize| {
        let scores = distributions.iter().map(|d| (index, d, d.scores[index]));
        let scores = scores.filter(|(.., score)| score.abs() > OUTLYING);
        scores.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    };
    let mut found: Vec<_> = (0..count).filter_map(farthest).collect();
    found.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    found
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
        assert_eq!(found.median, 51.0);
        assert_eq!(found.outliers, 0);
        values[7] = 51.0 + 4.0 * 26.0 * DEVIATION;
        let found = of(values, &[]).expect("values");
        assert_eq!(found.outliers, 1);
        let found = [found];
        let [(7, _, score)] = outliers(&found)[..] else {
            panic!("one outlier");
        };
        assert!((3.5..4.5).contains(&score));
    }

    /// On a line of slope -2 with errors of 0.1, a value that is no extreme stands out by its distance from the line.
    #[test]
    fn outliers_are_those_of_the_trend() {
        let axis: Vec<f64> = (0..40).map(f64::from).collect();
        let value = |x: &f64| 10.0 - 2.0 * x + 0.1 * (x * 2.4).sin();
        let mut values: Vec<f64> = axis.iter().map(value).collect();
        values[20] += 5.0;
        let found = of(values, &axis).expect("values");
        let trend = found.trend.expect("a trend");
        assert!((trend.slope + 2.0).abs() < 0.01, "{trend:?}");
        let [low, high] = trend.slope95;
        assert!(low < -2.0 && -2.0 < high && high - low < 0.02, "{trend:?}");
        assert_eq!(found.outliers, 1);
        assert!(found.scores[20] > 20.0);
    }

    /// The interval of Sen's slope for pure noise contains zero in 95 of 100 series.
    #[test]
    fn the_interval_of_the_slope_has_its_level() {
        let mut state = 1u64;
        let mut noise = || {
            // Sum of uniform numbers of a linear congruential generator.
            let mut uniform = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            (0..6).map(|_| uniform()).sum::<f64>()
        };
        let axis: Vec<f64> = (0..30).map(f64::from).collect();
        let contains = |values: Vec<f64>| {
            let [low, high] = LinearTrend::of(&axis, &values).expect("a trend").slope95;
            low <= 0.0 && 0.0 <= high
        };
        let count = (0..400)
            .filter(|_| contains((0..30).map(|_| noise()).collect()))
            .count();
        // Three standard deviations of 400 trials are 13.
        assert!((367..=393).contains(&count), "{count}");
    }

    #[test]
    fn equal_values_have_no_outliers() {
        let found = of(vec![2.0; 5], &[]).expect("values");
        assert!(found.is_constant() && found.outliers == 0);
        assert_eq!(of(vec![f64::NAN], &[]), None);
    }
}
