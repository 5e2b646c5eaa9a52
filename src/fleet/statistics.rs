//! Distribution of the estimates over the records, and records that stand out.

use serde::Serialize;

/// Modified z-score from which a value is an outlier (Iglewicz and Hoaglin 1993).
const OUTLYING: f64 = 3.5;
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
    /// Standard deviation of a normal distribution with the same median absolute deviation.
    pub deviation: f64,
    /// Number of outliers.
    pub outliers: usize,
    /// Values in the order of the records; NaN where a record has none.
    #[serde(skip)]
    pub values: Vec<f64>,
}

impl Distribution {
    /// Distribution of values, NaN for those that are absent; `None` without any.
    pub fn of(name: String, unit: String, values: Vec<f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let median = quantile(&sorted, 0.5);
        let mut deviations: Vec<f64> = sorted.iter().map(|x| (x - median).abs()).collect();
        deviations.sort_by(f64::total_cmp);
        let mut found = Self {
            name,
            unit,
            count: sorted.len(),
            median,
            quartiles: [0.25, 0.75].map(|share| quantile(&sorted, share)),
            central95: [0.025, 0.975].map(|share| quantile(&sorted, share)),
            range: [first, last],
            deviation: DEVIATION * quantile(&deviations, 0.5),
            outliers: 0,
            values,
        };
        let outliers = found
            .values
            .iter()
            .filter(|x| found.is_outlier(**x))
            .count();
        found.outliers = outliers;
        Some(found)
    }

    /// Distance from the median in standard deviations; 0 where half of the values are equal.
    pub fn score(&self, value: f64) -> f64 {
        match self.deviation > 0.0 {
            true => (value - self.median) / self.deviation,
            false => 0.0,
        }
    }

    fn is_outlier(&self, value: f64) -> bool {
        self.score(value).abs() > OUTLYING
    }

    /// True for a quantity that is the same in all records, as a fixed one.
    pub fn is_constant(&self) -> bool {
        self.range[0] == self.range[1]
    }
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
    /// Name of the estimate that lies farthest from its median.
    pub estimate: String,
    /// Its value.
    pub value: f64,
    /// Its distance from the median in standard deviations.
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
            let scores = distributions.iter().map(|d| (d, d.score(d.values[index])));
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

    /// Quantiles of 1 to 101 are their numbers; the median absolute deviation is 25.
    #[test]
    fn quantiles_and_outliers_of_known_values() {
        let mut values: Vec<f64> = (1..=101).map(f64::from).collect();
        values.push(f64::NAN);
        let found = Distribution::of("x".into(), String::new(), values.clone()).expect("values");
        assert_eq!((found.count, found.median), (101, 51.0));
        assert_eq!(found.quartiles, [26.0, 76.0]);
        assert_eq!(found.deviation, 25.0 * DEVIATION);
        assert_eq!(found.outliers, 0);
        values[7] = 51.0 + 4.0 * 26.0 * DEVIATION;
        let found = Distribution::of("x".into(), String::new(), values).expect("values");
        assert_eq!(found.outliers, 1);
        let outliers = Statistics::find_outliers(&[found], &|i| i.to_string());
        assert_eq!(outliers[0].record, "7");
        assert!((3.5..4.5).contains(&outliers[0].score));
    }

    #[test]
    fn equal_values_have_no_outliers() {
        let found = Distribution::of("x".into(), String::new(), vec![2.0; 5]).expect("values");
        assert!(found.is_constant() && found.outliers == 0);
        assert_eq!(
            Distribution::of("x".into(), String::new(), vec![f64::NAN]),
            None
        );
    }
}
