//! Correlation of the noise of one channel, and whitening.

use super::autoregression::Autoregression;
use super::gaps::{Gaps, Predictor};
use super::input_errors::InputErrors;
use crate::signal::median;
use std::ops::Range;
use std::sync::Arc;

/// Largest deviation of a spacing of samples from the smallest one, as a share of it, for which samples are equally spaced.
const UNEVEN: f64 = 0.01;
/// Law of the correlation.
#[derive(Debug, Clone, PartialEq)]
pub enum CorrelationLaw {
    /// Autoregressive process of equally spaced samples.
    Autoregressive(Autoregression),
    /// `exp(-|t_i - t_j| / time)`, for samples at any times.
    Exponential {
        /// Correlation time, s.
        time: f64,
    },
    /// White noise plus the response to errors of the input, relative to the white noise; the response is that of a known system.
    InputErrors(Arc<InputErrors>),
}

/// Correlation of the noise of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    law: CorrelationLaw,
    /// Times of the samples, s.
    times: Arc<[f64]>,
    /// Runs of equally spaced samples without a gap; one run for the exponential law.
    runs: Vec<Range<usize>>,
    /// Predictors of samples that an ordinary predictor does not reach, in the order of the samples: of all but the first
    /// for the exponential law, of the first `p` samples after each gap for an autoregressive one.
    predictors: Vec<Predictor>,
    /// Gaps under an autoregressive law.
    gaps: Arc<Gaps>,
}

/// Runs of equally spaced samples without a gap; `None` if the samples are not equally spaced apart from gaps.
pub fn uninterrupted_runs(times: &[f64]) -> Option<Vec<Range<usize>>> {
    let spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if spacings.is_empty() {
        return Some(std::iter::once(0..times.len()).collect());
    }
    let usual = median(&*spacings);
    let mut runs = Vec::new();
    let mut first = 0;
    for (i, spacing) in spacings.into_iter().enumerate() {
        let steps = spacing / usual;
        if (steps - 1.0).abs() <= UNEVEN {
            continue;
        }
        // A gap is a multiple of the spacing.
        if steps < 1.5 || (steps - steps.round()).abs() > UNEVEN * steps {
            return None;
        }
        runs.push(first..i + 1);
        first = i + 1;
    }
    runs.push(first..times.len());
    Some(runs)
}

impl Correlation {
    /// Correlation under `law` of samples at `times`.
    ///
    /// After a gap of equally spaced samples each of the first `p` is predicted from the last `2 p + 1` samples before the gap and
    /// those since, which is exact where `p` of them are in a row and neglects what earlier samples add otherwise (Vecchia 1988). An
    /// autoregressive law of samples that are not equally spaced gives `None`.
    pub fn new(law: CorrelationLaw, times: &[f64]) -> Option<Self> {
        let (runs, gaps, predictors) = match &law {
            CorrelationLaw::Autoregressive(process) => {
                let runs = uninterrupted_runs(times)?;
                let gaps = Gaps::of(process.order(), &runs, times);
                let predictors = gaps.predictors(process, &runs);
                (runs, gaps, predictors)
            }
            CorrelationLaw::Exponential { time } => {
                return Some(Self::exponential(*time, times.into()));
            }
            CorrelationLaw::InputErrors(_) => (
                std::iter::once(0..times.len()).collect(),
                Gaps::default(),
                Vec::new(),
            ),
        };
        Some(Self {
            law,
            times: times.into(),
            runs,
            predictors,
            gaps: Arc::new(gaps),
        })
    }

    fn exponential(time: f64, times: Arc<[f64]>) -> Self {
        let later = times.windows(2).enumerate().map(|(i, pair)| {
            let link = (-(pair[1] - pair[0]) / time).exp();
            Predictor {
                sample: i + 1,
                coefficients: Arc::new([link]),
                variance: (1.0 - link) * (1.0 + link),
            }
        });
        Self {
            law: CorrelationLaw::Exponential { time },
            runs: std::iter::once(0..times.len()).collect(),
            predictors: later.collect(),
            gaps: Arc::default(),
            times,
        }
    }

    /// Law of the correlation.
    pub fn law(&self) -> &CorrelationLaw {
        &self.law
    }

    /// Number of estimated coefficients.
    pub fn order(&self) -> usize {
        match &self.law {
            CorrelationLaw::Autoregressive(process) => process.order(),
            CorrelationLaw::Exponential { .. } => 1,
            CorrelationLaw::InputErrors(_) => 0,
        }
    }

    /// The errors of the input, where these correlate the noise.
    pub fn input_errors(&self) -> Option<&InputErrors> {
        match &self.law {
            CorrelationLaw::InputErrors(errors) => Some(errors),
            _ => None,
        }
    }

