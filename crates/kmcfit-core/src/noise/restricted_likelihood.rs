//! Restricted maximum likelihood of the noise: standard deviations and correlations, from linearised residuals.
//!
//! With the whitened and weighted Jacobian `J_c` and residuals `r_c` of each channel `c`, minimise over the noise
//!
//! ```text
//! f = sum_c (n_c log sigma_c^2 + log |R_c|) + min_d sum_c |J_c d + r_c|^2 + log |sum_c J_c^T J_c|
//! ```
//!
//! The last term corrects for the parameters: residuals are whiter and smaller than the noise, most where noise is narrowband near
//! a resonance, and the maximum of the plain likelihood is then biased (Harville 1977). Products of the rows at all lags are
//! computed once, so that the cost of a step does not depend on the number of samples.
//!
//! Penalties `w_j |L_j (theta + d)|^2` with estimated weights `w_j` join the squares and the determinant, and `f` has the further
//! terms `- rank(L_j) log w_j`: a penalty is the prior of a random function (Wahba 1983; Wood 2011).

use super::autoregression::Autoregression;
use super::correlation::Correlation;
use super::penalty_moments::PenaltyMoments;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::ops::Range;

/// Step of central differences in the coordinates.
pub const STEP: f64 = 1e-3;
/// Largest number of Newton steps; three or four suffice from Burg's estimate.
const STEPS: usize = 12;
/// Change of `f` below which the minimum is reached; a change of 1 is a standard error.
const SETTLED: f64 = 1e-6;
/// Largest step in a coordinate: the inverse hyperbolic tangent of a partial autocorrelation, or a logarithm.
const LONGEST: f64 = 1.0;

/// Coordinates of the noise of one channel, in which its likelihood is close to quadratic.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseCoordinates {
    /// Logarithm of sigma relative to its reference value, where it is estimated.
    pub log_sigma: Option<f64>,
    /// Inverse hyperbolic tangents of the partial autocorrelations, or the logarithm of the correlation time.
    pub correlation_parameters: Vec<f64>,
}

impl NoiseCoordinates {
    fn of(estimates_sigma: bool, list: &[f64]) -> Self {
        let first = usize::from(estimates_sigma);
        Self {
            log_sigma: estimates_sigma.then(|| list[0]),
            correlation_parameters: list[first..].to_vec(),
        }
    }
}

/// Products of the rows of one channel from which its likelihood follows.
pub struct ChannelMoments {
    samples: usize,
    estimates_sigma: bool,
    start: Vec<f64>,
    products: Products,
}

enum Products {
    /// Uncorrelated: the Gram matrix.
    White(DMatrix<f64>),
    Autoregressive {
        /// `sum_i x_(i-k) x_(i-l)^T` over the rows with `p` rows of their run before them, for `0 <= k, l <= p`.
        lags: Vec<Vec<DMatrix<f64>>>,
        /// Number of these rows.
        usual: usize,
        /// The rows up to the last of the others, which are whitened anew at each point.
        rows: DMatrix<f64>,
        correlation: Correlation,
    },
    /// Rows to be whitened anew at each point.
    Rows(DMatrix<f64>, Correlation),
}

impl ChannelMoments {
    /// Products of `rows` (samples x (parameters + 1): Jacobian, then residuals, both divided by the reference sigma and not
    /// whitened) of a channel; `correlation` is the start value, `None` for white noise.
    pub fn new(
        rows: &DMatrix<f64>,
        correlation: Option<&Correlation>,
        estimates_sigma: bool,
    ) -> Self {
        let products = match correlation {
            None => Products::White(rows.tr_mul(rows)),
            Some(correlation) => match correlation.autoregressive_runs() {
                Some(runs) => autoregressive(rows, correlation, runs),
                None => Products::Rows(rows.clone(), correlation.clone()),
            },
        };
        let correlation_parameters = correlation.map_or(Vec::new(), Correlation::coordinates);
        let sigma = estimates_sigma.then_some(0.0);
        Self {
            samples: rows.nrows(),
            estimates_sigma,
            start: sigma.into_iter().chain(correlation_parameters).collect(),
            products,
        }
    }

