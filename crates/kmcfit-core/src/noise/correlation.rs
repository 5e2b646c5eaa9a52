//! Correlation of the noise of one channel, and whitening.

use super::autoregression::Autoregression;
use std::ops::Range;

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
}

/// Correlation of the noise of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    law: CorrelationLaw,
    /// Runs of samples; noise of different runs is independent.
    runs: Vec<Range<usize>>,
    /// Correlation of each sample with the one before it, for the exponential law.
    links: Vec<f64>,
}

/// Runs of equally spaced samples without a gap; `None` if the samples are not equally spaced apart from gaps.
pub fn uninterrupted_runs(times: &[f64]) -> Option<Vec<Range<usize>>> {
    let mut spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = spacings.clone();
    sorted.sort_by(f64::total_cmp);
    let Some(&usual) = sorted.get(sorted.len() / 2) else {
        return Some(std::iter::once(0..times.len()).collect());
    };
    let mut runs = Vec::new();
    let mut first = 0;
    for (i, spacing) in spacings.drain(..).enumerate() {
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
    /// Noise on both sides of a gap of equally spaced samples counts as independent. An autoregressive law of samples that are
    /// not equally spaced gives `None`.
    pub fn new(law: CorrelationLaw, times: &[f64]) -> Option<Self> {
        let (runs, links) = match &law {
            CorrelationLaw::Autoregressive(_) => (uninterrupted_runs(times)?, Vec::new()),
            CorrelationLaw::Exponential { time } => {
                let later = times
                    .windows(2)
                    .map(|pair| (-(pair[1] - pair[0]) / time).exp());
                let links = std::iter::once(0.0).chain(later).collect();
                (std::iter::once(0..times.len()).collect(), links)
            }
        };
        Some(Self { law, runs, links })
    }

    /// Law of the correlation.
    pub fn law(&self) -> &CorrelationLaw {
        &self.law
    }

    /// Runs of samples; noise of different runs is independent.
    pub fn runs(&self) -> &[Range<usize>] {
        &self.runs
    }

    /// Number of estimated coefficients.
    pub fn order(&self) -> usize {
        match &self.law {
            CorrelationLaw::Autoregressive(process) => process.order(),
            CorrelationLaw::Exponential { .. } => 1,
        }
    }

    /// The same runs with an autoregressive process.
    pub fn with_process(&self, process: Autoregression) -> Self {
        Self {
            law: CorrelationLaw::Autoregressive(process),
            ..self.clone()
        }
    }

    /// Correlation of the first `count` samples.
    pub fn first(&self, count: usize) -> Self {
        let runs = self.runs.iter().filter(|run| run.start < count);
        Self {
            law: self.law.clone(),
            runs: runs.map(|run| run.start..run.end.min(count)).collect(),
            links: self.links.iter().copied().take(count).collect(),
        }
    }

    /// `W values`, of unit variance and uncorrelated for values of unit variance with this correlation.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
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
        let mut sum = 0.0;
        self.each_row(|_, _, size| sum -= 2.0 * size.ln());
        sum
    }

    /// Passes each row of `W` to `take`: the index `i` of its sample, the predictor's coefficients of the samples `i - 1, i - 2,
    /// ...`, and the factor `1/sqrt(v)` of the prediction error.
    pub fn each_row(&self, mut take: impl FnMut(usize, &[f64], f64)) {
        for run in &self.runs {
            for i in run.clone() {
                match &self.law {
                    CorrelationLaw::Autoregressive(process) => {
                        let (coefficients, variance) = process.predictor(i - run.start);
                        take(i, coefficients, 1.0 / variance.sqrt());
                    }
                    CorrelationLaw::Exponential { .. } if i == run.start => take(i, &[], 1.0),
                    CorrelationLaw::Exponential { .. } => {
                        let link = self.links[i];
                        let variance = (1.0 - link) * (1.0 + link);
                        take(i, &[link], 1.0 / variance.sqrt());
                    }
                }
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

    /// `W R W^T = I` with the correlation matrix from the autocorrelations, the determinant, the transpose and the inverse; with a
    /// gap the matrix has two blocks.
    #[test]
    fn whitening_is_a_root_of_the_inverse_correlation_matrix() {
        let n = 12;
        let process = Autoregression::new(vec![0.7, -0.5, 0.2]).unwrap();
        let lags = process.autocorrelation(n);
        let times: Vec<f64> = (0..n).map(|i| 0.1 * (i + 3 * (i / 7)) as f64).collect();
        let law = CorrelationLaw::Autoregressive(process);
        let gap = Correlation::new(law, &times).unwrap();
        assert_eq!(gap.runs(), [0..7, 7..12]);
        let irregular: Vec<f64> = (0..n).map(|i| (i as f64).powf(1.3)).collect();
        let time = 2.5;
        let exponential = CorrelationLaw::Exponential { time };
        let exponential = Correlation::new(exponential, &irregular).unwrap();
        let block = |i: usize, j: usize| match (i < 7) == (j < 7) {
            true => lags[i.abs_diff(j)],
            false => 0.0,
        };
        let decay = |i: usize, j: usize| (-(irregular[i] - irregular[j]).abs() / time).exp();
        let cases: [(Correlation, DMatrix<f64>); 2] = [
            (gap, DMatrix::from_fn(n, n, block)),
            (exponential, DMatrix::from_fn(n, n, decay)),
        ];
        for (correlation, matrix) in cases {
            let w = whitening(&correlation, n);
            let unit = &w * &matrix * w.transpose();
            assert!((unit - DMatrix::identity(n, n)).amax() < 1e-13);
            let expected = matrix.determinant().ln();
            assert!((correlation.log_determinant() - expected).abs() < 1e-12);
            let values: Vec<f64> = (0..n).map(|i| (1.7 * i as f64).sin()).collect();
            let transposed = w.transpose() * DMatrix::from_column_slice(n, 1, &values);
            for (a, b) in correlation
                .whiten_transpose(&values)
                .iter()
                .zip(&transposed)
            {
                assert!((a - b).abs() < 1e-14);
            }
            let back = correlation.colour(&correlation.whiten(&values));
            for (a, b) in back.iter().zip(&values) {
                assert!((a - b).abs() < 1e-13);
            }
            let part = correlation.first(9).whiten(&values[..9]);
            assert_eq!(part, correlation.whiten(&values)[..9]);
        }
        assert!(uninterrupted_runs(&irregular).is_none());
    }
}