    /// Coordinates of the law, in which its likelihood is close to quadratic: [`Autoregression::coordinates`], or the logarithm of the
    /// correlation time.
    pub fn coordinates(&self) -> Vec<f64> {
        match &self.law {
            CorrelationLaw::Autoregressive(process) => process.coordinates(),
            CorrelationLaw::Exponential { time } => vec![time.ln()],
            CorrelationLaw::InputErrors(_) => Vec::new(),
        }
    }

    /// The correlation of the same samples at other coordinates of the law.
    #[must_use]
    pub fn at(&self, coordinates: &[f64]) -> Self {
        match &self.law {
            CorrelationLaw::Autoregressive(_) => {
                let process = Autoregression::from_coordinates(coordinates);
                Self {
                    predictors: self.gaps.predictors(&process, &self.runs),
                    law: CorrelationLaw::Autoregressive(process),
                    times: Arc::clone(&self.times),
                    runs: self.runs.clone(),
                    gaps: Arc::clone(&self.gaps),
                }
            }
            CorrelationLaw::Exponential { .. } => {
                let time = coordinates.iter().sum::<f64>().exp();
                Self::exponential(time, Arc::clone(&self.times))
            }
            CorrelationLaw::InputErrors(_) => self.clone(),
        }
    }

    /// Runs without a gap, under an autoregressive law: there the predictor of a sample from the `p` before it is always the same.
    pub fn autoregressive_runs(&self) -> Option<&[Range<usize>]> {
        matches!(self.law, CorrelationLaw::Autoregressive(_)).then_some(&self.runs)
    }