    /// Gram matrix of the whitened rows at `correlation_parameters`, and `log |R|`.
    fn whitened(&self, correlation_parameters: &[f64]) -> (DMatrix<f64>, f64) {
        match &self.products {
            Products::White(gram) => (gram.clone(), 0.0),
            Products::Rows(rows, correlation) => {
                let correlation = correlation.at(correlation_parameters);
                let mut whitened = rows.clone();
                for (mut to, from) in whitened.column_iter_mut().zip(rows.column_iter()) {
                    to.copy_from_slice(&correlation.whiten(from.as_slice()));
                }
                (whitened.tr_mul(&whitened), correlation.log_determinant())
            }
            Products::Autoregressive {
                lags,
                usual,
                rows,
                correlation,
            } => {
                let correlation = correlation.at(correlation_parameters);
                let process = Autoregression::from_coordinates(correlation_parameters);
                let variance = process.innovation_variance();
                let minus = process.coefficients().iter().map(|a| -a);
                let filter: Vec<f64> = std::iter::once(1.0).chain(minus).collect();
                let mut gram = DMatrix::zeros(rows.ncols(), rows.ncols());
                for (k, a) in filter.iter().enumerate() {
                    for (l, b) in filter.iter().enumerate() {
                        gram += &lags[k][l] * (a * b / variance);
                    }
                }
                let mut determinant = *usual as f64 * variance.ln();
                let mut others = Vec::new();
                correlation.each_first_row(|i, coefficients, size| {
                    others.extend(rows.column_iter().map(|column| {
                        let earlier = column.as_slice()[..i].iter().rev();
                        let predicted: f64 = earlier.zip(coefficients).map(|(u, a)| a * u).sum();
                        size * (column[i] - predicted)
                    }));
                    determinant -= 2.0 * size.ln();
                });
                let count = others.len() / rows.ncols();
                let others = DMatrix::from_vec(rows.ncols(), count, others);
                (gram + &others * others.transpose(), determinant)
            }
        }
    }
}

/// Products of the rows of `runs` without a gap at all lags up to the order.
fn autoregressive(
    rows: &DMatrix<f64>,
    correlation: &Correlation,
    runs: &[Range<usize>],
) -> Products {
    let order = correlation.order();
    let usual = |run: &Range<usize>| run.len().saturating_sub(order);
    let needed = (runs.last()).map_or(0, |run| run.end.min(run.start + order));
    let product = |k: usize, l: usize| {
        let runs = runs.iter().filter(|run| usual(run) > 0);
        let zero = DMatrix::zeros(rows.ncols(), rows.ncols());
        runs.fold(zero, |sum, run| {
            let at = |lag: usize| rows.rows(run.start + order - lag, usual(run));
            sum + at(k).tr_mul(&at(l))
        })
    };
    let mut lags: Vec<Vec<DMatrix<f64>>> = Vec::with_capacity(order + 1);
    for k in 0..=order {
        let known = lags.iter().map(|row| row[k].transpose());
        let known: Vec<DMatrix<f64>> = known.collect();
        let further = (k..=order).map(|l| product(k, l));
        lags.push(known.into_iter().chain(further).collect());
    }
    Products::Autoregressive {
        lags,
        usual: runs.iter().map(usual).sum(),
        rows: rows.rows(0, needed).into_owned(),
        correlation: correlation.clone(),
    }
}

/// Gram matrix of the whitened rows of a channel and `log |R|`, by the bits of its correlation parameters.
type WhitenedProducts = BTreeMap<Vec<u64>, (DMatrix<f64>, f64)>;

/// Restricted likelihood of the noise of all channels, and of weights of penalties.
pub struct RestrictedLikelihood {
    channels: Vec<ChannelMoments>,
    /// Gram matrix of rows without noise parameters: priors, and penalties of given weights.
    known: DMatrix<f64>,
    /// Penalties whose weights are coordinates.
    penalties: Vec<PenaltyMoments>,
    /// For each penalty of an estimated weight its logarithm, where it is as good as infinite; such penalties stand in `known`.
    infinite: Vec<Option<f64>>,
    /// The terms `- rank(L_j) log w_j` of such penalties.
    constant: f64,
}

/// Estimated noise and weights.
#[derive(Debug, Clone, PartialEq)]
pub struct RestrictedFit {
    /// Coordinates of each channel.
    pub channels: Vec<NoiseCoordinates>,
    /// Covariance of the coordinates of each channel, the inverse of its restricted information.
    pub covariances: Vec<DMatrix<f64>>,
    /// Logarithms of the weights of the penalties.
    pub log_weights: Vec<f64>,
    /// `f` at the minimum.
    pub value: f64,
}