    /// Correlation of the first `count` samples.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        let runs = self.runs.iter().filter(|run| run.start < count);
        let predictors = self.predictors.iter().filter(|p| p.sample < count);
        let law = match &self.law {
            CorrelationLaw::InputErrors(errors) => {
                CorrelationLaw::InputErrors(Arc::new(errors.first(count)))
            }
            law => law.clone(),
        };
        Self {
            law,
            times: self.times[..count.min(self.times.len())].into(),
            runs: runs.map(|run| run.start..run.end.min(count)).collect(),
            predictors: predictors.cloned().collect(),
            gaps: Arc::clone(&self.gaps),
        }
    }

    /// `W values`, of unit variance and uncorrelated for values of unit variance with this correlation.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        if let Some(errors) = self.input_errors() {
            return errors.whiten(values);
        }
        let mut out = values.to_vec();
        self.each_row(|i, coefficients, size| {
            let earlier = values[..i].iter().rev();
            let predicted: f64 = earlier.zip(coefficients).map(|(u, a)| a * u).sum();
            out[i] = size * (values[i] - predicted);
        });
        out
    }

    /// `W^T values`.
    pub fn whiten_transpose(&self, values: &[f64]) -> Vec<f64> {
        if let Some(errors) = self.input_errors() {
            return errors.whiten_transpose(values);
        }
        let mut out = vec![0.0; values.len()];
        self.each_row(|i, coefficients, size| {
            let scaled = size * values[i];
            out[i] += scaled;
            let earlier = out[..i].iter_mut().rev();
            earlier
                .zip(coefficients)
                .for_each(|(o, a)| *o -= a * scaled);
        });
        out
    }

    /// `W^-1 values`: noise with this correlation from independent values of unit variance.
    pub fn colour(&self, values: &[f64]) -> Vec<f64> {
        if let Some(errors) = self.input_errors() {
            return errors.colour(values);
        }
        let mut out = values.to_vec();
        self.each_row(|i, coefficients, size| {
            let earlier = out[..i].iter().rev();
            let predicted: f64 = earlier.zip(coefficients).map(|(u, a)| a * u).sum();
            out[i] = values[i] / size + predicted;
        });
        out
    }

    /// `log |R|`.
    pub fn log_determinant(&self) -> f64 {
        if let Some(errors) = self.input_errors() {
            return errors.log_determinant();
        }
        let mut sum = 0.0;
        self.each_row(|_, _, size| sum -= 2.0 * size.ln());
        sum
    }

    /// Passes each row of `W` to `take`: the index `i` of its sample, the predictor's coefficients of the samples `i - 1, i - 2,
    /// ...`, and the factor `1/sqrt(v)` of the prediction error.
    pub fn each_row(&self, mut take: impl FnMut(usize, &[f64], f64)) {
        if let Some(errors) = self.input_errors() {
            // Dense rows: for few samples.
            for i in 0..self.times.len() {
                let mut unit = vec![0.0; self.times.len()];
                unit[i] = 1.0;
                let row = errors.whiten_transpose(&unit);
                let earlier: Vec<f64> = row[..i].iter().rev().map(|a| -a / row[i]).collect();
                take(i, &earlier, row[i]);
            }
            return;
        }
        self.rows_of(|run| run.clone(), take);
    }

    /// As [`Self::each_row`], of the first `p` samples of each run.
    pub fn each_first_row(&self, take: impl FnMut(usize, &[f64], f64)) {
        let order = self.order();
        self.rows_of(|run| run.start..run.end.min(run.start + order), take);
    }

    fn rows_of(
        &self,
        part: impl Fn(&Range<usize>) -> Range<usize>,
        mut take: impl FnMut(usize, &[f64], f64),
    ) {
        let mut special = self.predictors.iter().peekable();
        for run in &self.runs {
            for i in part(run) {
                let (coefficients, variance) = match (special.peek(), &self.law) {
                    (Some(own), _) if own.sample == i => (&own.coefficients[..], own.variance),
                    (_, CorrelationLaw::Autoregressive(process)) => {
                        process.predictor(i - run.start)
                    }
                    _ => (&[][..], 1.0),
                };
                take(i, coefficients, 1.0 / variance.sqrt());
                special.next_if(|own| own.sample == i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn whitening(correlation: &Correlation, n: usize) -> DMatrix<f64> {
        let mut w = DMatrix::zeros(n, n);
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            w.set_column(j, &correlation.whiten(&unit).into());
        }
        w
    }

    /// `W R W^T = I` with the correlation matrix from the autocorrelations, the determinant, the transpose and the inverse, for
    /// AR(3), for AR(1) with single samples missing, and for irregular times. For AR(3) with a gap the correlation of a sample after the
    /// gap with those more than seven samples before it is neglected.
    #[test]
    fn whitening_is_a_root_of_the_inverse_correlation_matrix() {
        let n = 12;
        let process = |partial: &[f64]| Autoregression::new(partial.to_vec()).unwrap();
        let law = |partial: &[f64]| CorrelationLaw::Autoregressive(process(partial));
        let even: Vec<f64> = (0..n).map(|i| 0.1 * i as f64).collect();
        let missing: Vec<f64> = (0..n).map(|i| 0.1 * (i + i / 3) as f64).collect();
        let gap: Vec<f64> = (0..n).map(|i| 0.1 * (i + 3 * (i / 7)) as f64).collect();
        let irregular: Vec<f64> = (0..n).map(|i| (i as f64).powf(1.3)).collect();
        let third = [0.7, -0.5, 0.2];
        let exponential = CorrelationLaw::Exponential { time: 2.5 };
        let cases = [
            (law(&third), &even, 1e-12),
            (law(&[0.8]), &missing, 1e-12),
            (law(&third), &gap, 1e-3),
            (exponential, &irregular, 1e-12),
        ];
        for (law, times, tolerance) in cases {
            let correlation = Correlation::new(law.clone(), times).unwrap();
            let matrix = DMatrix::from_fn(n, n, |i, j| match &law {
                CorrelationLaw::Autoregressive(process) => {
                    let lag = ((times[i] - times[j]).abs() / 0.1).round() as usize;
                    process.autocorrelation(lag + 1)[lag]
                }
                CorrelationLaw::Exponential { time } => (-(times[i] - times[j]).abs() / time).exp(),
                CorrelationLaw::InputErrors(_) => unreachable!("tested beside the filter"),
            });
            let w = whitening(&correlation, n);
            let unit = &w * &matrix * w.transpose();
            let error = (unit - DMatrix::identity(n, n)).amax();
            assert!(error < tolerance, "{law:?} {error}");
            let expected = matrix.determinant().ln();
            assert!((correlation.log_determinant() - expected).abs() < tolerance);
            let values: Vec<f64> = (0..n).map(|i| (1.7 * i as f64).sin()).collect();
            let transposed = w.transpose() * DMatrix::from_column_slice(n, 1, &values);
            for (a, b) in correlation
                .whiten_transpose(&values)
                .iter()
                .zip(&transposed)
            {
                assert!((a - b).abs() < 1e-13);
            }
            let back = correlation.colour(&correlation.whiten(&values));
            for (a, b) in back.iter().zip(&values) {
                assert!((a - b).abs() < 1e-12);
            }
            let part = correlation.first(9).whiten(&values[..9]);
            assert_eq!(part, correlation.whiten(&values)[..9]);
            let same = correlation.at(&correlation.coordinates());
            let pairs = same.whiten(&values);
            for (a, b) in pairs.iter().zip(&correlation.whiten(&values)) {
                assert!((a - b).abs() < 1e-12);
            }
        }
        assert!(uninterrupted_runs(&irregular).is_none());
    }
}