impl RestrictedLikelihood {
    /// Likelihood of `channels`, with the Gram matrix `known` of rows of priors and of penalties with given weights.
    pub fn new(channels: Vec<ChannelMoments>, known: DMatrix<f64>) -> Self {
        Self {
            channels,
            known,
            penalties: Vec::new(),
            infinite: Vec::new(),
            constant: 0.0,
        }
    }

    /// Adds penalties whose weights are estimated, with start values at the noise of the start.
    #[must_use]
    pub fn with_penalties(mut self, mut penalties: Vec<PenaltyMoments>) -> Self {
        let mut gram = self.known.clone();
        for channel in &self.channels {
            let noise = NoiseCoordinates::of(channel.estimates_sigma, &channel.start);
            gram += channel.whitened(&noise.correlation_parameters).0;
        }
        for (penalty, is_finite) in PenaltyMoments::start(&mut penalties, &gram) {
            self.infinite.push(match is_finite {
                true => None,
                false => {
                    self.known += &penalty.gram * penalty.log_weight.exp();
                    self.constant -= penalty.rank as f64 * penalty.log_weight;
                    Some(penalty.log_weight)
                }
            });
            if is_finite {
                self.penalties.push(penalty.clone());
            }
        }
        self
    }

    fn start(&self) -> Vec<f64> {
        let noise = self.channels.iter().flat_map(|c| c.start.iter().copied());
        let weights = self.penalties.iter().map(|p| p.log_weight);
        noise.chain(weights).collect()
    }

    /// Number of coordinates of the channels; those of the penalties follow.
    fn noise_coordinates(&self) -> usize {
        self.channels.iter().map(|c| c.start.len()).sum()
    }

    fn split(&self, at: &[f64]) -> Vec<NoiseCoordinates> {
        let mut rest = at;
        let each = self.channels.iter().map(|channel| {
            let (own, further) = rest.split_at(channel.start.len());
            rest = further;
            NoiseCoordinates::of(channel.estimates_sigma, own)
        });
        each.collect()
    }

    /// `f` at the coordinates of all channels and the logarithms of the weights; NaN where the Gram matrix is not positive definite.
    pub fn value(&self, at: &[f64]) -> f64 {
        self.value_beside(at, &mut vec![BTreeMap::new(); self.channels.len()])
    }

    /// [`Self::value`], with the whitened products of each channel at earlier points.
    fn value_beside(&self, at: &[f64], whitened: &mut [WhitenedProducts]) -> f64 {
        let mut gram = self.known.clone();
        let mut constant = self.constant;
        let channels = self.channels.iter().zip(whitened);
        for ((channel, whitened), noise) in channels.zip(self.split(at)) {
            let position = noise.correlation_parameters.iter().map(|z| z.to_bits());
            let whitened = whitened.entry(position.collect());
            let (own, determinant) =
                whitened.or_insert_with(|| channel.whitened(&noise.correlation_parameters));
            let (own, determinant) = (&*own, *determinant);
            let log_sigma = noise.log_sigma.unwrap_or(0.0);
            gram += own * (-2.0 * log_sigma).exp();
            constant += 2.0 * channel.samples as f64 * log_sigma + determinant;
        }
        let weights = &at[self.noise_coordinates()..];
        for (penalty, log_weight) in self.penalties.iter().zip(weights) {
            gram += &penalty.gram * log_weight.exp();
            constant -= penalty.rank as f64 * log_weight;
        }
        let q = gram.nrows() - 1;
        let right = gram.view((0, q), (q, 1)).into_owned();
        let squares = gram[(q, q)];
        let Some(root) = gram.view((0, 0), (q, q)).into_owned().cholesky() else {
            return f64::NAN;
        };
        let explained = right.dot(&root.solve(&right));
        let log_determinant: f64 = root.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        constant + squares - explained + log_determinant
    }

    /// Minimum of `f` by Newton steps with central differences, and the covariance `2 H^-1` of the coordinates with the Hessian
    /// `H`. `None` where there is nothing to estimate or the likelihood is not finite.
    pub fn fit(&self) -> Option<RestrictedFit> {
        let mut at = self.start();
        let mut value = self.value(&at);
        if at.is_empty() && self.infinite.is_empty() || !value.is_finite() {
            return None;
        }
        if at.is_empty() {
            return Some(self.result(&at, &DMatrix::zeros(0, 0), value));
        }
        for _ in 0..STEPS {
            let (gradient, hessian) = self.derivatives(&at, value);
            let step = newton_step(&gradient, &hessian)?;
            let longest = step.iter().fold(0.0f64, |most, s| most.max(s.abs()));
            let mut length = (LONGEST / longest).min(1.0);
            let mut settled = true;
            for _ in 0..8 {
                let trial: Vec<f64> = at.iter().zip(&step).map(|(z, s)| z + length * s).collect();
                let lower = self.value(&trial);
                if lower < value {
                    settled = value - lower < SETTLED;
                    (at, value) = (trial, lower);
                    break;
                }
                length *= 0.5;
            }
            if settled {
                break;
            }
        }
        let (_, hessian) = self.derivatives(&at, value);
        let covariance = positive(&hessian).try_inverse()? * 2.0;
        Some(self.result(&at, &covariance, value))
    }

    /// The estimate at the coordinates, with their covariance and `f`.
    fn result(&self, at: &[f64], covariance: &DMatrix<f64>, value: f64) -> RestrictedFit {
        let mut first = 0;
        let blocks = self.channels.iter().map(|channel| {
            let count = channel.start.len();
            let block = covariance.view((first, first), (count, count));
            first += count;
            block.into_owned()
        });
        let covariances = blocks.collect();
        let mut estimated = at[self.noise_coordinates()..].iter();
        let log_weights = self.infinite.iter();
        RestrictedFit {
            value,
            covariances,
            channels: self.split(at),
            log_weights: log_weights
                .filter_map(|infinite| infinite.or_else(|| estimated.next().copied()))
                .collect(),
        }
    }

    fn derivatives(&self, at: &[f64], value: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = at.len();
        // Most points differ from others in one channel only.
        let mut whitened = vec![BTreeMap::new(); self.channels.len()];
        let mut moved = |changes: &[(usize, f64)]| {
            let mut trial = at.to_vec();
            changes.iter().for_each(|(j, by)| trial[*j] += by);
            self.value_beside(&trial, &mut whitened)
        };
        let sides: Vec<[f64; 2]> = (0..n)
            .map(|j| [STEP, -STEP].map(|h| moved(&[(j, h)])))
            .collect();
        let gradient = DMatrix::from_fn(n, 1, |j, _| (sides[j][0] - sides[j][1]) / (2.0 * STEP));
        let mut hessian = DMatrix::zeros(n, n);
        for j in 0..n {
            hessian[(j, j)] = (sides[j][0] - 2.0 * value + sides[j][1]) / (STEP * STEP);
            for k in 0..j {
                let both = moved(&[(j, STEP), (k, STEP)]) + moved(&[(j, -STEP), (k, -STEP)]);
                let alone = sides[j][0] + sides[j][1] + sides[k][0] + sides[k][1];
                let mixed = (both - alone + 2.0 * value) / (2.0 * STEP * STEP);
                hessian[(j, k)] = mixed;
                hessian[(k, j)] = mixed;
            }
        }
        (gradient, hessian)
    }
}

/// Hessian with its eigenvalues replaced by their absolute values, at least 1e-3: a descent direction where it is indefinite.
fn positive(hessian: &DMatrix<f64>) -> DMatrix<f64> {
    if !hessian.iter().all(|x| x.is_finite()) {
        return DMatrix::zeros(hessian.nrows(), hessian.ncols());
    }
    let mut eigen = hessian.clone().symmetric_eigen();
    for value in eigen.eigenvalues.iter_mut() {
        *value = value.abs().max(1e-3);
    }
    eigen.recompose()
}

fn newton_step(gradient: &DMatrix<f64>, hessian: &DMatrix<f64>) -> Option<Vec<f64>> {
    let step = -(positive(hessian).try_inverse()? * gradient);
    let is_finite = step.iter().all(|x| x.is_finite());
    is_finite.then(|| step.as_slice().to_vec())
}

#[cfg(test)]
mod tests {
    use super::super::correlation::CorrelationLaw;
    use super::*;
    use crate::diagnostics::noise::auto_regression;

    fn rows(columns: &[Vec<f64>]) -> DMatrix<f64> {
        DMatrix::from_fn(columns[0].len(), columns.len(), |i, j| columns[j][i])
    }

    /// A line in AR(1) and AR(2) noise at given coefficients: `f` from dense matrices, without and with a gap.
    #[test]
    fn the_likelihood_agrees_with_dense_matrices() {
        agrees_with_dense_matrices(&[0.5, -0.3], 0);
        agrees_with_dense_matrices(&[0.5], 4);
    }

    fn agrees_with_dense_matrices(partial: &[f64], gap: usize) {
        let n = 40;
        let values = auto_regression(3, n, 0.6);
        let ramp: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        let x = rows(&[vec![1.0; n], ramp, values]);
        let times: Vec<f64> = (0..n).map(|i| (i + gap * (i / 25)) as f64).collect();
        let process = Autoregression::new(partial.to_vec()).unwrap();
        let lags = process.autocorrelation(n + gap);
        let law = CorrelationLaw::Autoregressive(process.clone());
        let correlation = Correlation::new(law, &times).unwrap();
        let moments = ChannelMoments::new(&x, Some(&correlation), true);
        let likelihood = RestrictedLikelihood::new(vec![moments], DMatrix::zeros(3, 3));
        let log_sigma = 0.3f64;
        let mut at = vec![log_sigma];
        at.extend(process.coordinates());
        let position = |i: usize| i + gap * (i / 25);
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            (2.0 * log_sigma).exp() * lags[position(i).abs_diff(position(j))]
        });
        let inverse = matrix.clone().try_inverse().unwrap();
        let (j, r) = (x.columns(0, 2), x.columns(2, 1));
        let information = j.transpose() * &inverse * j;
        let solution = information.clone().try_inverse().unwrap() * j.transpose() * &inverse * r;
        let left = r - j * solution;
        let squares = (left.transpose() * &inverse * &left)[(0, 0)];
        let expected = matrix.determinant().ln() + squares + information.determinant().ln();
        assert!((likelihood.value(&at) - expected).abs() < 1e-9);
    }

    /// A penalty is a random effect: `y = X a + Z u + e` with `u ~ N(0, 1/w)` has the covariance `V = sigma^2 + Z Z^T/w`, and `f`
    /// differs from `log |V| + log |X^T V^-1 X| + y^T (V^-1 - V^-1 X (X^T V^-1 X)^-1 X^T V^-1) y` by a constant.
    #[test]
    fn the_likelihood_with_a_penalty_is_that_of_a_random_effect() {
        let (n, effects) = (30, 5);
        let ramp: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        let mut columns = vec![vec![1.0; n], ramp];
        for k in 0..effects {
            columns.push(
                (0..n)
                    .map(|i| ((k + 1) as f64 * 0.7 * i as f64).sin())
                    .collect(),
            );
        }
        let fixed = rows(&columns[..2]);
        let random = rows(&columns[2..]);
        let effect = |i: usize| columns[2][i] - 0.8 * columns[4][i] + 0.6 * columns[5][i];
        let values: Vec<f64> = (auto_regression(7, n, 0.4).iter().enumerate())
            .map(|(i, e)| effect(i) + 0.3 * e)
            .collect();
        columns.push(values.clone());
        let moments = ChannelMoments::new(&rows(&columns), None, true);
        let mut gram = DMatrix::zeros(effects + 3, effects + 3);
        (2..2 + effects).for_each(|i| gram[(i, i)] = 1.0);
        let q = columns.len();
        let penalty = PenaltyMoments {
            gram,
            rank: effects,
            log_weight: 0.0,
        };
        let likelihood = RestrictedLikelihood::new(vec![moments], DMatrix::zeros(q, q))
            .with_penalties(vec![penalty]);
        assert_eq!(likelihood.penalties.len(), 1);
        let y = DMatrix::from_column_slice(n, 1, &values);
        let marginal = |log_sigma: f64, log_weight: f64| {
            let noise = DMatrix::identity(n, n) * (2.0 * log_sigma).exp();
            let v = noise + &random * random.transpose() * (-log_weight).exp();
            let inverse = v.clone().try_inverse().unwrap();
            let information = fixed.transpose() * &inverse * &fixed;
            let projected = &inverse
                * &fixed
                * information.clone().try_inverse().unwrap()
                * fixed.transpose()
                * &inverse;
            let squares = (y.transpose() * (inverse - projected) * &y)[(0, 0)];
            v.determinant().ln() + information.determinant().ln() + squares
        };
        let reference = likelihood.value(&[0.0, 0.0]) - marginal(0.0, 0.0);
        for at in [[0.2, 1.0], [-0.5, 3.0], [0.1, -2.0]] {
            let difference = likelihood.value(&at) - marginal(at[0], at[1]);
            assert!(
                (difference - reference).abs() < 1e-9,
                "{difference} {reference}"
            );
        }
        // The estimate is a minimum of both.
        let found = likelihood.fit().unwrap();
        let at = [found.channels[0].log_sigma.unwrap(), found.log_weights[0]];
        let least = marginal(at[0], at[1]);
        for step in [[0.05, 0.0], [-0.05, 0.0], [0.0, 0.05], [0.0, -0.05]] {
            assert!(marginal(at[0] + step[0], at[1] + step[1]) > least);
        }
    }

    /// White noise of one channel with an estimated sigma: `sigma^2 = RSS/(n - q)`, of which the logarithm has the variance
    /// `2/(n - q)`.
    #[test]
    fn the_sigma_of_white_noise_is_the_unbiased_one() {
        let n = 60;
        let ramp: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        let x = rows(&[vec![1.0; n], ramp, auto_regression(5, n, 0.0)]);
        let moments = ChannelMoments::new(&x, None, true);
        let likelihood = RestrictedLikelihood::new(vec![moments], DMatrix::zeros(3, 3));
        let found = likelihood.fit().unwrap();
        let (j, r) = (x.columns(0, 2).into_owned(), x.columns(2, 1).into_owned());
        let left = &r - &j * j.clone().svd(true, true).solve(&r, 1e-14).unwrap();
        let expected = 0.5 * (left.norm_squared() / (n - 2) as f64).ln();
        assert!((found.channels[0].log_sigma.unwrap() - expected).abs() < 1e-4);
        let variance = found.covariances[0][(0, 0)];
        // For log sigma, a quarter of that of log sigma^2.
        assert!((variance * 2.0 * (n - 2) as f64 - 1.0).abs() < 1e-3);
    }

    /// Mean of estimates from short records with two regressors: the restricted estimate is closer to the truth than Burg's.
    #[test]
    fn restricted_estimates_of_short_records_are_less_biased_than_burg_s() {
        let (n, truth, seeds) = (60, 0.6, 200);
        let sine = |i: usize, phase: f64| (0.2 * i as f64 + phase).sin();
        let columns: Vec<Vec<f64>> = (0..6)
            .map(|k| {
                (0..n)
                    .map(|i| sine(i * (k / 2 + 1), (k % 2) as f64))
                    .collect()
            })
            .collect();
        let times: Vec<f64> = (0..n).map(|i| i as f64).collect();
        let (mut burg_mean, mut mean) = (0.0, 0.0);
        for seed in 0..seeds {
            let mut all = columns.clone();
            let noise = auto_regression(seed, n, truth);
            let (j, r) = (rows(&all), DMatrix::from_column_slice(n, 1, &noise));
            let left = &r - &j * j.clone().svd(true, true).solve(&r, 1e-12).unwrap();
            let process = super::super::burg(left.as_slice(), std::slice::from_ref(&(0..n)), 1);
            burg_mean += process.partial()[0] / seeds as f64;
            all.push(noise);
            let law = CorrelationLaw::Autoregressive(process);
            let correlation = Correlation::new(law, &times).unwrap();
            let moments = ChannelMoments::new(&rows(&all), Some(&correlation), true);
            let found = RestrictedLikelihood::new(vec![moments], DMatrix::zeros(7, 7)).fit();
            mean += found.unwrap().channels[0].correlation_parameters[0].tanh() / seeds as f64;
        }
        // The standard error of each mean is 0.1/sqrt(200) = 0.007; six sines take much of the low frequencies.
        assert!(
            (mean - truth).abs() < 0.5 * (burg_mean - truth).abs(),
            "{mean} {burg_mean}"
        );
    }
}
